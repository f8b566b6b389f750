//! Which files belong to which frame.

use pullfocus_io::sequence::{FrameFiles, Request, plan};
use std::fs;
use std::path::{Path, PathBuf};

struct Folder(tempfile::TempDir);

impl Folder {
    fn with(names: &[&str]) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        for name in names {
            fs::create_dir_all(folder.path(name).parent().unwrap()).unwrap();
            fs::write(folder.path(name), "x").unwrap();
        }
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn plan(&self, inputs: &[&str], output: &str, frames: Option<&str>) -> Result<Vec<FrameFiles>, String> {
        self.plan_beside(inputs, &[], output, frames)
    }

    fn plan_beside(
        &self,
        inputs: &[&str],
        companions: &[(&'static str, &str)],
        output: &str,
        frames: Option<&str>,
    ) -> Result<Vec<FrameFiles>, String> {
        let request = Request {
            inputs: inputs.iter().map(|name| self.path(name)).collect(),
            companions: companions.iter().map(|&(what, name)| (what, self.path(name))).collect(),
            output: Some(self.path(output)),
            frames: frames.map(|text| text.parse().unwrap()),
        };
        plan(&request).map_err(|error| error.to_string())
    }
}

fn name(path: &Path) -> &str {
    path.file_name().unwrap().to_str().unwrap()
}

#[test]
fn one_file_needs_no_pattern() {
    let folder = Folder::with(&["in.exr"]);
    let plan = folder.plan(&["in.exr"], "out.exr", None).unwrap();
    assert_eq!(plan.len(), 1);
    assert_eq!((plan[0].frame, name(&plan[0].output)), (None, "out.exr"));
}

#[test]
fn a_pattern_finds_its_frames_and_names_the_outputs() {
    let folder = Folder::with(&["in.0001.exr", "in.0003.exr", "in.0010.exr", "in.0003.png"]);
    let plan = folder.plan(&["in.####.exr"], "out_%03d.png", None).unwrap();
    let all: Vec<_> = plan.iter().map(|f| (f.frame.unwrap(), name(&f.input), name(&f.output))).collect();
    assert_eq!(
        all,
        [
            (1, "in.0001.exr", "out_001.png"),
            (3, "in.0003.exr", "out_003.png"),
            (10, "in.0010.exr", "out_010.png")
        ]
    );
    let chosen = folder.plan(&["in.####.exr"], "out.#.exr", Some("1-3x2")).unwrap();
    assert_eq!(chosen.iter().map(|f| f.frame.unwrap()).collect::<Vec<_>>(), [1, 3]);
}

#[test]
fn missing_frames_are_listed_as_ranges() {
    let folder = Folder::with(&["in.0001.exr", "in.0003.exr", "fg.0001.exr"]);
    let said = folder.plan(&["in.####.exr"], "out.####.exr", Some("1-10")).unwrap_err();
    assert!(said.contains("8 of 10 files are missing: 2, 4-10"), "{said}");
    let said = folder
        .plan_beside(&["in.####.exr"], &[("foreground", "fg.####.exr")], "out.####.exr", None)
        .unwrap_err();
    assert!(said.contains("fg.####.exr") && said.contains("1 of 2 file is missing: 3"), "{said}");
    let said = folder.plan(&["other.####.exr"], "out.####.exr", None).unwrap_err();
    assert!(said.contains("no file has a name of this pattern"), "{said}");
    let said = folder.plan(&["gone.exr"], "out.exr", None).unwrap_err();
    assert!(said.contains("no such file"), "{said}");
}

#[test]
fn companions_follow_the_frame_or_stay() {
    let folder = Folder::with(&["in.01.exr", "in.02.exr", "z/depth_1.pfm", "z/depth_2.pfm", "behind.exr"]);
    let plan = folder
        .plan_beside(
            &["in.##.exr"],
            &[("depth", "z/depth_%d.pfm"), ("behind", "behind.exr")],
            "out.##.exr",
            None,
        )
        .unwrap();
    let companions: Vec<Vec<_>> =
        plan.iter().map(|files| files.companions.iter().map(|path| name(path)).collect()).collect();
    assert_eq!(companions, [["depth_1.pfm", "behind.exr"], ["depth_2.pfm", "behind.exr"]]);
    assert_eq!(plan[1].inputs().count(), 3);
    assert!(folder.plan_beside(&["in.##.exr"], &[("depth", "no.pfm")], "out.##.exr", None).is_err());
}

#[test]
fn a_list_takes_the_numbers_of_its_names() {
    let folder = Folder::with(&["b_v2.7.exr", "a_v2.12.exr", "plain.exr", "out/x"]);
    let plan = folder.plan(&["b_v2.7.exr", "a_v2.12.exr"], "o.####.exr", None).unwrap();
    let outputs: Vec<_> = plan.iter().map(|files| name(&files.output)).collect();
    assert_eq!(outputs, ["o.0007.exr", "o.0012.exr"], "a list keeps its order");
    let said = folder.plan(&["b_v2.7.exr", "plain.exr"], "o.####.exr", None).unwrap_err();
    assert!(said.contains("plain.exr") && said.contains("no frame number"), "{said}");
    let into_folder = folder.plan(&["b_v2.7.exr", "plain.exr"], "out", None).unwrap();
    assert_eq!(into_folder[1].output, folder.path("out/plain.exr"));
    let said = folder.plan(&["b_v2.7.exr", "plain.exr"], "o.exr", None).unwrap_err();
    assert!(said.contains("out.####.exr"), "{said}");
}

#[test]
fn outputs_collide_with_nothing() {
    let folder = Folder::with(&["in.1.exr", "in.2.exr", "other.1.exr", "fg.exr"]);
    let said = folder.plan(&["in.#.exr"], "in.#.exr", None).unwrap_err();
    assert!(said.contains("overwrite an input"), "{said}");
    let said = folder.plan_beside(&["in.1.exr"], &[("foreground", "fg.exr")], "fg.exr", None).unwrap_err();
    assert!(said.contains("overwrite an input"), "{said}");
    let said = folder.plan(&["in.1.exr", "other.1.exr"], "o.#.exr", None).unwrap_err();
    assert!(said.contains("in.1.exr") && said.contains("other.1.exr"), "{said}");
    let said = folder.plan(&["in.#.exr"], ".", None).unwrap_err();
    assert!(said.contains("overwrite an input"), "{said}");
}

#[test]
fn frames_need_a_place_for_their_number() {
    let folder = Folder::with(&["in.0001.exr", "take#2.exr"]);
    let said = folder.plan(&["in.0001.exr"], "out.exr", Some("1-5")).unwrap_err();
    assert!(said.contains("shot.####.exr"), "{said}");
    // A file that really has such a name is that file.
    let plan = folder.plan(&["take#2.exr"], "out.exr", None).unwrap();
    assert_eq!(name(&plan[0].input), "take#2.exr");
}

#[test]
fn a_still_is_held_for_the_frames_asked_for() {
    let folder = Folder::with(&["photo.exr", "IMG_2034.exr", "b.exr", "z.03.pfm", "z.04.pfm", "out/x"]);
    let plan = folder
        .plan_beside(
            &["IMG_2034.exr"],
            &[("depth", "z.##.pfm"), ("behind", "b.exr")],
            "o.##.exr",
            Some("3-4"),
        )
        .unwrap();
    let all: Vec<_> = plan.iter().map(|f| (f.frame.unwrap(), name(&f.input), name(&f.output))).collect();
    assert_eq!(all, [(3, "IMG_2034.exr", "o.03.exr"), (4, "IMG_2034.exr", "o.04.exr")]);
    assert_eq!(name(&plan[1].companions[0]), "z.04.pfm");
    // One frame of it needs no place for a number.
    let plan = folder.plan(&["photo.exr"], "o.exr", Some("7")).unwrap();
    assert_eq!((plan.len(), plan[0].frame, name(&plan[0].output)), (1, Some(7), "o.exr"));
    for (inputs, output, words) in [
        (&["photo.exr"][..], "o.exr", "o.exr: this is one name for 2 frames of a still"),
        (&["photo.exr"], "out", "out: this is one name for 2 frames of a still"),
        (&["photo.exr", "b.exr"], "o.#.exr", "give one picture alone"),
        (&["gone.exr"], "o.#.exr", "no such file"),
        (&["photo.exr"], "a.#.#.exr", "two places"),
    ] {
        let said = folder.plan(inputs, output, Some("3-4")).unwrap_err();
        assert!(said.contains(words), "{said}");
    }
    // A picture of the sequence that was meant.
    let said = folder.plan(&["IMG_2034.exr"], "o.####.exr", Some("2001-2100")).unwrap_err();
    assert!(said.contains("frame 2034") && said.contains("shot.####.exr"), "{said}");
}
