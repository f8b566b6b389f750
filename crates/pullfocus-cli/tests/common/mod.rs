//! Frames made up for the tests, and the program run on them.

// Each file of tests uses a part of it.
#![allow(dead_code)]

use pullfocus_core::{Frame, Plane, Size, Window};
use pullfocus_io::{AttributeValue, SampleType, write_exr};
use std::ffi::OsStr;
use std::fs::File;
use std::io::BufWriter;
use std::process::{Command, Stdio};

/// Width of the made-up frames.
pub const WIDTH: usize = 48;
/// Height of the made-up frames.
pub const HEIGHT: usize = 32;

/// A run of the program, not yet started.
pub fn command<A: AsRef<OsStr>>(arguments: impl IntoIterator<Item = A>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pullfocus"));
    command.args(arguments).stdin(Stdio::null());
    command
}

/// Runs the program: exit code, standard output, standard error.
pub fn pullfocus<A: AsRef<OsStr>>(arguments: impl IntoIterator<Item = A>) -> (i32, String, String) {
    let output = command(arguments).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap_or(-1), text(output.stdout), text(output.stderr))
}

/// Standard output of a run that must do well.
#[track_caller]
pub fn ok((status, stdout, stderr): (i32, String, String)) -> String {
    assert_eq!(status, 0, "{stderr}{stdout}");
    stdout
}

/// Standard error of a run that must end with this exit code.
#[track_caller]
pub fn refused(code: i32, (status, stdout, stderr): (i32, String, String)) -> String {
    assert_eq!(status, code, "{stderr}{stdout}");
    stderr
}

