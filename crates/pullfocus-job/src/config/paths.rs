//! The paths in options, and how they are told from a settings file's folder.

use super::Options;
use crate::values::Shape;
use std::path::{Component, Path, PathBuf};

/// Every path that the options hold.
pub(super) fn each(options: &mut Options, mut change: impl FnMut(&mut PathBuf)) {
    let files = &mut options.files;
    files.input.iter_mut().flatten().for_each(&mut change);
    let single = [&mut files.output, &mut files.depth_file, &mut files.foreground, &mut files.behind];
    single.into_iter().flatten().for_each(&mut change);
    options.blur.preview_png.iter_mut().for_each(&mut change);
    if let Some(Shape::Image(file)) = &mut options.blur.aperture {
        change(file);
    }
}

/// A path as it is told from `folder`, which is there; none where the two have nothing in common but the root of the
/// file system. Its parts are put together with `/`, which every system reads.
pub(super) fn from(folder: &Path, path: &Path) -> Option<PathBuf> {
    let (folder, path) = (folder.canonicalize().ok()?, real(path)?);
    let common = folder.components().zip(path.components()).take_while(|(a, b)| a == b).count();
    let named = |part: &Component<'_>| matches!(part, Component::Normal(_));
    if !folder.components().take(common).any(|part| named(&part)) {
        return None;
    }
    let up = folder.components().skip(common).map(|_| "..");
    let mut parts: Vec<&str> = up.collect();
    for part in path.components().skip(common) {
        parts.push(part.as_os_str().to_str()?);
    }
    Some(if parts.is_empty() { ".".into() } else { parts.join("/").into() })
}

/// The path without links, `.` and `..` in its folders. The file itself, and folders too, need not be there; a file
/// that is a link keeps its own name.
fn real(path: &Path) -> Option<PathBuf> {
    let path = std::path::absolute(path).ok()?;
    let Some(name) = path.file_name() else { return path.canonicalize().ok() };
    let folder = path.parent()?;
    let there = folder.ancestors().find_map(|folder| Some((folder, folder.canonicalize().ok()?)));
    let (there, canonical) = there?;
    let rest = folder.strip_prefix(there).ok()?;
    // A way up out of a folder that is not there leads nobody knows where.
    let plain = rest.components().all(|part| matches!(part, Component::Normal(_)));
    plain.then(|| canonical.join(rest).join(name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn paths_are_told_from_the_folder() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        fs::create_dir_all(at("shots/a")).unwrap();
        fs::create_dir_all(at("renders")).unwrap();
        fs::write(at("shots/in.exr"), "x").unwrap();
        let told = |folder: &str, path: &str| from(&at(folder), &at(path)).unwrap();
        for (folder, path, expected) in [
            ("shots", "shots/in.exr", "in.exr"),
            ("shots", "shots/a/../in.exr", "in.exr"),
            ("shots", "shots/gone/deep/out.####.exr", "gone/deep/out.####.exr"),
            ("shots/a", "renders/f.####.exr", "../../renders/f.####.exr"),
            ("shots", "shots/a/..", "."),
            ("shots/a", ".", "../.."),
        ] {
            assert_eq!(told(folder, path).to_str().unwrap(), expected);
        }
        assert_eq!(from(&at("gone"), &at("in.exr")), None);
        assert_eq!(from(&at("shots"), &at("shots/gone/../in.exr")), None);
    }

    #[cfg(unix)]
    #[test]
    fn links_lead_where_the_system_goes() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        fs::create_dir_all(at("disk/shots")).unwrap();
        fs::create_dir_all(at("home")).unwrap();
        fs::write(at("disk/in.exr"), "x").unwrap();
        std::os::unix::fs::symlink(at("disk/shots"), at("home/shots")).unwrap();
        std::os::unix::fs::symlink(at("disk/in.exr"), at("home/link.exr")).unwrap();
        // Through the link and up is not where it came from.
        let told = from(&at("home/shots"), &at("disk/in.exr")).unwrap();
        assert_eq!(told.to_str().unwrap(), "../in.exr");
        assert!(at("home/shots").join(told).is_file());
        assert_eq!(from(&at("home"), &at("home/link.exr")).unwrap().to_str().unwrap(), "link.exr");
        assert_eq!(from(&at("home"), Path::new("/in.exr")), None);
    }
}
