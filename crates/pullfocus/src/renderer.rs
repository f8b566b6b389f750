//! One renderer for every device.

use crate::device::Device;
use pullfocus_core::{
    Camera, Cancel, Distance, Error, Frame, Plane, Report, Result, Scene, Settings, Storage,
};
use std::fmt::Debug;

/// What the renderer asks of a GPU.
trait Gpu: Debug + Send {
    /// How planes lie in its memory from the next frame on.
    fn set_storage(&mut self, storage: Storage);

    /// As [`Renderer::render`]. Where it refuses a picture or is lost, the scene is as it was.
    fn render(
        &mut self,
        scene: &mut Scene,
        camera: Option<&Camera>,
        settings: &Settings,
        cancel: &Cancel,
    ) -> Result<Report>;
}

/// Renders frames, one after the other, on the device that was chosen; its buffers stay from frame to frame.
///
/// On the CPU work runs on the rayon pool of the calling thread, and the result is the same, byte for byte, for any
/// number of threads.
#[derive(Debug)]
pub struct Renderer {
    cpu: pullfocus_cpu::Renderer,
    gpu: Option<Box<dyn Gpu>>,
    name: String,
    /// What stands behind the name in brackets.
    detail: Option<String>,
    may_fall_back: bool,
    fell_back: Option<String>,
}

const CPU: &str = "cpu";

impl Default for Renderer {
    fn default() -> Self {
        Self::new()
    }
}

impl Renderer {
    /// A renderer on the CPU, without buffers; the first frame makes them.
    pub fn new() -> Self {
        Self::on_cpu(None)
    }

    fn on_cpu(detail: Option<String>) -> Self {
        Self {
            cpu: pullfocus_cpu::Renderer::new(),
            gpu: None,
            name: CPU.into(),
            detail,
            may_fall_back: false,
            fell_back: None,
        }
    }

    /// A renderer on this device. Opening a GPU takes tenths of a second; a renderer serves any number of frames.
    ///
    /// # Errors
    /// [`Error::NoDevice`], with the devices there are, if [`Device::Gpu`] is not there or cannot be used. What the
    /// driver refuses. [`Device::Auto`] and [`Device::Cpu`] always open.
    pub fn open(device: &Device) -> Result<Self> {
        match device {
            Device::Cpu => Ok(Self::new()),
            Device::Auto => Ok(open_best().unwrap_or_else(|why| Self::on_cpu(Some(why)))),
            Device::Gpu(name) => open_gpu(name.as_deref()),
        }
    }

    /// The device's name: "cpu", or a GPU's as its driver gives it.
    pub fn device_name(&self) -> &str {
        &self.name
    }

    /// The device in a line for people: a GPU with its programming interface, as in "NVIDIA H100 (Vulkan)"; the CPU
    /// with the reason where [`Device::Auto`] took it, as in "cpu (no GPU was found)".
    pub fn device_text(&self) -> String {
        match &self.detail {
            Some(detail) => format!("{} ({detail})", self.name),
            None => self.name.clone(),
        }
    }

    /// Whether the next frame goes to a GPU.
    pub fn is_gpu(&self) -> bool {
        self.gpu.is_some()
    }

    /// Why the last frame was rendered on the CPU although the device was a GPU, in one sentence; none if it was
    /// not. Only [`Device::Auto`] falls back.
    pub fn fell_back(&self) -> Option<&str> {
        self.fell_back.as_deref()
    }

    /// The name of the device that rendered the last frame: [`Renderer::device_name`], or "cpu" if it fell back.
    pub fn rendered_on(&self) -> &str {
        if self.fell_back.is_some() { CPU } else { &self.name }
    }

    /// How a GPU keeps planes in its memory from the next frame on; the CPU keeps f32.
    pub fn set_storage(&mut self, storage: Storage) {
        if let Some(gpu) = &mut self.gpu {
            gpu.set_storage(storage);
        }
    }

    /// Replaces `scene.base.picture` by the picture through the lens. Alpha and further planes go through
    /// the same lens; depth stays as it was. The camera may be left out where circles of confusion are given.
    ///
    /// Colours that are no numbers have a stated rule: NaN becomes 0, infinity the largest half, 65504.
    ///
    /// A renderer of [`Device::Auto`] renders on the CPU what its GPU has no room for or no method, and everything once the
    /// GPU is lost; [`Renderer::fell_back`] says so.
    ///
    /// # Errors
    /// Any [`Error`]; the picture is then unspecified, but whole. On the CPU [`Error::Cancelled`] comes within 50 ms
    /// of the flag.
    pub fn render(
        &mut self,
        scene: &mut Scene,
        camera: Option<&Camera>,
        settings: &Settings,
        cancel: &Cancel,
    ) -> Result<Report> {
        if let Some(gpu) = &mut self.gpu {
            self.fell_back = None;
            match gpu.render(scene, camera, settings, cancel) {
                Err(error) if self.may_fall_back && is_devices(&error) => self.fall_back(&error),
                result => return result,
            }
        }
        self.cpu.render(scene, camera, settings, cancel)
    }

