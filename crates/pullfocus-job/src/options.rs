//! Every option, once: the same declaration serves the command line and the settings file.

use crate::values::{DeviceChoice, Label, Largest, Names, Number, Range, Shape, Shown, Unit};
use clap::ValueEnum;
use pullfocus_io::images::Bits;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::str::FromStr;

/// Declares a group of options that may each be missing, for clap and for TOML, and how one group lies over
/// another.
macro_rules! options {
    ($(#[$meta:meta])* $name:ident { $( $(#[$field_meta:meta])* $field:ident: $ty:ty, )* }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Default, PartialEq, clap::Args, Deserialize, Serialize)]
        #[serde(default, rename_all = "kebab-case")]
        pub struct $name {
            $( $(#[$field_meta])* #[serde(skip_serializing_if = "Option::is_none")] pub $field: Option<$ty>, )*
        }

        impl $name {
            /// These options, and where one is missing that of `below`.
            #[must_use]
            pub fn over(self, below: Self) -> Self {
                Self { $( $field: self.$field.or(below.$field), )* }
            }
        }
    };
}

/// In TOML: one path, or a list of them.
fn one_or_more<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<Vec<PathBuf>>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "expected a path or a list of paths")]
    enum Paths {
        One(PathBuf),
        More(Vec<PathBuf>),
    }
    Ok(Some(match Paths::deserialize(deserializer)? {
        Paths::One(path) => vec![path],
        Paths::More(paths) => paths,
    }))
}

/// The way back from [`one_or_more`].
fn as_one_or_more<S: serde::Serializer>(paths: &Option<Vec<PathBuf>>, to: S) -> Result<S::Ok, S::Error> {
    match paths.as_deref() {
        Some([one]) => one.serialize(to),
        paths => paths.serialize(to),
    }
}

options! {
    /// Which files are read and written.
    Files {
        /// Picture to blur: OpenEXR with depth, or PNG, JPEG, TIFF, HDR, PFM beside --depth-file.
        ///
        /// Frames of a sequence are written `frame.####.exr` or `frame.%04d.exr`, or listed one by one. May be
        /// left out where --behind is given.
        #[arg(value_name = "IN")]
        #[serde(deserialize_with = "one_or_more", serialize_with = "as_one_or_more")]
        input: Vec<PathBuf>,
        /// File to write; its ending says the format. Frames as in IN.
        #[arg(short, long, value_name = "OUT", help_heading = "Files")]
        output: PathBuf,
        /// Depth in a file of its own, for pictures without a depth channel.
        #[arg(long, value_name = "FILE", help_heading = "Files")]
        depth_file: PathBuf,
        /// Near objects on their own (premultiplied RGBA and depth), to lie over what is behind them.
        #[arg(long, value_name = "FILE", help_heading = "Files")]
        foreground: PathBuf,
        /// Picture and depth of everything behind the foreground; it is blurred in place of IN, whose other
        /// channels are carried over.
        #[arg(long, value_name = "FILE", help_heading = "Files")]
        behind: PathBuf,
        /// Bits of a PNG, TIFF, ...: 8, 16 or float; the most that the format usually has if not given.
        #[arg(long, value_name = "BITS", help_heading = "Files")]
        bits: BitsName,
        /// Which frames of a sequence: 1001-1100, 1001-1100x2, 1,5,9. One picture is held for these frames, with OUT
        /// written `frame.####.exr`.
        #[arg(long, value_name = "RANGE", allow_hyphen_values = true, help_heading = "Files")]
        frames: Label,
        /// Part of an OpenEXR file, by name or by number from 0.
        #[arg(long, value_name = "PART", help_heading = "Files")]
        part: Label,
        /// View of a multi-view OpenEXR file, such as left.
        #[arg(long, value_name = "VIEW", help_heading = "Files")]
        view: Label,
        /// Replace files that are already there.
        #[arg(long, num_args = 0..=1, require_equals = true, default_missing_value = "true", value_name = "BOOL", hide_possible_values = true, help_heading = "Files")]
        overwrite: bool,
        /// Go on with a sequence: keep files that are already there, write the missing ones.
        #[arg(long, num_args = 0..=1, require_equals = true, default_missing_value = "true", value_name = "BOOL", hide_possible_values = true, help_heading = "Files")]
        resume: bool,
        /// Lift the limits on what a file may ask for (2^29 pixels, 16 GiB of planes), for files that one trusts.
        #[arg(long, num_args = 0..=1, require_equals = true, default_missing_value = "true", value_name = "BOOL", hide_possible_values = true, help_heading = "Files")]
        allow_large_files: bool,
    }
}

