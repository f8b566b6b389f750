//! glTF to vertices, indices and objects.

use anyhow::{Context as _, Result, bail};
use glam::{Mat4, Vec3, Vec4};

/// The scene that comes with the example; `scene/make.py` makes it.
pub const CHESS: &[u8] = include_bytes!("../scene/chess.glb");

/// One corner of a triangle.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    /// In the object's own space, metres.
    pub position: Vec3,
    /// Of length 1.
    pub normal: Vec3,
}

/// What the shader knows of an object; `Object` in `scene.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Look {
    /// Where it stands.
    pub place: Mat4,
    /// Base colour, linear; w is roughness.
    pub color: Vec4,
    /// Light that it gives itself.
    pub emission: Vec4,
}

/// A mesh at a place.
#[derive(Debug, Clone)]
pub struct Object {
    /// The node's name in the file.
    pub name: String,
    /// Its part of [`Scene::indices`].
    pub indices: std::ops::Range<u32>,
    /// What the indices count from, in [`Scene::vertices`].
    pub base_vertex: i32,
    /// Its place and material.
    pub look: Look,
    /// A sphere around it, in the world.
    pub centre: Vec3,
    /// The sphere's radius.
    pub radius: f32,
}

/// Everything in a file.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// Of all meshes, one after the other.
    pub vertices: Vec<Vertex>,
    /// Of all meshes, one after the other.
    pub indices: Vec<u32>,
    /// What is drawn.
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
        for mesh in gltf.document.meshes() {
            let parts: Result<Vec<_>> = mesh.primitives().map(|part| scene.add(&part, blob)).collect();
            meshes.push(parts?);
        }
        let top = gltf.document.default_scene().or_else(|| gltf.document.scenes().next());
        let mut open: Vec<_> =
            top.context("the file has no scene")?.nodes().map(|node| (node, Mat4::IDENTITY)).collect();
        while let Some((node, parent)) = open.pop() {
            let place = parent * Mat4::from_cols_array_2d(&node.transform().matrix());
            open.extend(node.children().map(|child| (child, place)));
            for part in node.mesh().iter().flat_map(|mesh| &meshes[mesh.index()]) {
                let mut object = part.clone();
                let widest = [place.x_axis, place.y_axis, place.z_axis].map(|axis| axis.length());
                object.name = node.name().unwrap_or_default().to_owned();
                object.centre = place.transform_point3(part.centre);
                object.radius = part.radius * widest.into_iter().fold(0.0, f32::max);
                object.look.place = place;
                scene.objects.push(object);
            }
        }
        Ok(scene)
    }

    /// One mesh of one material, at the origin.
    fn add(&mut self, part: &gltf::Primitive<'_>, blob: &[u8]) -> Result<Object> {
        if part.mode() != gltf::mesh::Mode::Triangles {
            bail!("a mesh of the scene has {:?} instead of triangles; export triangles", part.mode());
        }
        let reader = part.reader(|_| Some(blob));
        let positions = reader.read_positions().context("a mesh of the scene has no positions")?;
        let normals = reader.read_normals().context("a mesh of the scene has no normals; export them")?;
        let indices = reader.read_indices().context("a mesh of the scene has no indices; export them")?;
        let (base_vertex, first) = (self.vertices.len(), self.indices.len());
        self.vertices
            .extend(positions.zip(normals).map(|(p, n)| Vertex { position: p.into(), normal: n.into() }));
        self.indices.extend(indices.into_u32());
        let bounds = part.bounding_box();
        let (low, high) = (Vec3::from(bounds.min), Vec3::from(bounds.max));
        let material = part.material();
        let surface = material.pbr_metallic_roughness();
        let color = Vec4::from(surface.base_color_factor()).truncate();
        let emission = Vec3::from(material.emissive_factor()) * material.emissive_strength().unwrap_or(1.0);
        Ok(Object {
            name: String::new(),
            indices: first as u32..self.indices.len() as u32,
            base_vertex: base_vertex as i32,
            look: Look {
                place: Mat4::IDENTITY,
                color: color.extend(surface.roughness_factor()),
                emission: emission.extend(0.0),
            },
            centre: 0.5 * (low + high),
            radius: 0.5 * (high - low).length(),
        })
    }
}
