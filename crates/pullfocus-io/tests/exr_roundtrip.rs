//! What is not blurred comes out as it went in; what is blurred goes back into its own channel and type.

mod common;

use common::*;
use exr::math::RoundingMode;
use exr::prelude::*;
use pullfocus_io::{AttributeValue as Ours, Document, Limits, SampleType as Type, Selection, write_exr};
use std::io::Cursor;

const W: usize = 67;
// A multiple of 4: the crate's B44 encoder, used here to make files, cannot write flatter remainders.
const H: usize = 44;

fn change(value: f32) -> f32 {
    value * 0.5 + 0.125
}

/// Colours in one type, everything else in all of them.
fn channels(colour: fn(&str, usize, usize) -> Channel) -> Vec<Channel> {
    let n = W * H;
    vec![
        colour("R", n, 1),
        colour("G", n, 2),
        colour("B", n, 3),
        colour("A", n, 4),
        odd_float("Z", n),
        uint("objectid", n, 6),
        half("normal.X", n, 7),
        half("normal.Y", n, 8),
        half("normal.Z", n, 9),
        float("position.X", n, 10),
    ]
}

fn expected(samples: &FlatSamples) -> Vec<u32> {
    match samples {
        FlatSamples::F16(v) => {
            v.iter().map(|v| u32::from(f16::from_f32(change(v.to_f32())).to_bits())).collect()
        }
        FlatSamples::F32(v) => v.iter().map(|&v| change(v).to_bits()).collect(),
        FlatSamples::U32(v) => v.iter().map(|&v| change(v as f32).round() as u32).collect(),
    }
}

fn check(bytes: &[u8], compression: Compression) {
    let document = document(bytes);
    let selected = select(&document, &[]);
    assert_eq!(selected.picture.colors.len(), 3);
    assert_eq!(selected.depth.as_ref().unwrap().name, "Z");
    let out = rewritten(&document, selected, change);
    let changed = [(0, "R"), (0, "G"), (0, "B"), (0, "A")];
    let after = same_but(bytes, &out, &changed);
    let before = decoded(bytes);
    for (_, name) in changed {
        assert_eq!(bits(channel(&after, 0, name)), expected(channel(&before, 0, name)), "{name}");
    }
    let keeps = matches!(
        compression,
        Compression::Uncompressed
            | Compression::RLE
            | Compression::ZIP1
            | Compression::ZIP16
            | Compression::PIZ
    );
    let found = after.layer_data[0].encoding.compression;
    assert_eq!(found, if keeps { compression } else { Compression::ZIP16 });
}

#[test]
fn every_compression_block_shape_and_sample_type() {
    for compression in [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::B44A,
        Compression::DWAA(None),
        Compression::DWAB(Some(20.0)),
    ] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(16, 24)), Blocks::Tiles(Vec2(100, 8))] {
            for colour in [half, float, uint] {
                let part = part((W, H), (0, 0), encoding(compression, blocks), channels(colour));
                check(&file((W, H), vec![part]), compression);
            }
        }
    }
}

#[test]
fn every_line_order_and_window() {
    for line_order in [LineOrder::Increasing, LineOrder::Decreasing] {
        for compression in [Compression::ZIP1, Compression::PIZ, Compression::DWAB(None)] {
            for (at, display) in [((5, 7), (100, 80)), ((-9, -4), (20, 20)), ((200, 300), (64, 64))] {
                let encoding = Encoding { line_order, ..scan_lines(compression) };
                let bytes = file(display, vec![part((W, H), at, encoding, channels(half))]);
                let selected = select(&document(&bytes), &[]);
                assert_eq!((selected.frame.data.x, selected.frame.data.y), at);
                assert_eq!(selected.frame.display.size.width, display.0);
                check(&bytes, compression);
            }
        }
    }
}

#[test]
fn all_levels_are_kept_and_blurred_ones_follow_the_largest() {
    for rip in [false, true] {
        for rounding_mode in [RoundingMode::Down, RoundingMode::Up] {
            let bytes = with_levels(rip, rounding_mode);
            let document = document(&bytes);
            let selected = select(&document, &[]);
            assert_eq!((selected.picture.size().width, selected.picture.size().height), (W, H));
            let contents = document.contents();
            assert_eq!(contents.parts[0].levels, if rip { "rip map" } else { "mip map" });
            let out = rewritten(&document, selected, |_| 0.75);
            let (before, after) = (all_levels(&bytes), all_levels(&out));
            for (name, a, b) in before.iter().zip(&after).map(|(a, b)| (&a.0, &a.1, &b.1)) {
                assert_eq!(a.len(), b.len());
                if name == "Z" {
                    assert_eq!(a, b, "other channels keep all levels");
                } else {
                    // A constant has itself as the mean of any pixels.
                    let constant = u32::from(f16::from_f32(0.75).to_bits());
                    assert!(b.iter().all(|&bits| bits == constant), "{name}");
                }
            }
        }
    }
}

