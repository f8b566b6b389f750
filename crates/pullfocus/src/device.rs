//! Which device renders, as people write it, and which ones there are.

use std::fmt;
use std::str::FromStr;

/// Which device renders. Written `auto`, `cpu`, `gpu` or `gpu:NAME`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Device {
    /// The best real GPU if there is one, else the CPU. A software driver is no real GPU. A picture that the GPU
    /// cannot hold is rendered on the CPU.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// A GPU and nothing else: the best real one, or the first whose name contains this text, without regard to
    /// case. A software driver is taken only by its name.
    Gpu(Option<String>),
}

impl fmt::Display for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Cpu => f.write_str("cpu"),
            Self::Gpu(None) => f.write_str("gpu"),
            Self::Gpu(Some(name)) => write!(f, "gpu:{name}"),
        }
    }
}

impl FromStr for Device {
    type Err = ParseDeviceError;

    fn from_str(text: &str) -> Result<Self, ParseDeviceError> {
        match text {
            "auto" => Ok(Self::Auto),
            "cpu" => Ok(Self::Cpu),
            "gpu" => Ok(Self::Gpu(None)),
            _ => match text.strip_prefix("gpu:") {
                Some(name) if !name.trim().is_empty() => Ok(Self::Gpu(Some(name.to_owned()))),
                _ => Err(ParseDeviceError { text: text.to_owned() }),
            },
        }
    }
}

/// A text that names no [`Device`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParseDeviceError {
    /// The text.
    pub text: String,
}

impl fmt::Display for ParseDeviceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = self.text.escape_debug();
        write!(f, "'{text}' is no device; write auto, cpu, gpu, or gpu:NAME with a part of the GPU's name")
    }
}

impl std::error::Error for ParseDeviceError {}

/// What kind of device it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DeviceKind {
    /// The CPU.
    Cpu,
    /// A card with memory of its own.
    Discrete,
    /// A GPU that shares the processor's memory.
    Integrated,
    /// A virtual machine's GPU.
    Virtual,
    /// The processor in a GPU's place, by a software driver.
    Software,
    /// A GPU of which the driver does not say more.
    Other,
}

impl fmt::Display for DeviceKind {
    /// One word: "cpu", "discrete", "integrated", "virtual", "software", "other".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Cpu => "cpu",
            Self::Discrete => "discrete",
            Self::Integrated => "integrated",
            Self::Virtual => "virtual",
            Self::Software => "software",
            Self::Other => "other",
        })
    }
}

/// A device of this machine.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceInfo {
    /// "cpu", or the name that the driver gives it.
    pub name: String,
    /// What kind of device it is.
    pub kind: DeviceKind,
    /// The CPU: how many threads it runs at a time.
    pub threads: Option<usize>,
    /// The CPU: the instructions that the solvers use: "AVX-512", "AVX2", "portable".
    pub instructions: Option<&'static str>,
    /// A GPU: the programming interface: "Vulkan", "Metal", "Dx12".
    pub backend: Option<String>,
    /// A GPU: its driver and the driver's version, as far as it says.
    pub driver: Option<String>,
    /// A GPU: the most bytes in one binding, which must hold up to four planes of a picture.
    pub largest_binding: Option<u64>,
    /// Why it cannot be used, if it cannot.
    pub unusable: Option<String>,
    /// Whether [`Device::Auto`] takes it.
    pub auto: bool,
}

/// The devices of this machine: the CPU, then every adapter, best first.
pub fn devices() -> Vec<DeviceInfo> {
    let mut devices = vec![cpu()];
    devices.extend(adapters());
    let real = |device: &DeviceInfo| !matches!(device.kind, DeviceKind::Cpu | DeviceKind::Software);
    let auto = devices.iter().position(|device| real(device) && device.unusable.is_none()).unwrap_or(0);
    devices[auto].auto = true;
    devices
}

fn cpu() -> DeviceInfo {
    use pullfocus_cpu::diffusion::Instructions;
    DeviceInfo {
        name: "cpu".into(),
        kind: DeviceKind::Cpu,
        threads: Some(std::thread::available_parallelism().map_or(1, usize::from)),
        instructions: Some(match Instructions::best() {
            Instructions::Portable => "portable",
            Instructions::Avx2 => "AVX2",
            Instructions::Avx512 => "AVX-512",
        }),
        backend: None,
        driver: None,
        largest_binding: None,
        unusable: None,
        auto: false,
    }
}

#[cfg(not(feature = "gpu"))]
fn adapters() -> Vec<DeviceInfo> {
    Vec::new()
}

#[cfg(feature = "gpu")]
fn adapters() -> Vec<DeviceInfo> {
    use pullfocus_gpu::AdapterKind;
    let kind = |kind| match kind {
        AdapterKind::Discrete => DeviceKind::Discrete,
        AdapterKind::Integrated => DeviceKind::Integrated,
        AdapterKind::Virtual => DeviceKind::Virtual,
        AdapterKind::Processor => DeviceKind::Software,
        AdapterKind::Other => DeviceKind::Other,
    };
    let info = |adapter: pullfocus_gpu::AdapterInfo| DeviceInfo {
        name: adapter.name,
        kind: kind(adapter.kind),
        threads: None,
        instructions: None,
        backend: Some(adapter.backend),
        driver: Some(adapter.driver),
        largest_binding: Some(adapter.largest_binding),
        unusable: adapter.unusable,
        auto: false,
    };
    pullfocus_gpu::adapters().into_iter().map(info).collect()
}

/// "the devices are: cpu, NVIDIA H100 (Vulkan)".
#[cfg(feature = "gpu")]
pub(crate) fn there_are(devices: &[DeviceInfo]) -> String {
    let text = |device: &DeviceInfo| match &device.backend {
        Some(backend) => format!("{} ({backend})", device.name),
        None => device.name.clone(),
    };
    let names: Vec<String> = devices.iter().map(text).collect();
    format!("the devices are: {}", names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_are_read_as_they_are_shown() {
        for (text, device) in [
            ("auto", Device::Auto),
            ("cpu", Device::Cpu),
            ("gpu", Device::Gpu(None)),
            ("gpu:nvidia", Device::Gpu(Some("nvidia".into()))),
            ("gpu:Radeon RX: 7900", Device::Gpu(Some("Radeon RX: 7900".into()))),
        ] {
            assert_eq!(text.parse(), Ok(device.clone()));
            assert_eq!(device.to_string(), text);
        }
        assert_eq!(Device::default(), Device::Auto);
    }

    #[test]
    fn what_is_no_device_is_refused_with_what_is() {
        for text in ["", "GPU0", "gpu:", "gpu: ", "cuda", "cpu:1", "a\nb"] {
            let said = text.parse::<Device>().unwrap_err().to_string();
            assert!(said.contains("gpu:NAME") && !said.contains('\n'), "{said}");
        }
    }

    #[test]
    fn the_cpu_comes_first_and_auto_takes_one() {
        let devices = devices();
        assert_eq!((devices[0].name.as_str(), devices[0].kind), ("cpu", DeviceKind::Cpu));
        assert!(devices[0].threads >= Some(1) && devices[0].instructions.is_some());
        let taken: Vec<_> = devices.iter().filter(|device| device.auto).collect();
        assert_eq!(taken.len(), 1);
        assert!(taken[0].unusable.is_none() && taken[0].kind != DeviceKind::Software);
    }
}