/// A folder that goes away with the test.
pub struct Folder(tempfile::TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().unwrap().to_owned()
    }

    pub fn has(&self, name: &str) -> bool {
        self.0.path().join(name).exists()
    }

    /// Files under temporary names.
    pub fn leftovers(&self) -> usize {
        let names = std::fs::read_dir(self.0.path()).unwrap().map(|entry| entry.unwrap().file_name());
        names.filter(|name| name.to_string_lossy().starts_with('.')).count()
    }

    /// A frame: a near strip at 1 m, a wall at 2 m, the sky; a texture that depends on `seed`.
    pub fn frame(&self, name: &str, seed: usize) -> String {
        self.write(name, Size::new(WIDTH, HEIGHT), seed, &[])
    }

    pub fn sized_frame(&self, name: &str, seed: usize, width: usize, height: usize) -> String {
        self.write(name, Size::new(width, height), seed, &[])
    }

    pub fn frame_with_camera(&self, name: &str) -> String {
        self.frame_with_lens(name, 50.0)
    }

    pub fn frame_with_lens(&self, name: &str, focal_length_mm: f32) -> String {
        let float = AttributeValue::Float;
        let camera = [
            ("focus", float(2.0)),
            ("aperture", float(2.8)),
            ("pinholeFocalLength", float(focal_length_mm)),
            ("cameraAperture", float(36.0)),
        ];
        self.write(name, Size::new(WIDTH, HEIGHT), 1, &camera)
    }

    /// A frame with these attributes.
    pub fn frame_with(&self, name: &str, attributes: &[(&str, AttributeValue)]) -> String {
        self.write(name, Size::new(WIDTH, HEIGHT), 1, attributes)
    }

    fn write(&self, name: &str, size: Size, seed: usize, attributes: &[(&str, AttributeValue)]) -> String {
        let color = |shift| texture(size, seed + shift);
        let (r, g, b) = (color(0), color(1), color(2));
        let z = Plane::from_fn(size, |x, _| depth(x, size)).unwrap();
        let id = Plane::from_fn(size, |x, y| (x * y) as f32).unwrap();
        let half = SampleType::Half;
        let planes = [
            ("R", &r, half),
            ("G", &g, half),
            ("B", &b, half),
            ("Z", &z, SampleType::Float),
            ("id.X", &id, SampleType::Uint),
        ];
        self.exr(name, size, &planes, attributes)
    }

    /// A frame for the right eye, and darkness for the left one.
    pub fn eyes(&self, name: &str) -> String {
        let size = Size::new(WIDTH, HEIGHT);
        let [r, g, b] = [0, 1, 2].map(|shift| texture(size, 1 + shift));
        let dark = Plane::filled(size, 0.0).unwrap();
        let z = Plane::from_fn(size, |x, _| depth(x, size)).unwrap();
        let (half, float) = (SampleType::Half, SampleType::Float);
        let planes = [
            ("R", &r, half),
            ("G", &g, half),
            ("B", &b, half),
            ("Z", &z, float),
            ("left.R", &dark, half),
            ("left.G", &dark, half),
            ("left.B", &dark, half),
            ("left.Z", &z, float),
        ];
        let views = AttributeValue::Texts(vec!["right".into(), "left".into()]);
        self.exr(name, size, &planes, &[("multiView", views)])
    }

    /// A frame with pixels for a part of its display window.
    pub fn cropped_frame(&self, name: &str) -> String {
        let size = Size::new(WIDTH, HEIGHT);
        let window = |x, y, size| Window { x, y, size };
        let frame = Frame {
            display: window(0, 0, Size::new(2 * WIDTH, HEIGHT + 4)),
            data: window(3, 2, size),
            ..Frame::full(size)
        };
        let (color, z) = (texture(size, 1), Plane::from_fn(size, |x, _| depth(x, size)).unwrap());
        let float = SampleType::Float;
        let path = self.path(name);
        let out = BufWriter::new(File::create(&path).unwrap());
        let planes = [("R", &color, float), ("G", &color, float), ("B", &color, float), ("Z", &z, float)];
        write_exr(out, &frame, &planes, &[]).unwrap();
        path
    }

    /// The frame's near strip alone, and all the rest.
    pub fn layers(&self, near: &str, far: &str) -> (String, String) {
        let size = Size::new(WIDTH, HEIGHT);
        let color = texture(size, 3);
        let alpha = Plane::from_fn(size, |x, _| f32::from(depth(x, size) == 1.0)).unwrap();
        let covered = Plane::from_fn(size, |x, y| color.at(x, y) * alpha.at(x, y)).unwrap();
        let (z_near, z_far) = (Plane::filled(size, 1.0).unwrap(), Plane::filled(size, 4.0).unwrap());
        let float = SampleType::Float;
        let near = self.exr(
            near,
            size,
            &[
                ("R", &covered, float),
                ("G", &covered, float),
                ("B", &covered, float),
                ("A", &alpha, float),
                ("Z", &z_near, float),
            ],
            &[],
        );
        // Halves, as the frame itself has: the two ways of writing the result must round alike.
        let half = SampleType::Half;
        let far = self.exr(
            far,
            size,
            &[("R", &color, half), ("G", &color, half), ("B", &color, half), ("Z", &z_far, float)],
            &[],
        );
        (near, far)
    }

    /// A grey ramp as an 8-bit PNG.
    pub fn picture(&self, name: &str) -> String {
        let ramp = Plane::from_fn(Size::new(WIDTH, HEIGHT), |x, _| x as f32 / WIDTH as f32).unwrap();
        let path = self.path(name);
        let existing = pullfocus_io::output::Existing::Refuse;
        let encoding =
            pullfocus_io::images::Encoding::for_name(path.as_ref(), Some(pullfocus_io::images::Bits::Eight))
                .unwrap();
        pullfocus_io::images::save_srgb(
            path.as_ref(),
            &[ramp.clone(), ramp.clone(), ramp],
            encoding,
            existing,
        )
        .unwrap();
        path
    }

    /// Depth alone, half of it at 1 m and half at 4 m.
    pub fn depth(&self, name: &str, channels: &[&str]) -> String {
        self.depth_at(name, channels, [0, 0], 1.0, &[])
    }

    /// Depth alone in a display window that begins at `at`, in units of so many metres.
    pub fn depth_at(
        &self,
        name: &str,
        channels: &[&str],
        [x, y]: [i32; 2],
        unit_m: f32,
        attributes: &[(&str, AttributeValue)],
    ) -> String {
        let size = Size::new(WIDTH, HEIGHT);
        let halves = |x: usize, _| if 2 * x < WIDTH { 1.0 / unit_m } else { 4.0 / unit_m };
        let z = Plane::from_fn(size, halves).unwrap();
        let planes: Vec<_> = channels.iter().map(|&name| (name, &z, SampleType::Float)).collect();
        let window = Window { x, y, size };
        let frame = Frame { display: window, data: window, ..Frame::full(size) };
        let path = self.path(name);
        let out = BufWriter::new(File::create(&path).unwrap());
        write_exr(out, &frame, &planes, attributes).unwrap();
        path
    }

    fn exr(
        &self,
        name: &str,
        size: Size,
        planes: &[(&str, &Plane, SampleType)],
        attributes: &[(&str, AttributeValue)],
    ) -> String {
        let path = self.path(name);
        let out = BufWriter::new(File::create(&path).unwrap());
        write_exr(out, &Frame::full(size), planes, attributes).unwrap();
        path
    }
}

fn depth(x: usize, size: Size) -> f32 {
    match 8 * x / size.width {
        0 => 1.0,
        1..=4 => 2.0,
        _ => 1e10,
    }
}

fn texture(size: Size, seed: usize) -> Plane {
    Plane::from_fn(size, |x, y| {
        let wave = ((x * (seed % 5 + 1)) as f32 * 0.3).sin() * ((y + seed) as f32 * 0.4).cos();
        0.45 + 0.4 * wave
    })
    .unwrap()
}
