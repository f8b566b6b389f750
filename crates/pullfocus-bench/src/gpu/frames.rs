//! Whole frames from textures to a texture.

use super::session::{Measured, Session, ms, storage_name};
use super::solvers::CIRCLES;
use crate::speed::cases::{last, last_by_diffusion, lens, lights, named, preview, scene};
use crate::table::Table;
use anyhow::Result;
use pullfocus::{Bokeh, Scene, Settings, Size};
use pullfocus_gpu::Storage;

/// What a frame needs at 50 px, and its time for each of the circles.
pub struct Frame {
    pub seconds: [f64; 3],
    pub stages: Vec<(String, f64)>,
    pub bytes: u64,
}

impl Frame {
    fn spread(&self) -> f64 {
        let (low, high) = self.seconds.iter().fold((f64::MAX, 0.0f64), |(l, h), &s| (l.min(s), h.max(s)));
        high / low
    }
}

/// A row.
pub struct Row {
    pub size: Size,
    pub what: &'static str,
    pub storage: Storage,
    pub frame: Measured<Frame>,
}

/// The papers' three layers, by name.
pub const THREE: &str = "three layers, backward Euler";
/// The default settings, by name.
pub const FINAL: &str = "`final`";
/// The same layers by diffusion, by name.
pub const BY_DIFFUSION: &str = "general layers, diffusion";

/// One layer with a highlight in every twentieth pixel, by name.
pub const LIGHTS: &str = "one layer, highlights";

