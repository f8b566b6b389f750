//! Files that appear under their name whole or not at all.
//!
//! A [`PendingFile`] is written under a temporary name in the folder of its target, brought to the disk, and
//! then renamed. A run that is killed leaves at most a file named `.pullfocus-….part`, which
//! [`clean_leftovers`] removes later. Whether somebody's file may be replaced is asked twice: before the work
//! ([`check_target`]), and by the file system itself at the rename, where nobody can come in between.

use crate::error::{FileError, FileResult};
use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::{NamedTempFile, PersistError};

/// What to do where the output's name is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Existing {
    /// Leave that file alone and stop with [`FileError::Exists`].
    #[default]
    Refuse,
    /// Replace it once the new file is complete.
    Replace,
    /// It is the finished result of an earlier run: keep it and go on with the next.
    Keep,
}

/// Whether an output has to be made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// Yes.
    Make,
    /// No: it is there, and [`Existing::Keep`] was asked for.
    Finished,
}

/// Temporary names begin and end so; what lies between is random.
const PREFIX: &str = ".pullfocus-";
const SUFFIX: &str = ".part";
const RANDOM: usize = 12;

/// To be asked before any work: may `target` be written?
///
/// It may not where it is one of `inputs` (by whatever path, link or spelling), a folder or a device, where
/// its folder is missing, or where it exists and `existing` refuses. An empty file is nobody's finished result:
/// with [`Existing::Keep`] it is refused.
///
/// # Errors
/// [`FileError::Exists`], [`FileError::Argument`], [`FileError::Io`].
pub fn check_target<P: AsRef<Path>>(
    target: &Path,
    inputs: impl IntoIterator<Item = P>,
    existing: Existing,
) -> FileResult<Need> {
    let refuse = |reason: &str| {
        Err(FileError::Argument { what: target.display().to_string(), reason: reason.to_owned() })
    };
    if target.file_name().is_none() {
        return refuse("this is not the name of a file; give one to write to");
    }
    let folder = folder_of(target);
    match fs::metadata(folder) {
        Ok(meta) if meta.is_dir() => {}
        Ok(_) => return refuse("what should be its folder is a file; choose another place"),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return refuse("its folder does not exist; make it first, or choose another place");
        }
        Err(error) => return Err(FileError::io(folder, "look into", error)),
    }
    let Ok(link) = fs::symlink_metadata(target) else { return Ok(Need::Make) };
    let meta = match fs::metadata(target) {
        Ok(meta) => meta,
        Err(_) if link.is_symlink() => return refuse("this is a link to nowhere; remove it first"),
        Err(error) => return Err(FileError::io(target, "look at", error)),
    };
    if meta.is_dir() {
        return refuse("this is a folder; give the name of a file in it");
    }
    if !meta.is_file() {
        return refuse(
            "this is not an ordinary file; results are written under a temporary name and renamed",
        );
    }
    refuse_input(target, inputs)?;
    match existing {
        Existing::Refuse => Err(FileError::Exists { file: target.to_owned() }),
        Existing::Replace => Ok(Need::Make),
        Existing::Keep if meta.len() == 0 => {
            refuse("this file is empty, so it is not a finished result; delete it, or allow overwriting")
        }
        Existing::Keep => Ok(Need::Finished),
    }
}

/// Refuses a `target` that is one of `inputs`, by whatever path, link or spelling.
///
/// # Errors
/// [`FileError::Argument`].
pub fn refuse_input<P: AsRef<Path>>(target: &Path, inputs: impl IntoIterator<Item = P>) -> FileResult<()> {
    // An input that is missing is somebody else's error.
    if inputs.into_iter().any(|input| same_file::is_same_file(target, input).unwrap_or(false)) {
        return Err(FileError::Argument {
            what: target.display().to_string(),
            reason: "this is one of the inputs, and inputs are never overwritten; choose another name".into(),
        });
    }
    Ok(())
}

