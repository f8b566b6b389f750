//! Outputs are whole or absent, and nobody's file is lost.

use pullfocus_io::FileError;
use pullfocus_io::output::{Existing, Need, PendingFile, check_target, clean_leftovers};
use std::fs;
use std::io::{BufRead, BufReader, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

const NO_INPUTS: [&Path; 0] = [];

fn write(target: &Path, existing: Existing, content: &[u8]) -> Result<bool, FileError> {
    let mut file = PendingFile::create(target, existing)?;
    file.write_all(content).unwrap();
    file.commit()
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_file_appears_when_it_is_complete() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("out.exr");
    let mut file = PendingFile::create(&target, Existing::Refuse).unwrap();
    file.write_all(b"0123456789").unwrap();
    file.seek(SeekFrom::Start(2)).unwrap();
    file.write_all(b"xy").unwrap();
    assert!(!target.exists());
    assert_eq!(file.temporary().parent(), Some(folder.path()));
    assert!(file.commit().unwrap());
    assert_eq!(fs::read(&target).unwrap(), b"01xy456789");
    assert_eq!(names(folder.path()), ["out.exr"]);
}

#[test]
fn a_dropped_file_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = PendingFile::create(&folder.path().join("out.exr"), Existing::Refuse).unwrap();
    file.write_all(b"half").unwrap();
    drop(file);
    assert!(names(folder.path()).is_empty());
}

#[test]
fn an_existing_file_is_refused_replaced_or_kept() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("out.exr");
    fs::write(&target, "theirs").unwrap();
    assert!(matches!(write(&target, Existing::Refuse, b"ours"), Err(FileError::Exists { .. })));
    assert!(matches!(check_target(&target, NO_INPUTS, Existing::Refuse), Err(FileError::Exists { .. })));
    assert_eq!(check_target(&target, NO_INPUTS, Existing::Keep).unwrap(), Need::Finished);
    assert!(!write(&target, Existing::Keep, b"ours").unwrap());
    assert_eq!(fs::read(&target).unwrap(), b"theirs");
    assert_eq!(check_target(&target, NO_INPUTS, Existing::Replace).unwrap(), Need::Make);
    assert!(write(&target, Existing::Replace, b"ours").unwrap());
    assert_eq!(fs::read(&target).unwrap(), b"ours");
    assert_eq!(names(folder.path()), ["out.exr"]);
}

#[test]
fn a_file_that_appears_during_the_work_is_not_lost() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("out.exr");
    for (existing, expected) in [(Existing::Refuse, false), (Existing::Keep, true)] {
        let _ = fs::remove_file(&target);
        let mut ours = PendingFile::create(&target, existing).unwrap();
        ours.write_all(b"ours").unwrap();
        fs::write(&target, "theirs").unwrap();
        let result = ours.commit();
        assert_eq!(matches!(result, Ok(false)), expected, "{result:?}");
        assert_eq!(matches!(result, Err(FileError::Exists { .. })), !expected);
        assert_eq!(fs::read(&target).unwrap(), b"theirs");
        assert_eq!(names(folder.path()), ["out.exr"]);
    }
}

#[test]
fn of_many_writers_without_overwrite_exactly_one_wins() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("out.exr");
    let pending: Vec<_> = (0..8u8)
        .map(|i| {
            let mut file = PendingFile::create(&target, Existing::Refuse).unwrap();
            file.write_all(&[i; 100]).unwrap();
            file
        })
        .collect();
    let won: Vec<bool> = std::thread::scope(|scope| {
        let all: Vec<_> = pending.into_iter().map(|file| scope.spawn(|| file.commit().is_ok())).collect();
        all.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert_eq!(won.iter().filter(|&&won| won).count(), 1);
    let winner = won.iter().position(|&won| won).unwrap() as u8;
    assert_eq!(fs::read(&target).unwrap(), [winner; 100]);
    assert_eq!(names(folder.path()), ["out.exr"]);
}

#[test]
fn an_empty_file_is_no_finished_result() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("out.exr");
    fs::write(&target, "").unwrap();
    let said = check_target(&target, NO_INPUTS, Existing::Keep).unwrap_err().to_string();
    assert!(said.contains("empty"), "{said}");
}

#[test]
fn places_where_no_file_can_be_written_are_refused_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    for (target, word) in [
        (folder.path().to_owned(), "folder"),
        (folder.path().join("missing/out.exr"), "does not exist"),
        (folder.path().join("file/out.exr"), "is a file"),
        (PathBuf::from("/"), "not the name"),
        (folder.path().join(".."), "not the name"),
    ] {
        for existing in [Existing::Refuse, Existing::Replace, Existing::Keep] {
            let said = check_target(&target, NO_INPUTS, existing).unwrap_err().to_string();
            assert!(said.contains(word), "{said}");
            assert!(PendingFile::create(&target, existing).is_err());
        }
    }
}

