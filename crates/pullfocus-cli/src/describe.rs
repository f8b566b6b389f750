//! What is in an OpenEXR file, in lines for people, and the command to go on with.

use pullfocus_io::exr::{Contents, DepthContents, PartContents, WindowContents};
use pullfocus_io::{Found, FoundCamera};
use pullfocus_job::storage::{COC_ATTRIBUTE, COC_CHANNEL};
use std::path::Path;

/// The lines.
pub fn lines(contents: &Contents) -> Vec<String> {
    let mut lines = Vec::new();
    let parts = contents.parts.len();
    lines.push(format!("{}: OpenEXR, {}", contents.file, count(parts, "part")));
    if !contents.views.is_empty() {
        lines.push(format!("  views: {} (choose with --view)", contents.views.join(", ")));
    }
    for (index, part) in contents.parts.iter().enumerate() {
        describe_part(index, part, &mut lines);
    }
    if contents.parts.iter().all(is_deep) {
        lines.push("  deep pictures are not supported yet; render the scene flat, with depth".into());
        return lines;
    }
    match &contents.beauty {
        Some(beauty) => lines.push(format!("  picture: {beauty}")),
        None if is_depth_alone(contents) => {
            lines.push("  picture: none; it is depth for another file".into())
        }
        None => lines.push("  picture: none found; choose layers with --channels".into()),
    }
    match &contents.depth_channel {
        Some(channel) => lines.push(format!("  depth: {channel}")),
        None => lines.push(
            "  depth: none found; choose a channel with --depth-channel or a file with --depth-file".into(),
        ),
    }
    for depth in &contents.depth {
        lines.push(format!("    {}", describe_depth(depth)));
    }
    describe_camera(&contents.camera, &mut lines);
    lines
}

fn count(number: usize, what: &str) -> String {
    if number == 1 { format!("1 {what}") } else { format!("{number} {what}s") }
}

fn window(window: &WindowContents) -> String {
    let WindowContents { x, y, width, height } = window;
    if (*x, *y) == (0, 0) { format!("{width} x {height}") } else { format!("{width} x {height} at {x}, {y}") }
}

fn describe_part(index: usize, part: &PartContents, lines: &mut Vec<String>) {
    let name = part.name.as_ref().map_or(String::new(), |name| format!(" '{name}'"));
    let view = part.view.as_ref().map_or(String::new(), |view| format!(", view {view}"));
    let tiles = part.tile_size.map_or(String::new(), |[w, h]| format!(" of {w} x {h}, {}", part.levels));
    let lossy = if part.lossy { " (lossy)" } else { "" };
    lines.push(format!(
        "  part {index}{name}{view}: {}{tiles}, compression {}{lossy}, {}{}{}",
        part.kind,
        part.compression,
        window(&part.data_window),
        if part.data_window == part.display_window {
            String::new()
        } else {
            format!(" of a frame of {}", window(&part.display_window))
        },
        if part.pixel_aspect == 1.0 {
            String::new()
        } else {
            format!(", pixel aspect {}", part.pixel_aspect)
        },
    ));
    for layer in &part.layers {
        let channels: Vec<String> = layer
            .channels
            .iter()
            .map(|channel| {
                let base = channel.name.rsplit('.').next().unwrap_or_default();
                let kind = format!("{:?}", channel.sample_type).to_lowercase();
                let [across, down] = channel.sampling;
                if (across, down) == (1, 1) {
                    format!("{base} {kind}")
                } else {
                    format!("{base} {kind} (every {across} x {down} pixels)")
                }
            })
            .collect();
        let name = if layer.name.is_empty() { "rgba" } else { &layer.name };
        let view = layer.view.as_ref().map_or(String::new(), |view| format!(" ({view})"));
        lines.push(format!("    {name}{view}: {}", channels.join(", ")));
    }
}

