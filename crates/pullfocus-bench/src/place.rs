//! Where results go, and what they were made on.

use anyhow::{Context, Result};
use clap::Args;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Options of every command.
#[derive(Args, Clone, Debug)]
pub struct Output {
    /// Folder that gets `results/` and `pictures/`; the project's `docs` where none is given.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// A short run that shows that everything works; its figures mean nothing. Writes only where `--out` says.
    #[arg(long)]
    pub quick: bool,
}

impl Output {
    /// The folder for results, `None` in a quick run without one.
    pub fn docs(&self) -> Option<PathBuf> {
        match (&self.out, self.quick) {
            (Some(out), _) => Some(out.clone()),
            (None, true) => None,
            (None, false) => Some(workspace().join("docs")),
        }
    }

    /// Writes a text below the folder for results, or prints it in a quick run without one.
    pub fn write(&self, name: &str, text: &str) -> Result<()> {
        match self.docs() {
            Some(docs) => {
                write_whole(&docs.join(name), text.as_bytes())?;
                println!("wrote {name}");
            }
            None => println!("--- {name}\n{text}"),
        }
        Ok(())
    }

    /// Writes bytes below the folder for results; nothing in a quick run without one.
    pub fn write_bytes(&self, name: &str, bytes: &[u8]) -> Result<()> {
        self.docs().map_or(Ok(()), |docs| write_whole(&docs.join(name), bytes))
    }
}

/// The project's root.
pub fn workspace() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).unwrap_or(here).to_path_buf()
}

/// Writes under a temporary name beside `path`, then renames.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let folder = path.parent().context("a file needs a folder")?;
    fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let mut file = tempfile::NamedTempFile::new_in(folder)
        .with_context(|| format!("cannot write into {}", folder.display()))?;
    std::io::Write::write_all(&mut file, bytes)?;
    // Temporary files are private; results are for everybody.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        file.as_file().set_permissions(fs::Permissions::from_mode(0o644))?;
    }
    file.persist(path).with_context(|| format!("cannot write {}", path.display()))?;
    Ok(())
}

/// The line that says on what, from which commit and with which command something was measured.
pub fn provenance() -> String {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    format!(
        "Machine: {}, {} threads. Commit: {}. Command: `cargo run {}-p pullfocus-bench -- {}`.",
        processor(),
        rayon::current_num_threads(),
        commit(),
        if cfg!(debug_assertions) { "" } else { "--release " },
        arguments.join(" ")
    )
}

fn processor() -> String {
    let info = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = info.lines().find_map(|line| line.strip_prefix("model name"));
    let name = line.and_then(|line| line.split_once(':')).map(|(_, name)| name.trim().to_owned());
    name.unwrap_or_else(|| std::env::consts::ARCH.to_owned())
}

/// The short hash, with a plus where crates or shipped data differ from it.
fn commit() -> String {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").arg("-C").arg(workspace()).args(arguments).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let Some(hash) = git(&["rev-parse", "--short=10", "HEAD"]) else { return "unknown".to_owned() };
    let changed =
        git(&["status", "--porcelain", "--", "crates", "data"]).is_some_and(|list| !list.is_empty());
    if changed { format!("{hash}+") } else { hash }
}

/// Bytes of the largest cache, from the kernel; 32 MiB where it does not say.
pub fn last_level_cache() -> usize {
    let sizes = (0..8).filter_map(|index| {
        let path = format!("/sys/devices/system/cpu/cpu0/cache/index{index}/size");
        let text = fs::read_to_string(path).ok()?;
        let text = text.trim();
        let (digits, unit) = text.split_at(text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len()));
        let unit = match unit {
            "K" => 1 << 10,
            "M" => 1 << 20,
            "G" => 1 << 30,
            _ => 1,
        };
        Some(digits.parse::<usize>().ok()? * unit)
    });
    sizes.max().unwrap_or(32 << 20)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_appear_whole_and_are_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a/b.md");
        write_whole(&path, b"one").unwrap();
        write_whole(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1, "nothing else is left");
    }

    #[test]
    fn the_workspace_holds_this_crate() {
        assert!(workspace().join("crates/pullfocus-bench/Cargo.toml").is_file());
    }

    #[test]
    fn quick_runs_do_not_touch_the_project() {
        let quick = Output { out: None, quick: true };
        assert_eq!(quick.docs(), None);
        assert!(Output { quick: false, ..quick }.docs().unwrap().ends_with("docs"));
    }
}
