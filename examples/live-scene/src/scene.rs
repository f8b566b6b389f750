//! glTF to vertices, indices and objects.

use anyhow::{Context as _, Result, ensure};
use glam::{Mat4, Vec3, Vec4};

/// A corner of a triangle: its position in the object's own space, in metres, and its normal.
pub type Vertex = [Vec3; 2];

/// What the shader knows of an object; `Object` in `scene.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Look {
    /// Where it stands.
    pub place: Mat4,
    /// Base colour, linear; w is roughness.
    pub color: Vec4,
    /// Light that it gives itself; w is the height of what throws a shadow, else 0.
    pub emission: Vec4,
}

/// A mesh at a place.
#[derive(Debug, Clone)]
pub struct Object {
    /// The node's name in the file.
    pub name: String,
    /// Its part of [`Scene::indices`].
    pub indices: std::ops::Range<u32>,
    /// Its place and material.
    pub look: Look,
    /// A sphere around it, in the world: centre and radius.
    pub sphere: (Vec3, f32),
}

/// Everything in a file.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// Of all meshes, one after the other.
    pub vertices: Vec<Vertex>,
    /// Of all meshes, one after the other.
    pub indices: Vec<u32>,
    /// What is drawn; first what throws a shadow.
    pub objects: Vec<Object>,
}

impl Scene {
    /// Reads a binary glTF file: triangles with normals, and materials without textures.
    pub fn from_glb(bytes: &[u8]) -> Result<Self> {
        let gltf = gltf::Gltf::from_slice(bytes).context("the scene is no glTF file; give a .glb")?;
        let blob = gltf.blob.as_deref().context("the scene's buffers are in other files; give one .glb")?;
        let mut scene = Self::default();
        let top = gltf.default_scene().context("the file has no scene")?;
        let mut open: Vec<_> = top.nodes().map(|node| (node, Mat4::IDENTITY)).collect();
        while let Some((node, parent)) = open.pop() {
            let place = parent * Mat4::from_cols_array_2d(&node.transform().matrix());
            for part in node.mesh().iter().flat_map(gltf::Mesh::primitives) {
                scene.add(node.name().unwrap_or_default(), &part, blob, place)?;
            }
            open.extend(node.children().map(|child| (child, place)));
        }
        scene.objects.sort_by(|a, b| b.look.emission.w.total_cmp(&a.look.emission.w));
        Ok(scene)
    }

    /// One mesh of one material.
    fn add(&mut self, name: &str, part: &gltf::Primitive<'_>, blob: &[u8], place: Mat4) -> Result<()> {
        ensure!(part.mode() == gltf::mesh::Mode::Triangles, "'{name}' is not of triangles");
        let lacks = |what| format!("'{name}' has no {what}; export them");
        let reader = part.reader(|_| Some(blob));
        let positions = reader.read_positions().with_context(|| lacks("positions"))?;
        let normals = reader.read_normals().with_context(|| lacks("normals"))?;
        let indices = reader.read_indices().with_context(|| lacks("indices"))?;
        let (base, first) = (self.vertices.len() as u32, self.indices.len() as u32);
        self.vertices.extend(positions.zip(normals).map(|(p, n)| [p.into(), n.into()]));
        self.indices.extend(indices.into_u32().map(|index| base + index));
        let (low, high) = (Vec3::from(part.bounding_box().min), Vec3::from(part.bounding_box().max));
        let widest = place.to_scale_rotation_translation().0.abs().max_element();
        let sphere = (place.transform_point3(0.5 * (low + high)), 0.5 * (high - low).length() * widest);
        let material = part.material();
        let surface = material.pbr_metallic_roughness();
        let color = Vec4::from(surface.base_color_factor()).truncate().extend(surface.roughness_factor());
        let emission = Vec3::from(material.emissive_factor()) * material.emissive_strength().unwrap_or(1.0);
        // What is higher than wide stands on something, and its shadow is seen.
        let height = if high.y > high.x - low.x { high.y } else { 0.0 };
        let look = Look { place, color, emission: emission.extend(height) };
        let indices = first..self.indices.len() as u32;
        self.objects.push(Object { name: name.to_owned(), indices, look, sphere });
        Ok(())
    }
}