fn folder_of(target: &Path) -> &Path {
    match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// A file on its way to its name. Dropped without [`Self::commit`], it leaves nothing behind.
#[derive(Debug)]
pub struct PendingFile {
    target: PathBuf,
    existing: Existing,
    file: BufWriter<Temporary>,
}

/// The file itself is written to: `NamedTempFile` would put its temporary name into errors.
#[derive(Debug)]
struct Temporary(NamedTempFile);

impl Write for Temporary {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.as_file_mut().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.as_file_mut().flush()
    }
}

impl Seek for Temporary {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.0.as_file_mut().seek(to)
    }
}

impl PendingFile {
    /// Starts a temporary file beside `target`, with the permissions of any new file (umask), or of the file
    /// that it replaces. Where `target` is a link, the file that it points to is the one replaced.
    ///
    /// # Errors
    /// As [`check_target`] (which is asked again, without inputs), and [`FileError::Io`].
    pub fn create(target: &Path, existing: Existing) -> FileResult<Self> {
        let asked = if existing == Existing::Keep { Existing::Replace } else { existing };
        check_target(target, std::iter::empty::<&Path>(), asked)?;
        let target = match fs::symlink_metadata(target) {
            Ok(meta) if meta.is_symlink() => {
                fs::canonicalize(target).map_err(|error| FileError::io(target, "follow the link", error))?
            }
            _ => target.to_owned(),
        };
        let folder = folder_of(&target);
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX).suffix(SUFFIX).rand_bytes(RANDOM);
        #[cfg(unix)]
        let permissions = {
            use std::os::unix::fs::PermissionsExt;
            fs::Permissions::from_mode(0o666)
        };
        // Not tempfile's own 0600: a result is for everybody that ordinary files are for.
        #[cfg(unix)]
        builder.permissions(permissions);
        let file = builder
            .tempfile_in(folder)
            .map_err(|error| FileError::io(&target, "make a temporary file beside", error))?;
        // Held for as long as the file is being written, so that nobody takes it for a leftover. Some network
        // file systems cannot lock; there the age alone protects it.
        let _ = file.as_file().try_lock();
        if let (Existing::Replace, Ok(meta)) = (existing, fs::metadata(&target)) {
            // Where that is not allowed, the file gets the permissions of a new one.
            let _ = file.as_file().set_permissions(meta.permissions());
        }
        Ok(Self { target, existing, file: BufWriter::with_capacity(1 << 18, Temporary(file)) })
    }

    /// The name that the file will have.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// The name that it has until then.
    pub fn temporary(&self) -> &Path {
        self.file.get_ref().0.path()
    }

    /// Brings the content to the disk and gives the file its name.
    ///
    /// True if it has it; false if, with [`Existing::Keep`], somebody else finished that file meanwhile: theirs
    /// is kept.
    ///
    /// # Errors
    /// [`FileError::Exists`] if the name was taken meanwhile and may not be replaced, [`FileError::Io`]. The
    /// temporary file is gone then, and what had the name before still has it.
    pub fn commit(self) -> FileResult<bool> {
        let Self { target, existing, file } = self;
        let Temporary(file) =
            file.into_inner().map_err(|error| FileError::io(&target, "write", error.into_error()))?;
        file.as_file().sync_all().map_err(|error| FileError::io(&target, "bring to the disk", error))?;
        let renamed = match existing {
            Existing::Replace => file.persist(&target),
            Existing::Refuse | Existing::Keep => {
                persist_new(file, &target, |file, target| file.persist_noclobber(target))
            }
        };
        match renamed {
            Ok(_) => {
                // The name itself, too, should outlive a power cut. Not every system can do that.
                #[cfg(unix)]
                let _ = File::open(folder_of(&target)).and_then(|folder| folder.sync_all());
                Ok(true)
            }
            Err(error) if error.error.kind() == io::ErrorKind::AlreadyExists => match existing {
                Existing::Keep => Ok(false),
                _ => Err(FileError::Exists { file: target }),
            },
            Err(error) => Err(FileError::io(&target, "rename the finished file to", error.error)),
        }
    }
}