    fn fall_back(&mut self, error: &Error) {
        self.fell_back = Some(match error {
            Error::DeviceLost { device, reason } => {
                self.gpu = None;
                self.detail = Some(format!("{device} was lost"));
                self.name = CPU.into();
                format!("{device} was lost ({reason}), so frames are rendered on the CPU from here on")
            }
            error => format!("rendered on the CPU, not on {}: {error}", self.name),
        });
    }

    /// Writes the signed circle of confusion of `distance` (diameter in pixels, positive behind focus) into `coc`.
    /// This is done on the CPU, whatever the device.
    ///
    /// # Errors
    /// Any [`Error`].
    pub fn circle_of_confusion(
        &mut self,
        frame: &Frame,
        distance: &Distance,
        camera: Option<&Camera>,
        settings: &Settings,
        cancel: &Cancel,
        coc: &mut Plane,
    ) -> Result<Report> {
        self.cpu.circle_of_confusion(frame, distance, camera, settings, cancel, coc)
    }
}

/// Whether another device may do what this one could not.
fn is_devices(error: &Error) -> bool {
    matches!(
        error,
        Error::DeviceLimit { .. }
            | Error::OutOfMemory { .. }
            | Error::DeviceLost { .. }
            | Error::Unsupported { .. }
    )
}

#[cfg(feature = "gpu")]
mod opening {
    use super::{Gpu, Renderer};
    use crate::device::{devices, there_are};
    use pullfocus_core::{Camera, Cancel, Error, Report, Result, Scene, Settings, Storage};
    use pullfocus_gpu::{Choice, Host};

    impl Gpu for Host {
        fn set_storage(&mut self, storage: Storage) {
            Host::set_storage(self, storage);
        }

        fn render(
            &mut self,
            scene: &mut Scene,
            camera: Option<&Camera>,
            settings: &Settings,
            cancel: &Cancel,
        ) -> Result<Report> {
            Host::render(self, scene, camera, settings, cancel)
        }
    }

    fn on_gpu(host: Host, may_fall_back: bool) -> Renderer {
        let info = host.info();
        let (name, backend) = (info.name.clone(), info.backend.clone());
        Renderer { name, detail: Some(backend), gpu: Some(Box::new(host)), may_fall_back, ..Renderer::new() }
    }

    /// The best real GPU, or why there is none.
    pub(super) fn open_best() -> std::result::Result<Renderer, String> {
        match Host::open(&Choice::Best) {
            Ok(host) => Ok(on_gpu(host, true)),
            Err(Error::NoDevice { wanted, .. }) => Err(wanted),
            Err(error) => Err(error.to_string()),
        }
    }

    /// A GPU, or an error with what there is.
    pub(super) fn open_gpu(name: Option<&str>) -> Result<Renderer> {
        let choice = name.map_or(Choice::Best, |name| Choice::Named(name.to_owned()));
        let wanted = match Host::open(&choice) {
            Ok(host) => return Ok(on_gpu(host, false)),
            Err(Error::NoDevice { wanted, .. }) => wanted,
            Err(error) => return Err(error),
        };
        let devices = devices();
        let wanted = match name {
            Some(name) if !devices[1..].iter().any(|device| contains(&device.name, name)) => {
                format!("there is no GPU whose name contains '{}'", name.escape_debug())
            }
            _ => wanted,
        };
        Err(Error::NoDevice { wanted, found: there_are(&devices) })
    }

    fn contains(name: &str, part: &str) -> bool {
        name.to_lowercase().contains(&part.to_lowercase())
    }
}

#[cfg(not(feature = "gpu"))]
mod opening {
    use super::Renderer;
    use pullfocus_core::{Error, Result};

    const WITHOUT: &str = "built without GPUs";

    pub(super) fn open_best() -> std::result::Result<Renderer, String> {
        Err(WITHOUT.into())
    }

    pub(super) fn open_gpu(_: Option<&str>) -> Result<Renderer> {
        Err(Error::NoDevice {
            wanted: format!("a GPU was asked for, but this program was {WITHOUT}"),
            found: "use the device cpu, or build with the feature gpu".into(),
        })
    }
}

