//! `pullfocus devices`: what can render on this machine.

use crate::args::DevicesArgs;
use crate::console::print_line;
use crate::report;
use pullfocus::{DeviceInfo, DeviceKind, devices};
use pullfocus_job::failure::Result;
use serde::Serialize;

#[derive(Debug, Serialize)]
struct Document {
    pullfocus: &'static str,
    command: &'static str,
    devices: Vec<DeviceReport>,
}

#[derive(Debug, Serialize)]
struct DeviceReport {
    name: String,
    /// "cpu", "discrete", "integrated", "virtual", "software" or "other".
    kind: String,
    threads: Option<usize>,
    instructions: Option<&'static str>,
    backend: Option<String>,
    driver: Option<String>,
    /// Bytes.
    largest_binding: Option<u64>,
    usable: bool,
    /// Why it cannot be used.
    unusable: Option<String>,
    /// Whether `--device auto` takes it.
    auto: bool,
}

/// Lists the devices; a machine without a GPU has its CPU.
///
/// # Errors
/// None that a machine could cause.
pub fn run(args: &DevicesArgs) -> Result<()> {
    let devices = devices();
    if args.json {
        let devices = devices.into_iter().map(report_of).collect();
        return report::print(&Document {
            pullfocus: env!("CARGO_PKG_VERSION"),
            command: "devices",
            devices,
        });
    }
    table(&devices).iter().for_each(|line| print_line(line));
    print_line("Choose one with --device cpu, gpu, or gpu:NAME with a part of its name.");
    Ok(())
}

fn report_of(device: DeviceInfo) -> DeviceReport {
    DeviceReport {
        kind: device.kind.to_string(),
        name: device.name,
        threads: device.threads,
        instructions: device.instructions,
        backend: device.backend,
        driver: device.driver,
        largest_binding: device.largest_binding,
        usable: device.unusable.is_none(),
        unusable: device.unusable,
        auto: device.auto,
    }
}

/// One line for each device below a line of headings, in columns as wide as what is in them.
fn table(devices: &[DeviceInfo]) -> Vec<String> {
    let headings = ["device", "kind", "backend", "driver", "largest binding", "use"].map(str::to_owned);
    let rows: Vec<[String; 6]> = std::iter::once(headings).chain(devices.iter().map(row)).collect();
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..6).map(width).collect();
    let line = |row: &[String; 6]| {
        let cells: Vec<String> =
            row.iter().zip(&widths).map(|(cell, &width)| format!("{cell:<width$}")).collect();
        cells.join("  ").trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}

fn row(device: &DeviceInfo) -> [String; 6] {
    let cpu = device.threads.map(|threads| {
        let threads = if threads == 1 { "1 thread".into() } else { format!("{threads} threads") };
        format!("{threads}, {}", device.instructions.unwrap_or("portable"))
    });
    let usage = match (&device.unusable, device.auto, device.kind) {
        (Some(why), ..) => format!("cannot be used: {why}"),
        (None, true, _) => "auto takes it".into(),
        (None, false, DeviceKind::Software) => "only by its name".into(),
        (None, false, _) => "if asked for".into(),
    };
    let dash = || "-".to_owned();
    [
        device.name.clone(),
        device.kind.to_string(),
        device.backend.clone().unwrap_or_else(dash),
        device.driver.clone().or(cpu).unwrap_or_else(dash),
        device.largest_binding.map_or_else(dash, bytes),
        usage,
    ]
}

/// "128 MiB", "2.0 GiB".
fn bytes(bytes: u64) -> String {
    let mib = bytes as f64 / f64::from(1 << 20);
    if mib < 1024.0 { format!("{mib:.0} MiB") } else { format!("{:.1} GiB", mib / 1024.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_says_what_auto_takes_and_what_cannot_be_used() {
        let cpu = DeviceInfo {
            name: "cpu".into(),
            kind: DeviceKind::Cpu,
            threads: Some(8),
            instructions: Some("AVX2"),
            backend: None,
            driver: None,
            largest_binding: None,
            unusable: None,
            auto: false,
        };
        let gpu = DeviceInfo {
            name: "Radeon 7900".into(),
            kind: DeviceKind::Discrete,
            threads: None,
            instructions: None,
            backend: Some("Vulkan".into()),
            driver: Some("radv 25.1".into()),
            largest_binding: Some((1 << 31) - 4),
            auto: true,
            ..cpu.clone()
        };
        let software = DeviceInfo {
            name: "llvmpipe".into(),
            kind: DeviceKind::Software,
            largest_binding: Some(128 << 20),
            auto: false,
            ..gpu.clone()
        };
        let old = DeviceInfo {
            name: "Old".into(),
            unusable: Some("no storage buffers".into()),
            auto: false,
            ..gpu.clone()
        };
        let lines = table(&[cpu, gpu, software, old]);
        assert_eq!(
            lines,
            [
                "device       kind      backend  driver           largest binding  use",
                "cpu          cpu       -        8 threads, AVX2  -                if asked for",
                "Radeon 7900  discrete  Vulkan   radv 25.1        2.0 GiB          auto takes it",
                "llvmpipe     software  Vulkan   radv 25.1        128 MiB          only by its name",
                "Old          discrete  Vulkan   radv 25.1        2.0 GiB          cannot be used: no storage buffers",
            ]
        );
    }
}