options! {
    /// The lens. What is missing is taken from the file's camera attributes.
    Lens {
        /// Distance to what is in focus, in metres; `inf` for infinity.
        #[arg(long, value_name = "M", allow_negative_numbers = true, help_heading = "Lens")]
        focus_distance: Number,
        /// f-stop (f-number); smaller is blurrier.
        #[arg(long, value_name = "N", allow_negative_numbers = true, help_heading = "Lens")]
        f_stop: Number,
        /// Focal length in millimetres.
        #[arg(long, value_name = "MM", allow_negative_numbers = true, help_heading = "Lens")]
        focal_length: Number,
        /// Width of the sensor (film back, horizontal aperture) in millimetres.
        #[arg(long, value_name = "MM", allow_negative_numbers = true, help_heading = "Lens")]
        sensor_width: Number,
        /// Horizontal field of view of the display window, in degrees.
        #[arg(long, value_name = "DEG", allow_negative_numbers = true, help_heading = "Lens")]
        fov_x: Number,
        /// Diameter of the aperture in metres, in place of the f-stop.
        #[arg(long, value_name = "M", allow_negative_numbers = true, help_heading = "Lens")]
        aperture_diameter: Number,
    }
}

/// What a depth channel's numbers mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DepthForm {
    /// Along the optical axis: OpenEXR's Z, most renderers
    Planar,
    /// Along the ray through the pixel: Mitsuba's aov, old Cycles
    Ray,
    /// 1/z: Nuke's scan-line renderer
    Inverse,
    /// 1/z = scale * value + shift: phones and learned depth
    Disparity,
    /// 0 at --depth-near to 1 at --depth-far
    Normalized,
}

options! {
    /// Where depth is and what its numbers mean.
    Depth {
        /// What the depth channel's numbers mean; planar by default.
        #[arg(long, value_name = "FORM", help_heading = "Depth")]
        depth: DepthForm,
        /// Depth channel, such as Z or depth.Z; found by its usual names if not given.
        #[arg(long, value_name = "NAME", help_heading = "Depth")]
        depth_channel: Label,
        /// Channel that holds the signed diameter of the circle of confusion in pixels, in place of depth.
        #[arg(long, value_name = "NAME", help_heading = "Depth")]
        coc_channel: Label,
        /// Unit of depth: m, cm, mm, ft, in, or metres per unit.
        #[arg(long, value_name = "UNIT", help_heading = "Depth")]
        depth_unit: Unit,
        /// Disparity: factor on the value, in 1/m.
        #[arg(long, value_name = "S", allow_negative_numbers = true, help_heading = "Depth")]
        depth_scale: Number,
        /// Disparity: added afterwards, in 1/m; 0 by default.
        #[arg(long, value_name = "S", allow_negative_numbers = true, help_heading = "Depth")]
        depth_shift: Number,
        /// Normalized: distance in metres where the value is 0.
        #[arg(long, value_name = "M", allow_negative_numbers = true, help_heading = "Depth")]
        depth_near: Number,
        /// Normalized: distance in metres where the value is 1.
        #[arg(long, value_name = "M", allow_negative_numbers = true, help_heading = "Depth")]
        depth_far: Number,
        /// Normalized: white is near.
        #[arg(long, num_args = 0..=1, require_equals = true, default_missing_value = "true", value_name = "BOOL", hide_possible_values = true, help_heading = "Depth")]
        depth_invert: bool,
        /// Distance in metres at and beyond which nothing is there (a renderer's far clip).
        #[arg(long, value_name = "M", allow_negative_numbers = true, help_heading = "Depth")]
        depth_far_clip: Number,
        /// Mend depth that was anti-aliased.
        #[arg(long, num_args = 0..=1, require_equals = true, default_missing_value = "true", value_name = "BOOL", hide_possible_values = true, help_heading = "Depth")]
        repair_depth: bool,
    }
}

