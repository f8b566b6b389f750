//! Which adapter is measured, and what it is.

use anyhow::{Result, ensure};
use clap::Args;
use pullfocus_gpu::{AdapterInfo, AdapterKind, Choice, Host, adapters};

/// Options of the commands that need a GPU.
#[derive(Args, Clone, Debug, Default)]
pub struct AdapterOption {
    /// The first adapter whose name contains this text; the best one where none is given, a software one if there is no
    /// other.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
}

impl AdapterOption {
    /// Opens the adapter.
    pub fn open(&self) -> Result<Host> {
        Ok(Host::open(&choice(self.adapter.as_deref(), &adapters())?)?)
    }
}

/// What to open of `there`, which come best first.
fn choice(name: Option<&str>, there: &[AdapterInfo]) -> Result<Choice> {
    if let Some(name) = name {
        return Ok(Choice::Named(name.to_owned()));
    }
    let usable: Vec<&AdapterInfo> = there.iter().filter(|info| info.unusable.is_none()).collect();
    ensure!(!usable.is_empty(), "there is no adapter here; a software one (Mesa's llvmpipe) is enough");
    let real = usable.iter().any(|info| info.kind != AdapterKind::Processor);
    Ok(if real { Choice::Best } else { Choice::Named(usable[0].name.clone()) })
}

/// Whether it is the processor by a software driver.
pub fn is_software(info: &AdapterInfo) -> bool {
    info.kind == AdapterKind::Processor
}

/// The line that says on what something ran.
pub fn describe(info: &AdapterInfo) -> String {
    let kind = match info.kind {
        AdapterKind::Discrete => "discrete",
        AdapterKind::Integrated => "integrated",
        AdapterKind::Virtual => "virtual",
        AdapterKind::Processor => "software",
        AdapterKind::Other => "of unknown kind",
    };
    let mebibytes = info.largest_binding >> 20;
    format!(
        "Adapter: {} ({kind}), {}, driver {}, at most {mebibytes} MiB in one binding.",
        info.name, info.backend, info.driver
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info(name: &str, kind: AdapterKind) -> AdapterInfo {
        AdapterInfo {
            name: name.into(),
            kind,
            backend: "Vulkan".into(),
            driver: "a driver 1.0".into(),
            largest_binding: 128 << 20,
            unusable: None,
        }
    }

    #[test]
    fn a_software_adapter_is_taken_if_there_is_no_other() {
        let software = info("llvmpipe", AdapterKind::Processor);
        let real = info("A card", AdapterKind::Discrete);
        let broken = AdapterInfo { unusable: Some("old".into()), ..real.clone() };
        assert_eq!(choice(None, &[real, software.clone()]).unwrap(), Choice::Best);
        assert_eq!(choice(None, &[software, broken.clone()]).unwrap(), Choice::Named("llvmpipe".into()));
        assert!(choice(None, &[broken]).unwrap_err().to_string().contains("no adapter"));
        assert_eq!(choice(Some("x"), &[]).unwrap(), Choice::Named("x".into()));
    }

    #[test]
    fn the_line_says_what_it_is() {
        let line = describe(&info("A card", AdapterKind::Integrated));
        assert!(line.contains("A card (integrated), Vulkan, driver a driver 1.0, at most 128 MiB"), "{line}");
    }
}
