//! Peak memory: each case in a process of its own, which tells its high-water mark.

use super::cases;
use crate::table::Table;
use anyhow::{Context, Result, bail, ensure};
use pullfocus::{Cancel, Distance, Plane, Renderer, Scene, Settings, Size};
use pullfocus_testkit::scenes;
use std::process::Command;

/// Width, height and settings, as one argument.
fn name(size: Size, settings: &str) -> String {
    format!("{}x{}:{settings}", size.width, size.height)
}

fn parse(case: &str) -> Option<(Size, &str)> {
    let (size, settings) = case.split_once(':')?;
    let (width, height) = size.split_once('x')?;
    Some((Size::new(width.parse().ok()?, height.parse().ok()?), settings))
}

fn settings(name: &str) -> Result<Settings> {
    match name {
        "preview" => Ok(cases::preview()),
        "final" => Ok(cases::last()),
        "single" => Ok(cases::named().swap_remove(0).1),
        other => bail!("no settings are called {other}; there are preview, final and single"),
    }
}

/// Renders RGBA with depth once and prints the input's bytes and the peak.
pub fn measure(case: &str) -> Result<()> {
    let (size, settings_name) =
        parse(case).with_context(|| format!("{case} is no case; write 1920x1080:preview"))?;
    let settings = settings(settings_name)?;
    let mut scene = picture(size)?;
    let camera = cases::lens(size, 50.0)?;
    let start = std::time::Instant::now();
    Renderer::new().render(&mut scene, Some(&camera), &settings, &Cancel::new())?;
    let seconds = start.elapsed().as_secs_f64();
    println!("{} {} {seconds}", 5 * 4 * size.area(), high_water().context("the kernel tells no VmHWM")?);
    Ok(())
}

/// Four planes and depth, made without a second copy of anything.
fn picture(size: Size) -> Result<Scene> {
    let plane = |seed: usize| Plane::from_fn(size, |x, y| ((x * 31 + y * 17 + seed * 7) % 97) as f32 / 97.0);
    let depth = Plane::from_fn(size, |x, y| if x / 64 % 5 == 0 { 2.0 } else { 2.0 + y as f32 * 0.01 })?;
    let mut scene = scenes::by_depth(vec![], depth);
    scene.base.picture.colors = vec![plane(0)?, plane(1)?, plane(2)?];
    scene.base.picture.alpha = Some(Plane::filled(size, 1.0)?);
    debug_assert!(matches!(scene.base.distance, Distance::Depth { .. }));
    Ok(scene)
}

/// Bytes of this process's largest resident set.
fn high_water() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

/// Runs the cases and writes the table.
pub fn table(quick: bool, with_16k: bool) -> Result<String> {
    let mut all: Vec<(Size, &str)> = if quick {
        vec![(Size::new(64, 64), "preview")]
    } else {
        [(1920, 1080), (3840, 2160)]
            .into_iter()
            .flat_map(|(w, h)| ["single", "preview", "final"].map(|s| (Size::new(w, h), s)))
            .collect()
    };
    if with_16k {
        all.push((Size::new(16384, 16384), "preview"));
    }
    let mut table =
        Table::new(["picture", "settings", "planes given, MiB", "peak, MiB", "peak over planes", "seconds"]);
    for (size, settings) in all {
        let Some([input, peak, seconds]) = in_a_process(&name(size, settings))? else { continue };
        table.row([
            size.to_string(),
            settings.to_owned(),
            format!("{:.0}", input / 1048576.0),
            format!("{:.0}", peak / 1048576.0),
            format!("{:.2}", peak / input),
            format!("{seconds:.2}"),
        ]);
    }
    Ok(format!(
        "## Peak memory\n\nRGBA and depth in memory (five planes of f32), one frame with a cold renderer, each in a process of its own: the\n\
         largest resident set (VmHWM), the program and the picture included.\n\n{}\n",
        table.to_markdown()
    ))
}

/// Runs this program on one case; `None` within its own tests, where it is another program.
fn in_a_process(case: &str) -> Result<Option<[f64; 3]>> {
    if cfg!(test) {
        return Ok(None);
    }
    let program = std::env::current_exe()?;
    let output = Command::new(program).args(["speed", "--memory-of", case]).output()?;
    ensure!(output.status.success(), "{case} failed: {}", String::from_utf8_lossy(&output.stderr).trim());
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let numbers: Vec<f64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let [input, peak, seconds] = numbers[..] else { bail!("{case} printed {text:?}") };
    Ok(Some([input, peak, seconds]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cases_have_names() {
        let size = Size::new(1920, 1080);
        assert_eq!(parse(&name(size, "final")), Some((size, "final")));
        assert!(parse("1920:final").is_none() && measure("1920x2:what").is_err());
    }

    #[test]
    fn the_high_water_mark_rises_with_memory() {
        let before = high_water();
        let block = vec![1u8; 64 << 20];
        let after = high_water();
        assert!(block.iter().step_by(4096).map(|b| u64::from(*b)).sum::<u64>() > 0);
        // Elsewhere than on Linux there is none.
        assert_eq!(before.is_some(), cfg!(target_os = "linux"));
        if let (Some(before), Some(after)) = (before, after) {
            assert!(after >= before);
        }
    }
}
