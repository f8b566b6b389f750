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
    ///
    /// # Errors
    /// A file that is no glTF, or has what this small reader does not know.
    pub fn from_glb(bytes: &[u8]) -> Result<Self> {
        let gltf = gltf::Gltf::from_slice(bytes).context("the scene is no glTF file; give a .glb")?;
        let blob = gltf.blob.as_deref().context("the scene's buffers are in other files; give one .glb")?;
        let mut scene = Self::default();
        // Nodes share meshes: each is read once.
        let mut meshes = Vec::new();
        for mesh in gltf.meshes() {
            let parts: Result<Vec<_>> = mesh.primitives().map(|part| scene.add(&part, blob)).collect();
            meshes.push(parts?);
        }
        let top = gltf.default_scene().context("the file has no scene")?;
        let mut open: Vec<_> = top.nodes().map(|node| (node, Mat4::IDENTITY)).collect();
        while let Some((node, parent)) = open.pop() {
            let place = parent * Mat4::from_cols_array_2d(&node.transform().matrix());
            open.extend(node.children().map(|child| (child, place)));
            for part in node.mesh().iter().flat_map(|mesh| &meshes[mesh.index()]) {
                let (name, mut look) = (node.name().unwrap_or_default().to_owned(), part.look);
                let (centre, radius) = part.sphere;
                let widest = place.to_scale_rotation_translation().0.abs().max_element();
                let sphere = (place.transform_point3(centre), radius * widest);
                look.place = place;
                scene.objects.push(Object { name, look, sphere, indices: part.indices.clone() });
            }
        }
        scene.objects.sort_by(|a, b| b.look.emission.w.total_cmp(&a.look.emission.w));
        Ok(scene)
    }

    /// One mesh of one material, at the origin.
    fn add(&mut self, part: &gltf::Primitive<'_>, blob: &[u8]) -> Result<Object> {
        ensure!(part.mode() == gltf::mesh::Mode::Triangles, "a mesh has no triangles; export triangles");
        let reader = part.reader(|_| Some(blob));
        let positions = reader.read_positions().context("a mesh of the scene has no positions")?;
        let normals = reader.read_normals().context("a mesh of the scene has no normals; export them")?;
        let indices = reader.read_indices().context("a mesh of the scene has no indices; export them")?;
        let (base, first) = (self.vertices.len() as u32, self.indices.len() as u32);
        self.vertices.extend(positions.zip(normals).map(|(p, n)| [p.into(), n.into()]));
        self.indices.extend(indices.into_u32().map(|index| base + index));
        let (low, high) = (Vec3::from(part.bounding_box().min), Vec3::from(part.bounding_box().max));
        let material = part.material();
        let surface = material.pbr_metallic_roughness();
        let color = Vec4::from(surface.base_color_factor()).truncate().extend(surface.roughness_factor());
        let emission = Vec3::from(material.emissive_factor()) * material.emissive_strength().unwrap_or(1.0);
        // What is higher than wide stands on something, and its shadow is seen.
        let height = if high.y > high.x - low.x { high.y } else { 0.0 };
        Ok(Object {
            name: String::new(),
            indices: first..self.indices.len() as u32,
            look: Look { place: Mat4::IDENTITY, color, emission: emission.extend(height) },
            sphere: (0.5 * (low + high), 0.5 * (high - low).length()),
        })
    }
}