options! {
    /// What is done to the circle of confusion beside the lens.
    Circle {
        /// Largest circle of confusion: pixels (40) or a part of the width (2%).
        #[arg(long, value_name = "SIZE", help_heading = "Circle of confusion")]
        max_coc: Largest,
        /// Factor on circles in front of the plane in focus.
        #[arg(long, value_name = "X", allow_negative_numbers = true, help_heading = "Circle of confusion")]
        front: Number,
        /// Factor on circles behind the plane in focus.
        #[arg(long, value_name = "X", allow_negative_numbers = true, help_heading = "Circle of confusion")]
        back: Number,
        /// Range of distances in metres that stays sharp.
        #[arg(long, value_name = "NEAR,FAR", help_heading = "Circle of confusion")]
        protect: Range,
    }
}

/// Settings by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PresetName {
    /// Two layers and one plain step: quick, for choosing focus and f-stop
    Preview,
    /// General layers and the aperture's shape: the picture to keep
    Final,
}

/// How a layer is blurred.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MethodName {
    /// Anisotropic heat diffusion, at the same cost for every size of circle: the default of preset preview
    Diffusion,
    /// Every pixel spread over its circle (--psf), slowly
    Naive,
    /// Every pixel an average over its own circle (--psf), slowly
    Gather,
    /// Every pixel spread over a square, at the same cost for every size of circle
    Square,
    /// Every pixel spread over a Gaussian through a pyramid, at the same cost for every size of circle
    Pyramid,
    /// Averages gathered at few sites and spread again as Gaussians: the larger the blur, the faster (--tensor-sites)
    Tensor,
    /// Every pixel spread over the aperture's own shape (--aperture), at the same cost for every size of circle: the
    /// default of preset final
    Aperture,
}

/// The shape of a point of light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PsfName {
    /// A Gaussian as wide as the aperture: the default
    Gaussian,
    /// The aperture itself
    Aperture,
}

/// Where the tensor filter's sites lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SitesName {
    /// At the leaves of a quadtree over the circles, so that every pixel is served: the default
    Quadtree,
    /// By skip level, as in the paper: small blurred things can be missed
    Skip,
}

/// How a site of the tensor filter gathers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum GatherName {
    /// Pixel by pixel
    Naive,
    /// On a level of the reduced picture: the default
    Pyramid,
    /// From sums of sums (Heckbert 1986)
    RepeatedIntegration,
}

/// How a site of the tensor filter spreads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SpreadName {
    /// Pixel by pixel
    Naive,
    /// On a level of a pyramid: the default
    Pyramid,
}

/// How finely the pyramid draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum QualityName {
    /// The picture of --method naive to 50 dB: the default
    Standard,
    /// One level finer, some four times as slow
    Fine,
}

/// What the pyramid does between two levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MipmapName {
    /// Both levels, one going over smoothly into the other: the default
    Linear,
    /// The finer one alone, with a larger Gaussian; jumps where a growing circle changes its level
    Nearest,
}

/// Numbers in a GPU's memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StorageName {
    /// 32 bits
    F32,
    /// 16 bits; sums are still of 32
    F16,
}

/// Which layers are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LayeringName {
    /// The plain one-layer method and nothing else
    Single,
    /// The picture over background layers: far things blur behind sharp ones
    Background,
    /// Layers through the whole depth, near ones included
    General,
}

/// How the heat equation is followed through time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum IntegratorName {
    /// The papers' implicit step, --steps times
    BackwardEuler,
    /// One complex solve, as close to a Gaussian as sixteen steps
    Rational,
    /// Two complex solves, round and even as a lens's disc: the default
    Disc,
}

/// Blur width for a circle of confusion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CalibrationName {
    /// d^2/32: as wide as a disc of diameter d
    Variance,
    /// d^2: the letter of Kass, Lefohn and Owens 2006
    Kass,
    /// (d/2)^2: the letter of Beck 2012
    Beck,
}

/// How exactly pictures other than OpenEXR are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BitsName {
    /// 8-bit whole numbers
    #[value(name = "8")]
    Eight,
    /// 16-bit whole numbers
    #[value(name = "16")]
    Sixteen,
    /// Floats, linear
    Float,
}

