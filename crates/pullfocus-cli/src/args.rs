//! The command line.

use clap::{Args, Parser, Subcommand};
use pullfocus_core::pull::Pull;
use pullfocus_job::config::Options;
use pullfocus_job::options::{Blur, Circle, CocView, Depth, Files, Lens, Run};
use pullfocus_job::values::{BenchSize, DeviceChoice, Largest};
use std::path::PathBuf;

/// Depth of field for pictures in perfect focus: rendered frames and photographs with depth.
#[derive(Debug, Parser)]
#[command(name = "pullfocus", version, max_term_width = 110, after_help = EXAMPLES)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

const EXAMPLES: &str = "\
Examples:
  Blur a shipped frame and look at it:
    pullfocus demo
  See what is in a file, and which command to go on with:
    pullfocus inspect frame.exr
  Blur it, and see where it is sharp:
    pullfocus render frame.exr -o out.exr --focus-distance 2.5 --f-stop 2.8
    pullfocus coc frame.exr -o coc.png --focus-distance 2.5 --f-stop 2.8
  Take a focus pull to another program:
    pullfocus camera pull.toml -o pull.usda
  See how far two pictures are apart:
    pullfocus compare out.exr reference.exr -o difference.png
  See which devices there are to render on:
    pullfocus devices

Exit codes: 0 done, 1 failed, 2 asked for something that cannot be.";

const RENDER_EXAMPLES: &str = "\
Examples:
  One frame; what is not given comes from the file's camera attributes:
    pullfocus render frame.exr -o out.exr --focus-distance 2.5 --f-stop 2.8
  A camera as photographers give it, and as renderers do:
    pullfocus render frame.exr -o out.exr --focus-distance 2.5 --f-stop 2.8 \\
        --focal-length 50 --sensor-width 36
    pullfocus render frame.exr -o out.exr --focus-distance 2.5 --fov-x 40 \\
        --aperture-diameter 0.018
  A sequence, every second frame, that may be killed and continued:
    pullfocus render 'in/shot.####.exr' -o 'out/shot.####.exr' \\
        --frames 1001-1100x2 --resume --focus-distance 2.5 --f-stop 2.8
  Near objects and what is behind them, as two renders:
    pullfocus render frame.exr --foreground near.exr --behind far.exr \\
        -o out.exr --focus-distance 6 --f-stop 2
  A photograph with a learned disparity map:
    pullfocus render photo.jpg --depth-file map.png -o portrait.png \\
        --depth disparity --depth-scale 0.8 --depth-shift 0.1 \\
        --focus-distance 1.2 --f-stop 1.8 --focal-length 26 --sensor-width 36
  Quickly, to find the focus:
    pullfocus render frame.exr -o try.png --preset preview \\
        --focus-distance 2.5 --f-stop 2.8
  Everything from a settings file, with one thing changed:
    pullfocus render frame.exr -o out.exr --config shot.toml --f-stop 4

A settings file has the long names as keys: focus-distance = 2.5,
preset = \"preview\", protect = [2.3, 2.8], resume = true. Relative paths in it
(input, output, depth-file, ...) count from the file's folder. A focus pull has
keys:

    [[key]]
    frame = 1001
    focus-distance = 2.5     # f-stop, focal-length; what is left out goes on
    easing = \"smooth\"       # or hold, linear, in, out: to the next key

    pullfocus render 'in/shot.####.exr' -o 'out/shot.####.exr' \\
        --shot pull.toml

One picture is held still under the moving lens, from the first key to the last
or for the frames that are named:

    pullfocus render still.exr -o 'out/still.####.exr' --shot pull.toml
    pullfocus render still.exr -o 'out/still.####.exr' --shot pull.toml \\
        --frames 1-48";

const COC_EXAMPLES: &str = "\
Front is red, in focus green, behind blue; the colour is full where the
diameter reaches --coc-range. An OpenEXR output holds the signed diameter in
pixels as the channel 'coc' (positive behind focus).

Examples:
  pullfocus coc frame.exr -o coc.png --focus-distance 2.5 --f-stop 2.8
  pullfocus coc frame.exr -o coc.exr --focus-distance 2.5 --f-stop 2.8
  pullfocus render coc.exr -o out.exr --coc-channel coc";

const CAMERA_EXAMPLES: &str = "\
A table has a line for each frame: focus distance, f-stop, focal length, sensor
width, field of view, aperture diameter, and from where to where it is sharp
(--sharp). A USD layer has one camera, in centimetres and millimetres, with
values at each frame. What the keys leave out is the shot's, the command line's,
or what each frame's own file says; a frame without a file has the lens of the
one before, and before the first file that of the first.

Examples:
  pullfocus camera pull.toml -o pull.csv
  pullfocus camera pull.toml -o pull.usda --frames 1001-1100 --fps 25
  pullfocus camera pull.toml -o pull.usda --focal-length 50 --sensor-width 36";