fn with_levels(rip: bool, rounding_mode: RoundingMode) -> Vec<u8> {
    let size = Vec2(W, H);
    let make = |name: &str, seed: usize| {
        let level = |size: Vec2<usize>| match name {
            "Z" => FlatSamples::F32((0..size.area()).map(|n| value(seed + size.width(), n)).collect()),
            _ => FlatSamples::F16((0..size.area()).map(|n| f16::from_f32(value(seed, n))).collect()),
        };
        let level_data: Vec<FlatSamples> = if rip {
            exr::meta::rip_map_levels(rounding_mode, size).map(|(_, size)| level(size)).collect()
        } else {
            exr::meta::mip_map_levels(rounding_mode, size).map(|(_, size)| level(size)).collect()
        };
        let samples = if rip {
            let columns = exr::meta::compute_level_count(rounding_mode, W);
            let rows = exr::meta::compute_level_count(rounding_mode, H);
            Levels::Rip {
                rounding_mode,
                level_data: exr::image::RipMaps { map_data: level_data, level_count: Vec2(columns, rows) },
            }
        } else {
            Levels::Mip { rounding_mode, level_data }
        };
        AnyChannel::new(name, samples)
    };
    let list = vec![make("R", 1), make("G", 2), make("B", 3), make("Z", 4)];
    let encoding = encoding(Compression::ZIP16, Blocks::Tiles(Vec2(16, 16)));
    let layer =
        Layer::new(size, LayerAttributes::default(), encoding, AnyChannels::sort(list.into_iter().collect()));
    let image = Image::from_layer(layer);
    let mut bytes = Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

/// Channels by name with the bits of all levels, one after the other.
fn all_levels(bytes: &[u8]) -> Vec<(String, Vec<u32>)> {
    let image = read()
        .no_deep_data()
        .all_resolution_levels()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .unwrap();
    let flat = |levels: &Levels<FlatSamples>| match levels {
        Levels::Singular(one) => bits(one),
        Levels::Mip { level_data, .. } => level_data.iter().flat_map(bits).collect(),
        Levels::Rip { level_data, .. } => level_data.map_data.iter().flat_map(bits).collect(),
    };
    let list = &image.layer_data[0].channel_data.list;
    list.iter().map(|channel| (channel.name.to_string(), flat(&channel.sample_data))).collect()
}

#[test]
fn halves_saturate_instead_of_turning_infinite() {
    let encoding = scan_lines(Compression::ZIP16);
    let bytes = file((W, H), vec![part((W, H), (0, 0), encoding, channels(half))]);
    let document = document(&bytes);
    let selected = select(&document, &[]);
    let out = rewritten(&document, selected, |value| if value > 4.0 { 1e9 } else { -f32::INFINITY });
    let out = decoded(&out);
    let FlatSamples::F16(red) = channel(&out, 0, "R") else { panic!("half stays half") };
    assert!(red.iter().all(|value| value.to_f32().abs() == 65504.0));
}

#[test]
fn several_parts_of_which_one_changes() {
    let n = W * H;
    let beauty = part((W, H), (3, 4), scan_lines(Compression::B44A), channels(half));
    let mut mask = part(
        (20, 30),
        (-10, 50),
        encoding(Compression::PIZ, Blocks::Tiles(Vec2(8, 8))),
        vec![half("mask", 600, 1), uint("id", 600, 2)],
    );
    let lossy = part((W, H), (0, 0), scan_lines(Compression::PXR24), vec![float("N.X", n, 1)]);
    mask.attributes.layer_name = Some("mask".into());
    let (mut beauty, mut lossy) = (beauty, lossy);
    beauty.attributes.layer_name = Some("rgba".into());
    lossy.attributes.layer_name = Some("data".into());
    let bytes = file((100, 90), vec![mask, beauty, lossy]);
    let document = document(&bytes);
    let selected = select(&document, &[]);
    assert_eq!(selected.depth.as_ref().unwrap().name, "rgba:Z");
    let out = rewritten(&document, selected, change);
    let after = same_but(&bytes, &out, &[(1, "R"), (1, "G"), (1, "B"), (1, "A")]);
    let before = decoded(&bytes);
    assert_eq!(bits(channel(&after, 1, "G")), expected(channel(&before, 1, "G")));
    let compressions: Vec<Compression> =
        after.layer_data.iter().map(|layer| layer.encoding.compression).collect();
    assert_eq!(compressions, [Compression::PIZ, Compression::ZIP16, Compression::PXR24]);
}

#[test]
fn the_same_input_gives_the_same_bytes_for_any_number_of_threads() {
    let bytes = file((W, H), vec![part((W, H), (0, 0), scan_lines(Compression::ZIP16), channels(half))]);
    let document = document(&bytes);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| rewritten(&document, select(&document, &[]), change))
    };
    let one = run(1);
    assert_eq!(one, run(3));
    // Attributes in the file's own order: a second pass over the output changes nothing at all.
    let again = common::document(&one);
    let copy = rewritten(&again, select(&again, &[]), |value| value);
    assert_eq!(one, copy);
}