impl From<BitsName> for Bits {
    fn from(name: BitsName) -> Self {
        match name {
            BitsName::Eight => Self::Eight,
            BitsName::Sixteen => Self::Sixteen,
            BitsName::Float => Self::Float,
        }
    }
}

impl FromStr for BitsName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        <Self as ValueEnum>::from_str(text, false).map_err(|_| format!("'{text}' is none of 8, 16, float"))
    }
}

crate::values::from_text!(BitsName);

impl Serialize for BitsName {
    fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Eight => to.serialize_u8(8),
            Self::Sixteen => to.serialize_u8(16),
            Self::Float => to.serialize_str("float"),
        }
    }
}

/// Who solves the tridiagonal systems.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SolverName {
    /// Elimination: exact, the quickest here
    Lu,
    /// Cyclic reduction: exact
    CyclicReduction,
    /// Parallel cyclic reduction: exact
    ParallelCyclicReduction,
    /// Cyclic reduction until few unknowns are left, then the parallel form: exact
    Hybrid,
    /// Jacobi sweeps: approximate
    Jacobi,
}

options! {
    /// How the blur is made. Each one given overrides the preset.
    Blur {
        /// Settings by name; final by default.
        #[arg(long, value_name = "NAME", help_heading = "Blur")]
        preset: PresetName,
        /// How a layer is blurred.
        #[arg(long, value_name = "NAME", help_heading = "Blur")]
        method: MethodName,
        /// Shape of a point of light, for --method naive and gather.
        #[arg(long, value_name = "NAME", help_heading = "Blur")]
        psf: PsfName,
        /// The aperture: disc (the default), blades:N for an iris of N blades, or image:FILE for a picture of it (its longer
        /// side spans the circle of confusion).
        #[arg(long, value_name = "SHAPE", help_heading = "Blur")]
        aperture: Shape,
        /// Degrees by which the aperture is turned, clockwise in the picture.
        #[arg(long, value_name = "DEG", allow_negative_numbers = true, help_heading = "Blur")]
        aperture_rotation: Number,
        /// How far blades are bent, 0 for straight ones to 1 for a disc.
        #[arg(long, value_name = "PART", allow_negative_numbers = true, help_heading = "Blur")]
        aperture_roundness: Number,
        /// Height of a point's image over its width: 2 for an anamorphic lens of squeeze 2.
        #[arg(long, value_name = "RATIO", allow_negative_numbers = true, help_heading = "Blur")]
        squeeze: Number,
        /// Brightness from which light out of focus is spread as highlights in the aperture's shape: the largest of a pixel's red, green
        /// and blue, linear, 1 for white. No highlights if not given.
        #[arg(long, value_name = "X", allow_negative_numbers = true, help_heading = "Highlights")]
        bokeh_threshold: Number,
        /// Factor on the highlights' light; 1, which keeps energy, if not given.
        #[arg(long, value_name = "X", allow_negative_numbers = true, help_heading = "Highlights")]
        bokeh_gain: Number,
        /// How softly light becomes a highlight, as a part of the threshold: 0 to 1; 0.5 if not given.
        #[arg(long, value_name = "PART", allow_negative_numbers = true, help_heading = "Highlights")]
        bokeh_knee: Number,
        /// Circle of confusion, in pixels of a picture 960 wide, from which light is spread; 2 if not given.
        #[arg(long, value_name = "PX", allow_negative_numbers = true, help_heading = "Highlights")]
        bokeh_least: Number,
        /// Optical vignetting: how far highlights are cut towards the corners, 0 (not at all) to 1.
        #[arg(long, value_name = "PART", allow_negative_numbers = true, help_heading = "Highlights")]
        cats_eye: Number,
        /// How finely --method pyramid draws.
        #[arg(long, value_name = "NAME", help_heading = "Blur")]
        quality: QualityName,
        /// What --method pyramid does with a size between two levels.
        #[arg(long, value_name = "NAME", help_heading = "Blur")]
        mipmap: MipmapName,
        /// Where --method tensor has its sites.
        #[arg(long, value_name = "NAME", help_heading = "Blur")]
        tensor_sites: SitesName,
        /// How far apart they lie at most, in standard deviations of the blur, 0.25 to 0.84; 0.6 by default.
        #[arg(long, value_name = "X", allow_negative_numbers = true, help_heading = "Blur")]
        tensor_spacing: Number,
        /// How each of them gathers.
        #[arg(long, value_name = "NAME", help_heading = "Blur")]
        tensor_gather: GatherName,
        /// How each of them spreads.
        #[arg(long, value_name = "NAME", help_heading = "Blur")]
        tensor_spread: SpreadName,
        /// Which layers the picture is taken apart into.
        #[arg(long, value_name = "NAME", help_heading = "Blur")]
        layering: LayeringName,
        /// Number of layers, 1 to 16.
        #[arg(long, value_name = "N", help_heading = "Blur")]
        layers: u32,
        /// Background layering: diameter, in widths of the picture, from which on all is background.
        #[arg(long, value_name = "PART", allow_negative_numbers = true, help_heading = "Blur")]
        layer_threshold: Number,
        /// What is shown: result (the default), or one layer alone: layer:N is its colour, premultiplied over nothing, matte:N how
        /// much it covers, 0 to 1. N is 0 for the farthest; a foreground is the last. A run tells how many layers there are.
        #[arg(long, value_name = "WHAT", help_heading = "Blur")]
        show: Shown,
        /// How the diffusion is followed through time.
        #[arg(long, value_name = "NAME", help_heading = "Blur")]
        integrator: IntegratorName,
        /// Number of backward-Euler steps.
        #[arg(long, value_name = "N", help_heading = "Blur")]
        steps: u32,
        /// Blur width for a circle of confusion; variance is right, the others are the papers'.
        #[arg(long, value_name = "NAME", help_heading = "Blur")]
        calibration: CalibrationName,
        /// Who solves the linear systems.
        #[arg(long, value_name = "NAME", help_heading = "Blur")]
        solver: SolverName,
        /// Jacobi: number of sweeps along each axis.
        #[arg(long, value_name = "N", help_heading = "Blur")]
        sweeps: u32,
        /// Jacobi: stop when no value changes by more than this part of the largest.
        #[arg(long, value_name = "T", allow_negative_numbers = true, help_heading = "Blur")]
        tolerance: Number,
        /// Layers and channels that go through the lens, such as beauty,key,fill; the picture's own colour
        /// if not given.
        #[arg(long, value_name = "LIST", help_heading = "Blur")]
        channels: Names,
        /// Write an 8-bit sRGB PNG of each result as well. Frames as in IN.
        #[arg(long, value_name = "FILE", help_heading = "Files")]
        preview_png: PathBuf,
        /// What renders: auto (a GPU if there is one, else the CPU; the default), cpu, gpu, or gpu:NAME with a
        /// part of the GPU's name. `pullfocus devices` lists them.
        #[arg(long, value_name = "DEVICE", help_heading = "Running")]
        device: DeviceChoice,
        /// How a GPU keeps the picture: f32 (the default), or f16, which is faster and takes half the memory.
        #[arg(long, value_name = "TYPE", help_heading = "Running")]
        gpu_storage: StorageName,
    }
}

options! {
    /// How the program runs and what it tells.
    Run {
        /// Number of threads that compute; all processors by default. The result is the same for any number.
        #[arg(long, value_name = "N", help_heading = "Running")]
        threads: u32,
        /// One JSON document on standard output, for machines.
        #[arg(long, num_args = 0..=1, require_equals = true, default_missing_value = "true", value_name = "BOOL", hide_possible_values = true, help_heading = "Running")]
        json: bool,
        /// Tell how long each stage took.
        #[arg(short, long, num_args = 0..=1, require_equals = true, default_missing_value = "true", value_name = "BOOL", hide_possible_values = true, help_heading = "Running")]
        verbose: bool,
        /// Tell nothing but errors.
        #[arg(short, long, num_args = 0..=1, require_equals = true, default_missing_value = "true", value_name = "BOOL", hide_possible_values = true, help_heading = "Running")]
        quiet: bool,
    }
}

options! {
    /// What `coc` alone has.
    CocView {
        /// Diameter in pixels that is shown in full colour; the largest in the picture by default.
        #[arg(long, value_name = "PX", allow_negative_numbers = true, help_heading = "Circle of confusion")]
        coc_range: Number,
    }
}