/// Gives the file a name that nobody has, by `at_once`; where the file system can do nothing of that kind (neither
/// rename without replacing nor link), by way of an empty file, which takes the name first and is then replaced.
fn persist_new(
    file: NamedTempFile,
    target: &Path,
    at_once: fn(NamedTempFile, &Path) -> Result<File, PersistError>,
) -> Result<File, PersistError> {
    let refused = match at_once(file, target) {
        Err(refused) if refused.error.kind() != io::ErrorKind::AlreadyExists => refused,
        done => return done,
    };
    let free = fs::symlink_metadata(target).is_err_and(|error| error.kind() == io::ErrorKind::NotFound);
    if !free {
        return Err(refused);
    }
    // Fails where the name was taken just now.
    if let Err(error) = File::create_new(target) {
        return Err(PersistError { error, file: refused.file });
    }
    refused.file.persist(target).inspect_err(|_| {
        let _ = fs::remove_file(target);
    })
}

impl Write for PendingFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for PendingFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

/// Leftovers younger than this may belong to a run on another machine, whose lock is not seen everywhere.
pub const STALE_AFTER: Duration = Duration::from_secs(60 * 60);

/// Removes what killed runs have left in `folder`, and says which files those were.
///
/// Only files with this program's temporary names are touched, and of these only those that nobody writes to:
/// their lock is free and their last change is at least `age` ago ([`STALE_AFTER`] is a good choice).
///
/// # Errors
/// [`FileError::Io`] if the folder cannot be read. A leftover that cannot be removed is left.
pub fn clean_leftovers(folder: &Path, age: Duration) -> FileResult<Vec<PathBuf>> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let entries = fs::read_dir(folder).map_err(|error| FileError::io(folder, "list", error))?;
    let mut removed = Vec::new();
    for entry in entries.flatten() {
        if !entry.file_name().to_str().is_some_and(is_temporary_name) {
            continue;
        }
        let path = entry.path();
        if is_stale(&path, age) && fs::remove_file(&path).is_ok() {
            removed.push(path);
        }
    }
    removed.sort();
    Ok(removed)
}

fn is_temporary_name(name: &str) -> bool {
    name.strip_prefix(PREFIX)
        .and_then(|rest| rest.strip_suffix(SUFFIX))
        .is_some_and(|random| random.len() == RANDOM && random.bytes().all(|b| b.is_ascii_alphanumeric()))
}

fn is_stale(path: &Path, age: Duration) -> bool {
    // A link of that name is not ours, and would be followed.
    let ordinary = fs::symlink_metadata(path).is_ok_and(|meta| meta.is_file());
    let Ok(file) = File::options().read(true).write(true).open(path) else { return false };
    let old = file.metadata().and_then(|meta| meta.modified()).is_ok_and(|changed| {
        // A change in the future has no age.
        changed.elapsed().is_ok_and(|since| since >= age)
    });
    ordinary
        && old
        && match file.try_lock() {
            Ok(()) => true,
            Err(TryLockError::WouldBlock) => false,
            // No locks here: only the age is left to tell, so it must be a long one.
            Err(TryLockError::Error(_)) => age >= STALE_AFTER,
        }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file system that can only rename.
    fn cannot(file: NamedTempFile, _: &Path) -> Result<File, PersistError> {
        Err(PersistError { error: io::ErrorKind::PermissionDenied.into(), file })
    }

    fn temporary(folder: &Path) -> NamedTempFile {
        let mut file = NamedTempFile::new_in(folder).unwrap();
        file.write_all(b"ours").unwrap();
        file
    }

    #[test]
    fn a_file_system_that_can_only_rename_gets_whole_files_too() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("out.exr");
        persist_new(temporary(folder.path()), &target, cannot).unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"ours");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_name_that_is_taken_stays_so() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("out.exr");
        fs::write(&target, "theirs").unwrap();
        for at_once in [cannot, |file: NamedTempFile, to: &Path| file.persist_noclobber(to)] {
            assert!(persist_new(temporary(folder.path()), &target, at_once).is_err());
            assert_eq!(fs::read(&target).unwrap(), b"theirs");
        }
    }

    #[test]
    fn a_rename_that_fails_leaves_no_placeholder() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("out.exr");
        let file = temporary(folder.path());
        fs::remove_file(file.path()).unwrap();
        assert!(persist_new(file, &target, cannot).is_err());
        assert!(!target.exists());
    }
}