#[test]
fn a_file_may_be_replaced_by_its_own_output() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frame.0001.exr");
    let bytes = file((W, H), vec![part((W, H), (0, 0), scan_lines(Compression::PIZ), channels(half))]);
    std::fs::write(&path, &bytes).unwrap();
    let document = Document::open(&path, &Limits::default()).unwrap();
    let mut selected = document.select(&Selection::default()).unwrap();
    for plane in selected.picture.planes_mut() {
        plane.data_mut().iter_mut().for_each(|value| *value = change(*value));
    }
    document.write(&path, &selected.channels, &selected.picture).unwrap();
    let after = std::fs::read(&path).unwrap();
    same_but(&bytes, &after, &[(0, "R"), (0, "G"), (0, "B"), (0, "A")]);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file is left");
}

#[test]
fn nothing_is_left_behind_by_a_write_that_fails() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.exr");
    let bytes = file((W, H), vec![part((W, H), (0, 0), scan_lines(Compression::ZIP16), channels(half))]);
    let cancel = pullfocus_core::Cancel::new();
    let document = common::document(&bytes).with_cancel(cancel.clone());
    let selected = select(&document, &[]);
    cancel.cancel();
    let error = document.write(&path, &selected.channels, &selected.picture).unwrap_err();
    assert_eq!(error.to_string(), "cancelled");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    let missing = folder.path().join("no/such/folder.exr");
    let error = document.write(&missing, &selected.channels, &selected.picture).unwrap_err();
    assert!(error.to_string().contains("folder"), "{error}");
}

#[test]
fn a_file_that_changes_under_the_reader_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("in.exr");
    let bytes = file((W, H), vec![part((W, H), (0, 0), scan_lines(Compression::ZIP16), channels(half))]);
    std::fs::write(&path, &bytes).unwrap();
    let document = Document::open(&path, &Limits::default()).unwrap();
    std::fs::OpenOptions::new().append(true).open(&path).and_then(|f| f.set_len(10)).unwrap();
    let error = document.select(&Selection::default()).unwrap_err();
    assert!(error.to_string().contains("changed"), "{error}");
}

#[test]
fn a_plain_file_holds_what_it_was_given() {
    use pullfocus_core::{Frame, Plane, Size, Window};
    let data = Window { x: -2, y: 3, size: Size::new(W, H) };
    let frame = Frame { data, pixel_aspect: 2.0, ..Frame::full(Size::new(80, 60)) };
    let coc = Plane::from_fn(data.size, |x, y| x as f32 - 20.0 + y as f32 / 64.0).unwrap();
    let red = Plane::from_fn(data.size, |x, _| if x == 0 { 1e30 } else { x as f32 }).unwrap();
    let planes = [("coc", &coc, Type::Float), ("R", &red, Type::Half)];
    let attributes = [("software", Ours::Text("pullfocus é".to_owned())), ("maxCoc", Ours::Float(12.5))];
    let write = || {
        let mut out = Cursor::new(Vec::new());
        write_exr(&mut out, &frame, &planes, &attributes).unwrap();
        out.into_inner()
    };
    let bytes = write();
    assert_eq!(bytes, write());
    let image = decoded(&bytes);
    let FlatSamples::F32(found) = channel(&image, 0, "coc") else { panic!("float stays float") };
    assert_eq!(found, coc.data());
    let FlatSamples::F16(found) = channel(&image, 0, "R") else { panic!("half stays half") };
    assert_eq!((found[0].to_f32(), found[1].to_f32()), (65504.0, 1.0));
    let document = document(&bytes);
    let selected = document
        .select(&Selection {
            coc_channel: Some("coc".into()),
            layers: vec!["R".into()],
            ..Default::default()
        })
        .unwrap();
    assert_eq!(selected.frame, frame);
    assert_eq!(selected.coc.unwrap().plane, coc);
    let shown = document.contents().parts[0].attributes.clone();
    assert!(shown.iter().any(|a| a.name == "software" && a.value == "pullfocus é"));
    for names in [["R", "R"], ["", "R"]] {
        let planes = names.map(|name| (name, &red, Type::Half));
        assert!(write_exr(Cursor::new(Vec::new()), &frame, &planes, &[]).is_err());
    }
}

/// Files written by the OpenEXR project's own library, beside what it decodes them to.
#[test]
fn lossy_files_decode_as_the_reference_library_decodes_them() {
    let pairs: [(&str, &[u8], &[u8]); 4] = [
        ("DWAA", include_bytes!("data/dwaa.exr"), include_bytes!("data/dwaa-expected.exr")),
        ("DWAB", include_bytes!("data/dwab-tiles.exr"), include_bytes!("data/dwab-tiles-expected.exr")),
        ("B44A", include_bytes!("data/b44a.exr"), include_bytes!("data/b44a-expected.exr")),
        ("PXR24", include_bytes!("data/pxr24.exr"), include_bytes!("data/pxr24-expected.exr")),
    ];
    for (name, lossy, expected) in pairs {
        let (lossy, expected) = (document(lossy), document(expected));
        assert_eq!((lossy.contents().parts[0].compression, lossy.contents().parts[0].lossy), (name, true));
        let (a, b) = (select(&lossy, &[]), select(&expected, &[]));
        assert_eq!(a.picture, b.picture, "{name}");
        assert_eq!(a.depth, b.depth, "{name}");
    }
}