/// Settings, and the scene of a size that they are for.
type Asked = (&'static str, Settings, fn(Size) -> Scene);

fn settings() -> [Asked; 6] {
    let plain: fn(Size) -> Scene = |size| scene(size, false);
    let single = named().swap_remove(0);
    let lit = Settings { bokeh: Some(Bokeh::default()), ..single.1.clone() };
    [
        (single.0, single.1, plain),
        ("`preview`", preview(), plain),
        (THREE, preview(), |size| scene(size, true)),
        (BY_DIFFUSION, last_by_diffusion(), plain),
        (FINAL, last(), plain),
        (LIGHTS, lit, lights),
    ]
}

/// All rows.
pub fn measure(session: &mut Session) -> Result<Vec<Row>> {
    let mut rows = vec![];
    // A size for software devices, which take minutes for the others.
    let small = session.software.then_some((480, 270));
    for (width, height) in small.into_iter().chain([(1024, 768), (1920, 1080), (3840, 2160)]) {
        let size = session.size(width, height);
        for (what, settings, scene) in settings() {
            for storage in [Storage::Full, Storage::Half] {
                let frame = one(session, (what, &settings, scene), size, storage)?;
                rows.push(Row { size, what, storage, frame });
            }
        }
    }
    Ok(rows)
}

fn one(
    session: &mut Session,
    (what, settings, scene): (&str, &Settings, fn(Size) -> Scene),
    size: Size,
    storage: Storage,
) -> Result<Measured<Frame>> {
    if let Err(why) = session.may(size) {
        return Ok(Err(why));
    }
    let scene = scene(size);
    let mut frame = Frame { seconds: [0.0; 3], stages: vec![], bytes: 0 };
    for (i, largest) in CIRCLES.into_iter().enumerate() {
        let camera = lens(size, largest)?;
        let label = format!("{what} frame {storage:?}");
        let timed = session
            .frame(&label, size, storage, |host, n| host.time_frame(&scene, Some(&camera), settings, n))?;
        let (seconds, timing, bytes) = match timed {
            Ok(timed) => timed,
            Err(why) => return Ok(Err(why)),
        };
        frame.seconds[i] = seconds;
        if i == 1 {
            let stages = timing.stages.iter().map(|(name, time)| ((*name).to_owned(), time.as_secs_f64()));
            frame.stages = stages.collect();
            frame.bytes = bytes;
        }
    }
    Ok(Ok(frame))
}

/// Seconds at 50 px of a row of 3840 x 2160 in f16.
pub fn seconds_4k(rows: &[Row], what: &str) -> Option<f64> {
    let wanted =
        |row: &&Row| row.what == what && row.storage == Storage::Half && row.size == Size::new(3840, 2160);
    rows.iter().find(wanted)?.frame.as_ref().ok().map(|frame| frame.seconds[1])
}

/// Seconds for the highlights of 50 px alone, in a row of 1920 x 1080 in f16.
pub fn seconds_of_lights(rows: &[Row]) -> Option<f64> {
    let wanted =
        |row: &&Row| row.what == LIGHTS && row.storage == Storage::Half && row.size == Size::new(1920, 1080);
    let frame = rows.iter().find(wanted)?.frame.as_ref().ok()?;
    frame.stages.iter().find(|(name, _)| name == "highlights").map(|(_, seconds)| *seconds)
}

/// The largest spread over the circles of all frames with these settings.
pub fn worst_spread(rows: &[Row], settings: impl Fn(&str) -> bool) -> Option<f64> {
    rows.iter()
        .filter(|row| settings(row.what))
        .filter_map(|row| row.frame.as_ref().ok())
        .map(Frame::spread)
        .reduce(f64::max)
}

/// The section.
pub fn section(rows: &[Row]) -> String {
    let mut table = Table::new([
        "picture",
        "settings",
        "storage",
        "5 px, ms",
        "50 px, ms",
        "500 px, ms",
        "largest over smallest",
        "frames/s",
        "device memory, MiB",
        "stages at 50 px, ms",
    ]);
    for row in rows {
        let head = [row.size.to_string(), row.what.to_owned(), storage_name(row.storage).to_owned()];
        let cells = match &row.frame {
            Ok(frame) => {
                let stages = frame.stages.iter().map(|(name, time)| format!("{name} {}", ms(*time)));
                let [a, b, c] = frame.seconds.map(ms);
                vec![
                    a,
                    b,
                    c,
                    format!("{:.2}", frame.spread()),
                    format!("{:.0}", 1.0 / frame.seconds[1]),
                    format!("{:.0}", frame.bytes as f64 / 1048576.0),
                    stages.collect::<Vec<_>>().join(", "),
                ]
            }
            Err(why) => std::iter::once(why.clone()).chain(vec![String::new(); 6]).collect(),
        };
        table.row(head.into_iter().chain(cells));
    }
    format!(
        "## Whole frames\n\nAs an engine would have them recorded: from a colour and a depth texture to a texture (f32 or f16 as the storage), circles of\n\
         confusion from depth included; three colour planes. `preview` is the first paper's midground and background, *three layers* have its\n\
         foreground on top (colour and alpha), each with its fills. *Highlights* are every twentieth pixel, all of one size. Frames/s are those at 50 px. Memory is the buffers', without the textures.\n\n{}\n",
        table.to_markdown()
    )
}

/// A row beside the first paper.
pub struct Beside {
    pub size: Size,
    pub layers: &'static str,
    pub theirs: &'static str,
    /// Seconds in f32 and f16.
    pub seconds: [Measured<f64>; 2],
}

/// The first paper's section 5.1.
pub fn measure_beside(session: &mut Session) -> Result<Vec<Beside>> {
    let mut rows = vec![];
    for (width, height, layered, theirs) in [
        (256, 256, false, "80-90"),
        (512, 512, false, "21-23"),
        (1024, 1024, false, "6-7"),
        (1024, 768, true, "3-4"),
    ] {
        let size = session.size(width, height);
        let (scene, camera) = (scene(size, layered), lens(size, 40.0)?);
        let mut seconds = [Ok(0.0), Ok(0.0)];
        for (seconds, storage) in seconds.iter_mut().zip([Storage::Full, Storage::Half]) {
            let label = format!("beside {layered} {storage:?}");
            let run = session.frame(&label, size, storage, |host, n| {
                host.time_frame(&scene, Some(&camera), &preview(), n)
            })?;
            *seconds = run.map(|(seconds, ..)| seconds);
        }
        let layers = if layered { "three layers" } else { "two layers" };
        rows.push(Beside { size, layers, theirs, seconds });
    }
    Ok(rows)
}

/// The section beside the first paper.
pub fn beside_section(rows: &[Beside]) -> String {
    let mut table = Table::new([
        "picture",
        "first paper (GeForce 7800), frames/s",
        "here in f32, frames/s",
        "here in f16, frames/s",
    ]);
    for row in rows {
        let here = row.seconds.iter().map(|seconds| match seconds {
            Ok(seconds) => format!("{:.0}", 1.0 / seconds),
            Err(why) => why.clone(),
        });
        let head = [format!("{}, {}", row.size, row.layers), row.theirs.to_owned()];
        table.row(head.into_iter().chain(here));
    }
    format!(
        "## Beside the first paper\n\nIts section 5.1, by `preview`; largest circle 40 px. [speed.md](speed.md) has the same on the CPU.\n\n{}\n",
        table.to_markdown()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(size: Size, storage: Storage, seconds: [f64; 3]) -> Row {
        let frame = Frame { seconds, stages: vec![("blur".into(), 0.001)], bytes: 10 << 20 };
        Row { size, what: THREE, storage, frame: Ok(frame) }
    }

    #[test]
    fn the_table_and_the_targets_figures() {
        let large = Size::new(3840, 2160);
        let mut rows = vec![
            row(large, Storage::Full, [0.002, 0.002, 0.002]),
            row(large, Storage::Half, [0.0015, 0.0016, 0.0015]),
        ];
        assert_eq!(seconds_4k(&rows, THREE), Some(0.0016));
        assert_eq!(seconds_4k(&rows, FINAL), None);
        assert_eq!(seconds_of_lights(&rows), None);
        let stages = vec![("highlights".into(), 0.0017), ("blur".into(), 0.0003)];
        let lit = Frame { seconds: [0.001, 0.002, 0.02], stages, bytes: 1 };
        let size = Size::new(1920, 1080);
        rows.push(Row { size, what: LIGHTS, storage: Storage::Half, frame: Ok(lit) });
        assert_eq!(seconds_of_lights(&rows), Some(0.0017));
        assert!((worst_spread(&rows, |what| what == THREE).unwrap() - 16.0 / 15.0).abs() < 1e-12);
        rows.push(Row { frame: Err("did not fit: y".into()), ..row(large, Storage::Full, [1.0; 3]) });
        let text = section(&rows);
        assert!(text.contains("| f16 | 1.50 | 1.60 | 1.50 | 1.07 | 625 | 10 | blur 1.00 |"), "{text}");
        assert!(text.contains("did not fit: y"), "{text}");
    }

    #[test]
    fn frames_per_second_stand_beside_the_paper_s() {
        let seconds = [Ok(0.01), Err("left out".to_owned())];
        let row = Beside { size: Size::new(9, 9), layers: "two layers", theirs: "3-4", seconds };
        let text = beside_section(&[row]);
        assert!(text.contains("| 9 x 9, two layers | 3-4 | 100 | left out |"), "{text}");
    }
}
