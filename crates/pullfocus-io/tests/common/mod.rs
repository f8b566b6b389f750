//! Files made by code, and comparing them bit by bit.
#![allow(dead_code)]

use exr::prelude::*;
use pullfocus_io::{Document, Limits, Selected, Selection};
use std::io::Cursor;

pub type Channel = AnyChannel<FlatSamples>;
pub type Part = Layer<AnyChannels<FlatSamples>>;

/// A value that is different for every seed and pixel, and exact in half.
pub fn value(seed: usize, n: usize) -> f32 {
    ((n * 7919 + seed * 104_729) % 2039) as f32 / 256.0
}

pub fn half(name: &str, pixels: usize, seed: usize) -> Channel {
    let data = (0..pixels).map(|n| f16::from_f32(value(seed, n))).collect();
    AnyChannel::new(name, FlatSamples::F16(data))
}

pub fn float(name: &str, pixels: usize, seed: usize) -> Channel {
    AnyChannel::new(name, FlatSamples::F32((0..pixels).map(|n| value(seed, n) * 1.000_1).collect()))
}

/// Floats with everything that a depth channel may hold.
pub fn odd_float(name: &str, pixels: usize) -> Channel {
    const ODD: [f32; 8] = [0.0, -0.0, f32::INFINITY, f32::NAN, 1e10, 65504.0, 1e-40, -3.5];
    let data = (0..pixels).map(|n| if n % 3 == 0 { ODD[n / 3 % 8] } else { value(5, n) + 0.1 });
    AnyChannel::new(name, FlatSamples::F32(data.collect()))
}

pub fn uint(name: &str, pixels: usize, seed: usize) -> Channel {
    let data = (0..pixels).map(|n| (n * 2_654_435_761 + seed) as u32).collect();
    AnyChannel::new(name, FlatSamples::U32(data))
}

pub fn part(size: (usize, usize), at: (i32, i32), encoding: Encoding, channels: Vec<Channel>) -> Part {
    let mut attributes = LayerAttributes {
        layer_position: Vec2(at.0, at.1),
        comments: Some("kept".into()),
        ..LayerAttributes::default()
    };
    attributes.other.insert("studio/shot".into(), AttributeValue::Text("s010".into()));
    attributes.other.insert("weights".into(), AttributeValue::FloatVec3((1.0, 2.0, -3.0)));
    attributes.other.insert(
        "blob".into(),
        AttributeValue::Custom { kind: "ours".into(), bytes: smallvec::smallvec![1, 2, 0, 255] },
    );
    Layer::new(size, attributes, encoding, AnyChannels::sort(channels.into_iter().collect()))
}

pub fn file(display: (usize, usize), parts: Vec<Part>) -> Vec<u8> {
    let window = IntegerBounds::from_dimensions(Vec2(display.0, display.1));
    let image = Image::from_layers(ImageAttributes::new(window), parts);
    let mut bytes = Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

pub fn encoding(compression: Compression, blocks: Blocks) -> Encoding {
    Encoding { compression, blocks, line_order: LineOrder::Increasing }
}

pub fn scan_lines(compression: Compression) -> Encoding {
    encoding(compression, Blocks::ScanLines)
}

pub fn decoded(bytes: &[u8]) -> FlatImage {
    read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .unwrap()
}

pub fn bits(samples: &FlatSamples) -> Vec<u32> {
    match samples {
        FlatSamples::F16(v) => v.iter().map(|v| u32::from(v.to_bits())).collect(),
        FlatSamples::F32(v) => v.iter().map(|v| v.to_bits()).collect(),
        FlatSamples::U32(v) => v.clone(),
    }
}

pub fn channel<'a>(image: &'a FlatImage, part: usize, name: &str) -> &'a FlatSamples {
    let list = &image.layer_data[part].channel_data.list;
    &list.iter().find(|channel| channel.name.to_string() == name).unwrap().sample_data
}

pub fn document(bytes: &[u8]) -> Document {
    Document::from_bytes("test.exr", bytes.to_vec(), &Limits::default()).unwrap()
}

pub fn select(document: &Document, layers: &[&str]) -> Selected {
    let layers = layers.iter().map(|&layer| layer.to_owned()).collect();
    document.select(&Selection { layers, ..Selection::default() }).unwrap()
}

/// Writes the document with every selected value put through `change`.
pub fn rewritten(document: &Document, mut selected: Selected, change: impl Fn(f32) -> f32) -> Vec<u8> {
    for plane in selected.picture.planes_mut() {
        plane.data_mut().iter_mut().for_each(|value| *value = change(*value));
    }
    let mut out = Cursor::new(Vec::new());
    document.write_to(&mut out, &selected.channels, &selected.picture).unwrap();
    out.into_inner()
}

/// Asserts that two files hold the same but for the named channels, and returns the second one decoded.
pub fn same_but(before: &[u8], after: &[u8], changed: &[(usize, &str)]) -> FlatImage {
    let (a, b) = (decoded(before), decoded(after));
    assert_eq!(a.attributes, b.attributes);
    assert_eq!(a.layer_data.len(), b.layer_data.len());
    for (part, (x, y)) in a.layer_data.iter().zip(&b.layer_data).enumerate() {
        assert_eq!(x.attributes, y.attributes, "part {part}");
        assert_eq!(x.size, y.size);
        assert_eq!(x.encoding.blocks, y.encoding.blocks);
        assert_eq!(x.encoding.line_order, y.encoding.line_order);
        assert_eq!(x.channel_data.list.len(), y.channel_data.list.len());
        for (c, d) in x.channel_data.list.iter().zip(&y.channel_data.list) {
            assert_eq!(c.name, d.name);
            if !changed.contains(&(part, c.name.to_string().as_str())) {
                assert_eq!(bits(&c.sample_data), bits(&d.sample_data), "part {part} channel {}", c.name);
            }
        }
    }
    // The crate sorts attributes into maps; ours are compared as they stand.
    let (before, after) = (document(before).contents(), document(after).contents());
    for (x, y) in before.parts.iter().zip(&after.parts) {
        assert_eq!(x.attributes, y.attributes);
    }
    b
}
