//! Shaders: WGSL parts put together, constants in front, and what `naga` says about the result.
//!
//! A kernel is a list of parts, the last of which has the entry point `main`. Bindings are all in group 0: the
//! uniform at 0, with an offset given at each dispatch, storage buffers and textures after it.

use std::fmt::Write;
use wgpu::naga;

/// A part of a shader: its name and text. The name stands for the text: parts are compared by it.
#[derive(Debug, Clone, Copy)]
pub struct Part {
    pub name: &'static str,
    pub text: &'static str,
}

impl PartialEq for Part {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for Part {}

impl std::hash::Hash for Part {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.name.hash(state);
    }
}

/// Includes `shaders/NAME.wgsl`.
macro_rules! part {
    ($name:literal) => {
        $crate::shader::Part {
            name: $name,
            text: include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/shaders/", $name, ".wgsl")),
        }
    };
}
pub(crate) use part;

/// What a kernel is made of; equal specifications are one kernel.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Spec {
    /// The parts, in order.
    pub parts: Vec<Part>,
    /// Constants in front of the parts.
    pub constants: Vec<(&'static str, Constant)>,
}

/// A constant of a kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Constant {
    Count(u32),
    Flag(bool),
}

impl Spec {
    pub fn new(parts: &[Part], constants: &[(&'static str, Constant)]) -> Self {
        Self { parts: parts.to_vec(), constants: constants.to_vec() }
    }

    /// The last part's name and the constants, for messages and captures.
    pub fn label(&self) -> String {
        let mut label = self.parts.last().map_or_else(String::new, |part| part.name.to_owned());
        for (name, value) in &self.constants {
            let _ = match value {
                Constant::Count(n) => write!(label, " {name}={n}"),
                Constant::Flag(true) => write!(label, " {name}"),
                Constant::Flag(false) => Ok(()),
            };
        }
        label
    }

    /// The whole shader.
    pub fn source(&self) -> String {
        let mut source = String::new();
        for (name, value) in &self.constants {
            let _ = match value {
                Constant::Count(n) => writeln!(source, "const {name}: u32 = {n}u;"),
                Constant::Flag(flag) => writeln!(source, "const {name}: bool = {flag};"),
            };
        }
        for part in &self.parts {
            let _ = writeln!(source, "// {}.wgsl\n{}", part.name, part.text);
        }
        source
    }
}

/// What is bound at one place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Slot {
    Uniform { size: u64 },
    Storage { read_only: bool },
    Texture,
    DepthTexture,
}

/// The layout of one uniform field: name, offset, size in bytes.
pub type Field = (String, u32, u32);

/// What a shader's text says about its interface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Interface {
    /// Bindings in order of their number.
    pub slots: Vec<(u32, Slot)>,
    /// Fields of the uniform's structure.
    pub uniform: Vec<Field>,
    /// Bytes of workgroup memory.
    pub workgroup_bytes: u64,
}

/// Reads a shader's interface.
///
/// # Errors
/// What `naga` finds wrong with it.
pub fn interface(source: &str) -> Result<Interface, String> {
    let module = naga::front::wgsl::parse_str(source).map_err(|error| error.emit_to_string(source))?;
    let mut layouter = naga::proc::Layouter::default();
    layouter.update(module.to_ctx()).map_err(|error| error.to_string())?;
    let mut slots = Vec::new();
    let mut uniform = Vec::new();
    let mut workgroup_bytes = 0;
    for (_, variable) in module.global_variables.iter() {
        let ty = &module.types[variable.ty].inner;
        if variable.space == naga::AddressSpace::WorkGroup {
            workgroup_bytes += u64::from(layouter[variable.ty].size.next_multiple_of(16));
        }
        let Some(binding) = variable.binding else { continue };
        let slot = match (variable.space, ty) {
            (naga::AddressSpace::Uniform, naga::TypeInner::Struct { members, .. }) => {
                for member in members {
                    let size = layouter[member.ty].size;
                    uniform.push((member.name.clone().unwrap_or_default(), member.offset, size));
                }
                Slot::Uniform { size: u64::from(layouter[variable.ty].size) }
            }
            (naga::AddressSpace::Storage { access }, _) => {
                Slot::Storage { read_only: !access.contains(naga::StorageAccess::STORE) }
            }
            (_, naga::TypeInner::Image { class: naga::ImageClass::Depth { .. }, .. }) => Slot::DepthTexture,
            (_, naga::TypeInner::Image { .. }) => Slot::Texture,
            (space, _) => return Err(format!("binding {} lies in {space:?}", binding.binding)),
        };
        slots.push((binding.binding, slot));
    }
    slots.sort_by_key(|(binding, _)| *binding);
    Ok(Interface { slots, uniform, workgroup_bytes })
}

/// A uniform structure whose fields are known by name, offset and size, to be compared with the shader's.
pub trait Uniform: bytemuck::Pod {
    /// (name, offset, size) of each field.
    const FIELDS: &'static [(&'static str, usize, usize)];
}

/// Declares a uniform structure for Rust, in the order of the shader's.
macro_rules! uniform {
    ($(#[$meta:meta])* $name:ident { $($(#[$field_meta:meta])* $field:ident: $ty:ty),* $(,)? }) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        pub struct $name { $($(#[$field_meta])* pub $field: $ty,)* }

        impl $crate::shader::Uniform for $name {
            const FIELDS: &'static [(&'static str, usize, usize)] = &[
                $((stringify!($field), std::mem::offset_of!($name, $field), size_of::<$ty>()),)*
            ];
        }
    };
}
pub(crate) use uniform;

/// Whether a Rust structure lies in memory as the shader's does.
pub fn same_layout<U: Uniform>(interface: &Interface) -> Result<(), String> {
    let ours: Vec<Field> =
        U::FIELDS.iter().map(|(name, at, size)| ((*name).to_owned(), *at as u32, *size as u32)).collect();
    if ours == interface.uniform {
        Ok(())
    } else {
        Err(format!("the shader has {:?}, the program {ours:?}", interface.uniform))
    }
}