#[test]
fn an_input_is_never_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("in.exr");
    fs::write(&input, "pixels").unwrap();
    fs::create_dir(folder.path().join("sub")).unwrap();
    let mut disguises = vec![input.clone(), folder.path().join("sub/../in.exr")];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&input, folder.path().join("link.exr")).unwrap();
        fs::hard_link(&input, folder.path().join("hard.exr")).unwrap();
        disguises.extend([folder.path().join("link.exr"), folder.path().join("hard.exr")]);
    }
    for target in disguises {
        for existing in [Existing::Refuse, Existing::Replace, Existing::Keep] {
            let said = check_target(&target, [&input], existing).unwrap_err().to_string();
            assert!(said.contains("input"), "{said}");
        }
    }
    assert_eq!(check_target(&folder.path().join("o.exr"), [&input], Existing::Refuse).unwrap(), Need::Make);
}

#[cfg(unix)]
#[test]
fn permissions_are_those_of_an_ordinary_file() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    let ordinary = folder.path().join("ordinary");
    fs::write(&ordinary, "").unwrap();
    let target = folder.path().join("out.exr");
    write(&target, Existing::Refuse, b"x").unwrap();
    assert_eq!(mode(&target), mode(&ordinary));
    fs::set_permissions(&target, fs::Permissions::from_mode(0o640)).unwrap();
    write(&target, Existing::Replace, b"y").unwrap();
    assert_eq!(mode(&target), 0o640, "a replaced file keeps its permissions");
}

#[cfg(unix)]
#[test]
fn a_link_stays_a_link_and_its_file_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let (real, link) = (folder.path().join("real.exr"), folder.path().join("link.exr"));
    fs::write(&real, "old").unwrap();
    std::os::unix::fs::symlink(&real, &link).unwrap();
    write(&link, Existing::Replace, b"new").unwrap();
    assert_eq!(fs::read(&real).unwrap(), b"new");
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    let nowhere = folder.path().join("nowhere.exr");
    std::os::unix::fs::symlink("missing", &nowhere).unwrap();
    assert!(write(&nowhere, Existing::Replace, b"new").unwrap_err().to_string().contains("nowhere"));
}

#[test]
fn only_our_own_leftovers_that_nobody_writes_are_removed() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| {
        fs::write(folder.path().join(name), "x").unwrap();
        folder.path().join(name)
    };
    let ours = file(".pullfocus-AbCdEf012345.part");
    for other in
        ["out.exr", ".pullfocus-short.part", ".pullfocus-AbCdEf01234-.part", "pullfocus-AbCdEf012345.part"]
    {
        file(other);
    }
    let busy = PendingFile::create(&folder.path().join("busy.exr"), Existing::Refuse).unwrap();
    assert!(clean_leftovers(folder.path(), Duration::from_secs(3600)).unwrap().is_empty(), "too young");
    assert_eq!(clean_leftovers(folder.path(), Duration::ZERO).unwrap(), [ours]);
    assert!(busy.temporary().exists(), "a file that is being written has a lock");
    assert_eq!(names(folder.path()).len(), 5);
    assert!(busy.commit().unwrap());
}

/// Not a test of its own: what the killed process of the next test does.
#[test]
fn the_process_to_be_killed() {
    let Some(target) = std::env::var_os("PULLFOCUS_TEST_TARGET") else { return };
    let mut file = PendingFile::create(Path::new(&target), Existing::Replace).unwrap();
    file.write_all(&[7; 1 << 20]).unwrap();
    file.flush().unwrap();
    println!("\nhalf way");
    std::thread::sleep(Duration::from_secs(60));
    panic!("nobody came to kill this process");
}

#[test]
fn a_killed_run_leaves_no_broken_file_under_a_final_name() {
    let folder = tempfile::tempdir().unwrap();
    for before in [None, Some("finished before")] {
        let target = folder.path().join("out.exr");
        if let Some(content) = before {
            fs::write(&target, content).unwrap();
        }
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "the_process_to_be_killed", "--nocapture"])
            .env("PULLFOCUS_TEST_TARGET", &target)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        assert!(lines.map_while(Result::ok).any(|line| line == "half way"));
        assert!(clean_leftovers(folder.path(), Duration::ZERO).unwrap().is_empty(), "still being written");
        child.kill().unwrap();
        child.wait().unwrap();
        assert_eq!(fs::read_to_string(&target).ok().as_deref(), before);
        assert_eq!(names(folder.path()).len(), 1 + usize::from(before.is_some()), "one leftover");
        assert_eq!(clean_leftovers(folder.path(), Duration::ZERO).unwrap().len(), 1);
        assert_eq!(names(folder.path()).len(), usize::from(before.is_some()));
    }
}