const INSPECT_EXAMPLES: &str = "\
Examples:
  pullfocus inspect frame.exr
  pullfocus inspect --json shot/*.exr";

const COMPARE_EXAMPLES: &str = "\
Linear files (OpenEXR, HDR, PFM) are shown as sRGB, clipped to 0..1, before
they are compared. PSNR in dB and SSIM: more is more alike. FLIP: the
difference that people see when they switch between the two, 0 to 1: less is
more alike.

Examples:
  pullfocus compare out.exr reference.exr
  pullfocus compare a.png b.png -o difference.png --json";

const DEMO_EXAMPLES: &str = "\
Examples:
  pullfocus demo
  pullfocus demo -o look --preset preview";

const VIEW_EXAMPLES: &str = "\
Click on the picture to focus there, drag to rack, wheel to zoom, F1 for the
keys. Without IN the last session comes back. The environment variable OCIO
names the colour config whose views are offered beside sRGB.

Examples:
  pullfocus view frame.exr
  pullfocus view shot/                     # a folder: its longest sequence
  pullfocus view 'in/shot.####.exr'
  pullfocus view pull.toml                 # a shot that was saved
  pullfocus view photo.jpg --depth-file map.png --depth disparity \\
      --depth-scale 0.8 --depth-shift 0.1";

const DEVICES_EXAMPLES: &str = "\
A software driver computes on the processor: it is slower than the CPU itself,
and taken only by its name.

Examples:
  pullfocus devices
  pullfocus devices --json
  pullfocus render frame.exr -o out.exr --device gpu:radeon \\
      --focus-distance 2.5 --f-stop 2.8";

const BENCH_EXAMPLES: &str = "\
The copy reads and writes the bytes that one diffusion must touch; small sizes
are copied within the processor's cache, large ones in memory.

Examples:
  pullfocus bench
  pullfocus bench --size 3840x2160 --threads 4 --json";

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Blur a picture or a sequence as a lens would
    #[command(after_help = RENDER_EXAMPLES)]
    Render(Box<RenderArgs>),
    /// Write the circle of confusion, as a picture or as a channel
    #[command(after_help = COC_EXAMPLES)]
    Coc(Box<CocArgs>),
    /// Write a shot's lens, frame by frame: a table or a USD camera
    #[command(after_help = CAMERA_EXAMPLES)]
    Camera(Box<CameraArgs>),
    /// Tell what is in a file: parts, channels, depth, camera
    #[command(after_help = INSPECT_EXAMPLES)]
    Inspect(InspectArgs),
    /// Tell how far apart two pictures are: PSNR, SSIM, FLIP
    #[command(after_help = COMPARE_EXAMPLES)]
    Compare(CompareArgs),
    /// Blur a shipped frame at three focus distances and two f-stops
    #[command(after_help = DEMO_EXAMPLES)]
    Demo(DemoArgs),
    /// List the devices that can render: the CPU and every GPU
    #[command(after_help = DEVICES_EXAMPLES)]
    Devices(DevicesArgs),
    /// Measure how fast this machine is
    #[command(after_help = BENCH_EXAMPLES)]
    Bench(BenchArgs),
    /// Pull focus on the picture, live, in a window
    #[command(after_help = VIEW_EXAMPLES)]
    View(Box<ViewArgs>),
    /// Write completions for a shell
    #[command(
        after_help = "Example:\n  pullfocus completions bash \\\n      > ~/.local/share/bash-completion/completions/pullfocus"
    )]
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}

/// Arguments of `render`.
#[derive(Debug, Args)]
pub struct RenderArgs {
    /// Which files.
    #[command(flatten)]
    pub files: Files,
    /// The lens.
    #[command(flatten)]
    pub lens: Lens,
    /// Depth.
    #[command(flatten)]
    pub depth: Depth,
    /// The circle of confusion.
    #[command(flatten)]
    pub circle: Circle,
    /// The blur.
    #[command(flatten)]
    pub blur: Blur,
    /// Running.
    #[command(flatten)]
    pub run: Run,
    /// Settings file (TOML), which may hold the keys of a focus pull; options on the command line lie over it. Its paths
    /// count from its own folder.
    #[arg(long, visible_alias = "shot", value_name = "FILE.toml", help_heading = "Running")]
    pub config: Option<PathBuf>,
}

impl RenderArgs {
    /// The options, and the settings file under them.
    pub fn split(self) -> (Options, Option<PathBuf>) {
        let Self { files, lens, depth, circle, blur, run, config } = self;
        (
            Options {
                files,
                lens,
                depth,
                circle,
                blur,
                run,
                view: CocView::default(),
                keys: Pull::default(),
            },
            config,
        )
    }
}

/// Arguments of `coc`.
#[derive(Debug, Args)]
pub struct CocArgs {
    /// Which files.
    #[command(flatten)]
    pub files: Files,
    /// The lens.
    #[command(flatten)]
    pub lens: Lens,
    /// Depth.
    #[command(flatten)]
    pub depth: Depth,
    /// The circle of confusion.
    #[command(flatten)]
    pub circle: Circle,
    /// The picture of it.
    #[command(flatten)]
    pub view: CocView,
    /// Running.
    #[command(flatten)]
    pub run: Run,
    /// Settings file (TOML), the same as for render; options on the command line lie over it. Its paths count from its own
    /// folder.
    #[arg(long, visible_alias = "shot", value_name = "FILE.toml", help_heading = "Running")]
    pub config: Option<PathBuf>,
}

impl CocArgs {
    /// The options, and the settings file under them.
    pub fn split(self) -> (Options, Option<PathBuf>) {
        let Self { files, lens, depth, circle, view, run, config } = self;
        (
            Options { files, lens, depth, circle, view, run, blur: Blur::default(), keys: Pull::default() },
            config,
        )
    }
}

/// Arguments of `view`.
#[derive(Debug, Args)]
pub struct ViewArgs {
    /// Picture, sequence, folder or shot to open.
    #[command(flatten)]
    pub files: Files,
    /// The lens.
    #[command(flatten)]
    pub lens: Lens,
    /// Depth.
    #[command(flatten)]
    pub depth: Depth,
    /// The circle of confusion.
    #[command(flatten)]
    pub circle: Circle,
    /// The blur.
    #[command(flatten)]
    pub blur: Blur,
    /// Forget the last session and keep none
    #[arg(long, help_heading = "Running")]
    pub no_session: bool,
}

/// Arguments of `camera`.
#[derive(Debug, Args)]
pub struct CameraArgs {
    /// Settings file (TOML), with or without keys
    #[arg(value_name = "SHOT.toml")]
    pub shot: PathBuf,
    /// File to write: .csv (a table) or .usda (a USD layer)
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Which frames; those of the shot and its pictures, or from its first key to its last, if not given
    #[arg(long, value_name = "RANGE", allow_hyphen_values = true)]
    pub frames: Option<String>,
    /// Frames per second of a USD layer
    #[arg(long, value_name = "N", default_value_t = 24.0, allow_negative_numbers = true)]
    pub fps: f64,
    /// Largest circle of confusion that still counts as sharp: pixels (2) or a part of the width; 0.08% is a 1500th of a
    /// full-frame sensor's diagonal
    #[arg(long, value_name = "SIZE", default_value = "0.08%")]
    pub sharp: Largest,
    /// The lens
    #[command(flatten)]
    pub lens: Lens,
    /// Lift the limits on what a file may ask for, for files that one trusts
    #[arg(long)]
    pub allow_large_files: bool,
    /// Replace OUT if it is already there
    #[arg(long)]
    pub overwrite: bool,
    /// One JSON document on standard output, for machines
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `inspect`.
#[derive(Debug, Args)]
pub struct InspectArgs {
    /// Files to look into
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Lift the limits on what a file may ask for, for files that one trusts
    #[arg(long)]
    pub allow_large_files: bool,
    /// One JSON document on standard output, for machines
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// A picture
    pub a: PathBuf,
    /// The picture to compare it with (the reference)
    pub b: PathBuf,
    /// Write the difference as a picture (FLIP's error map)
    #[arg(short, long, value_name = "DIFF.png")]
    pub output: Option<PathBuf>,
    /// Lift the limits on what a file may ask for, for files that one trusts
    #[arg(long)]
    pub allow_large_files: bool,
    /// Replace DIFF.png if it is already there
    #[arg(long)]
    pub overwrite: bool,
    /// One JSON document on standard output, for machines
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `demo`.
#[derive(Debug, Args)]
pub struct DemoArgs {
    /// Directory for the results; what an earlier demo wrote there is replaced
    #[arg(short, long, value_name = "DIR", default_value = "pullfocus-demo")]
    pub output: PathBuf,
    /// Replace files of the same names that are not the demo's own
    #[arg(long)]
    pub overwrite: bool,
    /// Settings by name
    #[arg(long, value_name = "NAME", default_value = "final")]
    pub preset: pullfocus_job::options::PresetName,
    /// What renders: auto, cpu, gpu, or gpu:NAME with a part of the GPU's name
    #[arg(long, value_name = "DEVICE", default_value = "auto")]
    pub device: DeviceChoice,
    /// Number of threads; all processors by default
    #[arg(long, value_name = "N")]
    pub threads: Option<u32>,
    /// One JSON document on standard output, for machines
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `devices`.
#[derive(Debug, Args)]
pub struct DevicesArgs {
    /// One JSON document on standard output, for machines
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `bench`.
#[derive(Debug, Args)]
pub struct BenchArgs {
    /// Sizes to measure
    #[arg(long, value_name = "WxH", value_delimiter = ',', default_value = "512x512,1024x1024,1920x1080")]
    pub size: Vec<BenchSize>,
    /// Least time spent on each figure, in seconds
    #[arg(long, value_name = "S", default_value_t = 0.5)]
    pub seconds: f64,
    /// Number of threads; all processors by default
    #[arg(long, value_name = "N")]
    pub threads: Option<u32>,
    /// One JSON document on standard output, for machines
    #[arg(long)]
    pub json: bool,
}