fn describe_depth(depth: &DepthContents) -> String {
    let range = match (depth.min, depth.max, depth.median) {
        (Some(min), Some(max), Some(median)) => {
            format!("{} to {}, half below {}", short(min), short(max), short(median))
        }
        _ => "no value where something is".into(),
    };
    format!("{}: {range}; {:.1} % nothing there; {}", depth.channel, 100.0 * depth.nothing, depth.convention)
}

/// Four digits are enough to recognise a number by.
fn short(value: f32) -> String {
    format!("{value:.3e}").parse::<f32>().unwrap_or(value).to_string()
}

fn describe_camera(camera: &FoundCamera, lines: &mut Vec<String>) {
    let mut values = Vec::new();
    let mut add = |name: &str, found: &Option<Found>, unit: &str| {
        if let Some(found) = found {
            values.push(format!("{name} {}{unit} ({})", short(found.value as f32), found.attribute));
        }
    };
    add("focus distance", &camera.focus_distance_m, " m");
    add("f-stop", &camera.f_stop, "");
    add("focal length", &camera.focal_length_mm, " mm");
    add("sensor width", &camera.sensor_width_mm, " mm");
    add("field of view", &camera.fov_x_degrees, " degrees");
    add("far clip", &camera.far_clip, " units of depth");
    add("metres per unit of depth", &camera.depth_unit_m, "");
    if values.is_empty() {
        lines.push("  camera: nothing found".into());
    } else {
        lines.push(format!("  camera: {}", values.join(", ")));
    }
    lines.extend(camera.notes.iter().map(|note| format!("    note: {note}")));
}

/// The command to go on with: flags for what the file does not say, with likely values to change. None for
/// files that cannot be rendered.
pub fn suggestion(path: &Path, contents: &Contents) -> Option<String> {
    if contents.parts.iter().all(is_deep) {
        return None;
    }
    let mut words = vec!["pullfocus render".to_owned()];
    let (file, stem) = (quoted(&path.display().to_string()), path.file_stem().unwrap_or_default());
    if is_depth_alone(contents) {
        words.push(format!("PICTURE.exr --depth-file {file} -o PICTURE_blurred.exr"));
    } else {
        words.push(format!("{file} -o {}", quoted(&format!("{}_blurred.exr", stem.to_string_lossy()))));
        if contents.beauty.is_none() {
            words.push("--channels LAYER".into());
        }
    }
    if holds_coc(contents) {
        words.push(format!("--coc-channel {COC_CHANNEL}"));
        return Some(words.join(" "));
    }
    let chosen = contents.depth_channel.as_ref();
    let depth = contents.depth.iter().find(|depth| Some(&depth.channel) == chosen);
    if chosen.is_none() {
        words.push("--depth-channel NAME".into());
    }
    let argument = depth.and_then(|depth| argument_in(&depth.convention));
    let planar = argument.as_ref().is_none_or(|argument| argument.starts_with("--depth planar"));
    words.extend(argument.filter(|argument| argument != "--depth planar"));
    let camera = &contents.camera;
    if camera.focus_distance_m.is_none() {
        let unit = camera.depth_unit_m.as_ref().map_or(1.0, |unit| unit.value as f32);
        let metres = depth.and_then(|depth| depth.median).filter(|_| planar).map(|median| {
            // Two digits: a place to start from.
            format!("{:.1e}", (median * unit).abs()).parse::<f32>().unwrap_or(median).to_string()
        });
        words.push(format!("--focus-distance {}", metres.unwrap_or_else(|| "M".into())));
    }
    if camera.f_stop.is_none() {
        words.push("--f-stop 2.8".into());
    }
    if camera.fov_x_degrees.is_none() && camera.focal_length_mm.is_none() {
        words.push("--focal-length 35".into());
    }
    if camera.sensor_width_mm.is_none() {
        words.push("--sensor-width 36".into());
    }
    Some(words.join(" "))
}

/// Whether the file holds depth and no picture.
fn is_depth_alone(contents: &Contents) -> bool {
    contents.beauty.is_none() && contents.depth_channel.is_some()
}