use opening::{open_best, open_gpu};

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_core::{Element, Picture, Size};

    const SIZE: Size = Size { width: 24, height: 16 };

    /// Fails as it is told to, and else paints everything in one colour.
    #[derive(Debug)]
    struct Fake(Option<Error>);

    impl Gpu for Fake {
        fn set_storage(&mut self, _: Storage) {}

        fn render(
            &mut self,
            scene: &mut Scene,
            _: Option<&Camera>,
            _: &Settings,
            _: &Cancel,
        ) -> Result<Report> {
            match self.0.take() {
                Some(error) => Err(error),
                None => {
                    scene.base.picture = painted();
                    Ok(Report::default())
                }
            }
        }
    }

    fn painted() -> Picture {
        Picture::opaque(vec![Plane::filled(SIZE, 7.0).unwrap()])
    }

    fn on_fake(error: Option<Error>, may_fall_back: bool) -> Renderer {
        let name = "Fake 1".into();
        Renderer { gpu: Some(Box::new(Fake(error))), name, may_fall_back, ..Renderer::new() }
    }

    fn scene() -> Scene {
        let picture = Picture::opaque(vec![Plane::from_fn(SIZE, |x, y| ((x / 3 + y) % 2) as f32).unwrap()]);
        let distance = Distance::Coc(Plane::filled(SIZE, 5.0).unwrap());
        Scene::new(Frame::full(SIZE), Element { picture, distance })
    }

    fn rendered(renderer: &mut Renderer) -> Result<Picture> {
        let mut scene = scene();
        renderer.render(&mut scene, None, &Settings::default(), &Cancel::new())?;
        Ok(scene.base.picture)
    }

    fn no_room() -> Error {
        let what = "bytes in one binding";
        Error::DeviceLimit { device: "Fake 1".into(), what, needed: 9, allowed: 8, instead: "use the CPU" }
    }

    fn no_memory() -> Error {
        Error::OutOfMemory { what: "a plane", size: SIZE, bytes: 9 }
    }

    fn no_method() -> Error {
        pullfocus_core::Method::Naive.expect_on_gpu().unwrap_err()
    }

    fn lost() -> Error {
        Error::DeviceLost { device: "Fake 1".into(), reason: "unplugged".into() }
    }

    #[test]
    fn what_the_gpu_cannot_do_is_rendered_on_the_cpu() {
        let by_cpu = rendered(&mut Renderer::new()).unwrap();
        assert_ne!(by_cpu, painted());
        for (error, word) in
            [(no_room(), "allows 8"), (no_memory(), "memory"), (no_method(), "aperture only")]
        {
            let mut renderer = on_fake(Some(error), true);
            assert_eq!(rendered(&mut renderer).unwrap(), by_cpu);
            let told = renderer.fell_back().unwrap();
            assert!(told.contains("CPU") && told.contains("Fake 1") && told.contains(word), "{told}");
            assert_eq!(renderer.rendered_on(), "cpu");
            // The next frame may fit.
            assert!(renderer.is_gpu() && renderer.device_name() == "Fake 1");
            assert_eq!(rendered(&mut renderer).unwrap(), painted());
            assert_eq!((renderer.fell_back(), renderer.rendered_on()), (None, "Fake 1"));
        }
    }

    #[test]
    fn a_lost_gpu_is_not_asked_again() {
        let mut renderer = on_fake(Some(lost()), true);
        for _ in 0..2 {
            assert_ne!(rendered(&mut renderer).unwrap(), painted());
            assert!(renderer.fell_back().unwrap().contains("unplugged"));
            assert!(!renderer.is_gpu() && renderer.device_name() == "cpu");
        }
        assert_eq!(renderer.device_text(), "cpu (Fake 1 was lost)");
    }

    #[test]
    fn a_gpu_that_was_asked_for_does_not_fall_back() {
        for error in [no_room(), no_memory(), no_method(), lost()] {
            let mut renderer = on_fake(Some(error.clone()), false);
            assert_eq!(rendered(&mut renderer), Err(error));
            assert!(renderer.is_gpu() && renderer.fell_back().is_none());
        }
    }

    #[test]
    fn other_errors_are_nobodys_fallback() {
        for error in [Error::Cancelled, Error::NoCamera] {
            let mut renderer = on_fake(Some(error.clone()), true);
            assert_eq!(rendered(&mut renderer), Err(error));
            assert_eq!(renderer.fell_back(), None);
        }
    }

    #[test]
    fn the_cpu_always_opens_and_says_so() {
        let mut renderer = Renderer::open(&Device::Cpu).unwrap();
        assert!(!renderer.is_gpu());
        assert_eq!((renderer.device_name(), renderer.device_text().as_str()), ("cpu", "cpu"));
        assert_eq!(rendered(&mut renderer).unwrap(), rendered(&mut Renderer::new()).unwrap());
        let auto = Renderer::open(&Device::Auto).unwrap();
        // The reason stands behind the name, or the GPU's interface does.
        assert!(auto.device_text().starts_with(&format!("{} (", auto.device_name())));
    }

    #[test]
    fn a_gpu_that_is_not_there_is_an_error_that_says_what_is() {
        let error = Renderer::open(&Device::Gpu(Some("no-such-thing".into()))).unwrap_err();
        let said = error.to_string();
        assert!(matches!(error, Error::NoDevice { .. }) && said.contains("cpu"), "{said}");
        if cfg!(feature = "gpu") {
            assert!(said.contains("no-such-thing") && said.contains("the devices are: cpu"), "{said}");
        } else {
            assert!(said.contains("feature gpu"), "{said}");
        }
    }
}
