//! Files put together byte by byte, for what the `exr` crate cannot write.
#![allow(dead_code)]

pub type Attributes = Vec<(String, String, Vec<u8>)>;

pub fn ints(values: &[i32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// The attributes that every part must have; `kind` is the `type` attribute.
pub fn required(kind: &str, window: [i32; 4], channels: &[(&str, u32, [i32; 2])]) -> Attributes {
    let mut list = Vec::new();
    for (name, sample_type, sampling) in channels {
        list.extend(name.as_bytes());
        list.push(0);
        list.extend(sample_type.to_le_bytes());
        list.extend([0; 4]);
        list.extend(ints(sampling));
    }
    list.push(0);
    let attribute = |name: &str, kind: &str, bytes| (name.to_owned(), kind.to_owned(), bytes);
    vec![
        attribute("channels", "chlist", list),
        attribute("compression", "compression", vec![0]),
        attribute("dataWindow", "box2i", ints(&window)),
        attribute("displayWindow", "box2i", ints(&window)),
        attribute("lineOrder", "lineOrder", vec![0]),
        attribute("pixelAspectRatio", "float", 1f32.to_le_bytes().to_vec()),
        attribute("screenWindowCenter", "v2f", vec![0; 8]),
        attribute("screenWindowWidth", "float", 1f32.to_le_bytes().to_vec()),
        attribute("type", "string", kind.as_bytes().to_vec()),
    ]
}

pub fn text(name: &str, value: &str) -> (String, String, Vec<u8>) {
    (name.to_owned(), "string".to_owned(), value.as_bytes().to_vec())
}

/// Header, tables and chunks; each chunk is given with its part, in table order.
pub fn assemble(version: u32, parts: &[Attributes], chunks: &[(usize, Vec<u8>)]) -> Vec<u8> {
    let mut bytes = vec![0x76, 0x2f, 0x31, 0x01];
    bytes.extend(version.to_le_bytes());
    for attributes in parts {
        for (name, kind, value) in attributes {
            for text in [name, kind] {
                bytes.extend(text.as_bytes());
                bytes.push(0);
            }
            bytes.extend((value.len() as u32).to_le_bytes());
            bytes.extend(value);
        }
        bytes.push(0);
    }
    let multi_part = version & 0x1000 != 0;
    if multi_part {
        bytes.push(0);
    }
    let mut at = (bytes.len() + 8 * chunks.len()) as u64;
    let mut bodies = Vec::new();
    for (part, body) in chunks {
        bytes.extend(at.to_le_bytes());
        let start = bodies.len();
        if multi_part {
            bodies.extend((*part as i32).to_le_bytes());
        }
        bodies.extend(body);
        at += (bodies.len() - start) as u64;
    }
    bytes.extend(bodies);
    bytes
}

/// A flat scan-line chunk.
pub fn scan_line(y: i32, pixels: &[u8]) -> Vec<u8> {
    let mut body = ints(&[y, pixels.len() as i32]);
    body.extend(pixels);
    body
}

/// A deep scan-line chunk: sizes of table, packed and unpacked samples, then both.
pub fn deep_line(y: i32, table: &[i32], samples: &[u8]) -> Vec<u8> {
    let mut body = ints(&[y]);
    for size in [table.len() * 4, samples.len(), samples.len()] {
        body.extend((size as u64).to_le_bytes());
    }
    body.extend(ints(table));
    body.extend(samples);
    body
}

/// A deep part of two pixels, one of which has two samples.
pub fn deep_part() -> (Attributes, Vec<u8>) {
    let mut attributes = required("deepscanline", [0, 0, 1, 0], &[("A", 1, [1, 1]), ("Z", 2, [1, 1])]);
    attributes.push(("version".to_owned(), "int".to_owned(), ints(&[1])));
    attributes.push(("chunkCount".to_owned(), "int".to_owned(), ints(&[1])));
    (attributes, deep_line(0, &[2, 3], &(0..18).collect::<Vec<u8>>()))
}