/// Whether `pullfocus coc` wrote this: circles of confusion take the place of depth and lens.
fn holds_coc(contents: &Contents) -> bool {
    contents.parts.iter().any(|part| {
        part.attributes.iter().any(|attribute| attribute.name == COC_ATTRIBUTE)
            && part.layers.iter().flat_map(|layer| &layer.channels).any(|channel| channel.name == COC_CHANNEL)
    })
}

fn is_deep(part: &PartContents) -> bool {
    part.kind.starts_with("deep")
}

/// The command for a picture without depth of its own.
pub fn image_suggestion(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    format!(
        "pullfocus render {} --depth-file DEPTH.png --depth disparity --depth-scale 1 -o {} --focus-distance 2 --f-stop 2.8 --focal-length 35 --sensor-width 36",
        quoted(&path.display().to_string()),
        quoted(&format!("{stem}_blurred.png")),
    )
}

/// The first argument named in the description of a convention, such as `--depth ray`, made whole.
fn argument_in(convention: &str) -> Option<String> {
    let text = &convention[convention.find("--depth")?..];
    let text = text.split([',', ';', ')', '(']).next()?;
    let mut words: Vec<&str> = Vec::new();
    for word in text.split_whitespace() {
        // A flag, or the value right after one.
        if word.starts_with("--") || words.last().is_some_and(|last| last.starts_with("--")) {
            words.push(word);
        } else {
            break;
        }
    }
    let argument = words.join(" ");
    Some(match argument.as_str() {
        "--depth normalized" => format!("{argument} --depth-near M --depth-far M"),
        "--depth disparity" => format!("{argument} --depth-scale S --depth-shift S"),
        _ => argument,
    })
}

/// As a shell of this system takes it for one word.
pub fn quoted(text: &str) -> String {
    if cfg!(windows) { quoted_for_windows(text) } else { quoted_for_unix(text) }
}

fn quoted_for_unix(text: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "/._-+:@%=".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

/// `cmd.exe` hands single quotes on as they are. No file's name has a double quote there.
fn quoted_for_windows(text: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || r"\/._-+:@".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        return text.to_owned();
    }
    // Backslashes before the closing quote would take its meaning away.
    let last = text.len() - text.trim_end_matches('\\').len();
    format!("\"{text}{}\"", r"\".repeat(last))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_survive_a_shell() {
        assert_eq!(quoted_for_unix("a/b_1.exr"), "a/b_1.exr");
        assert_eq!(quoted_for_unix("it's #1.exr"), r"'it'\''s #1.exr'");
        assert_eq!(quoted_for_unix(r"a\b"), r"'a\b'");
        assert_eq!(quoted_for_unix(""), "''");
        assert_eq!(quoted_for_windows(r"C:\shot\b_1.exr"), r"C:\shot\b_1.exr");
        assert_eq!(quoted_for_windows(r"C:\my shot\it's.exr"), r#""C:\my shot\it's.exr""#);
        assert_eq!(quoted_for_windows("a&b.exr"), "\"a&b.exr\"");
        assert_eq!(quoted_for_windows(r"D:\my shot\"), r#""D:\my shot\\""#);
        assert_eq!(quoted_for_windows(""), "\"\"");
    }

    #[test]
    fn the_argument_is_taken_out_of_the_sentence() {
        let argument = |text| argument_in(text).unwrap();
        assert_eq!(
            argument("as Unreal writes it (--depth planar --depth-unit 0.01)"),
            "--depth planar --depth-unit 0.01"
        );
        assert_eq!(argument("units of the scene (--depth planar, with --depth-unit where"), "--depth planar");
        assert_eq!(
            argument("normalised (--depth normalized with near and far), 1/z"),
            "--depth normalized --depth-near M --depth-far M"
        );
        assert_eq!(argument_in("nothing is there"), None);
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!(short(0.746_792_6), "0.7468");
        assert_eq!(short(1e10), "10000000000");
    }
}
