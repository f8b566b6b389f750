//! Pictures and depth in formats other than OpenEXR: there and back, and damaged.

use proptest::prelude::*;
use pullfocus_core::{Picture, Plane, Size, srgb};
use pullfocus_io::images::{
    Bits, Encoding, Format, Stored, read_depth, read_picture, save, save_srgb, write_image, write_png,
};
use pullfocus_io::output::Existing;
use pullfocus_io::{FileError, Limits};
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn file(&self, name: &str, bytes: &[u8]) -> PathBuf {
        fs::write(self.path(name), bytes).unwrap();
        self.path(name)
    }
}

const SIZE: Size = Size::new(13, 7);

/// Linear, premultiplied, with every code of a small range and alpha from 0 to 1.
fn picture(colors: usize, alpha: bool) -> Picture {
    let value =
        |c: usize, x: usize, y: usize| srgb::decode(((x * 17 + y * 31 + c * 71) % 256) as f32 / 255.0);
    let cover = |x: usize, y: usize| ((x * 5 + y * 3) % 6) as f32 / 5.0;
    let plane = |f: &dyn Fn(usize, usize) -> f32| Plane::from_fn(SIZE, f).unwrap();
    Picture {
        colors: (0..colors)
            .map(|c| plane(&|x, y| value(c, x, y) * if alpha { cover(x, y) } else { 1.0 }))
            .collect(),
        alpha: alpha.then(|| plane(&cover)),
    }
}

fn save_as(folder: &Folder, name: &str, picture: &Picture, bits: Option<Bits>) -> PathBuf {
    let path = folder.path(name);
    let encoding = Encoding::for_name(&path, bits).unwrap();
    assert!(save(&path, picture, encoding, Existing::Replace).unwrap());
    path
}

/// Largest difference of the sRGB-encoded values (what whole numbers are rounded in), alpha included.
fn difference(a: &Picture, b: &Picture) -> f32 {
    assert_eq!(a.alpha.is_some(), b.alpha.is_some());
    let straight = |picture: &Picture, plane: &Plane, i: usize| {
        let alpha = picture.alpha.as_ref().map_or(1.0, |alpha| alpha.data()[i]);
        if alpha > 0.0 { srgb::encode((plane.data()[i] / alpha).min(1.0)) } else { 0.0 }
    };
    let mut largest = 0f32;
    for (c, plane) in b.colors.iter().enumerate() {
        let before = &a.colors[c.min(a.colors.len() - 1)];
        for i in 0..SIZE.area() {
            largest = largest.max((straight(a, before, i) - straight(b, plane, i)).abs());
        }
    }
    if let (Some(a), Some(b)) = (&a.alpha, &b.alpha) {
        let alphas = a.data().iter().zip(b.data());
        largest = alphas.fold(largest, |largest, (a, b)| largest.max((a - b).abs()));
    }
    largest
}

#[test]
fn pictures_come_back_to_half_a_step() {
    let folder = Folder::new();
    let limits = Limits::default();
    for colors in [1, 3] {
        for alpha in [false, true] {
            let before = picture(colors, alpha);
            for (name, bits, step) in [
                ("a.png", Bits::Eight, 1.0 / 255.0),
                ("a.png", Bits::Sixteen, 1.0 / 65535.0),
                ("a.tif", Bits::Eight, 1.0 / 255.0),
                ("a.TIFF", Bits::Sixteen, 1.0 / 65535.0),
                ("a.tif", Bits::Float, 0.0),
            ] {
                let after = read_picture(&save_as(&folder, name, &before, Some(bits)), &limits).unwrap();
                assert_eq!(after.colors.len(), 3, "always R, G, B");
                assert_eq!(after.size(), SIZE);
                // Half a step, and f32 rounding through the curve and back; in the floats that alone.
                let found = difference(&before, &after);
                assert!(found <= 0.5 * step + 1e-6, "{name} {bits:?} {colors} {alpha}: {found}");
            }
        }
    }
}

#[test]
fn formats_without_alpha_show_the_picture_over_black() {
    let folder = Folder::new();
    let before = picture(3, true);
    for name in ["a.pfm", "a.hdr"] {
        let after = read_picture(&save_as(&folder, name, &before, None), &Limits::default()).unwrap();
        assert!(after.alpha.is_none());
        for (a, b) in before.colors.iter().zip(&after.colors) {
            for (i, (a, b)) in a.data().iter().zip(b.data()).enumerate() {
                let largest = before.colors.iter().map(|plane| plane.data()[i]).fold(0.0, f32::max);
                // RGBE: half of 1/128 of the pixel's largest channel.
                let step = if name == "a.hdr" { largest / 256.0 } else { 0.0 };
                assert!((a - b).abs() <= step, "{name}: {a} {b} of {largest}");
            }
        }
    }
}

#[test]
fn jpeg_comes_back_nearly() {
    let folder = Folder::new();
    let size = Size::new(32, 16);
    let smooth = Picture::opaque(
        (0..3)
            .map(|c| Plane::from_fn(size, |x, y| srgb::decode(0.02 * (x + y + c) as f32)).unwrap())
            .collect(),
    );
    let path = folder.path("a.jpg");
    let encoding = Encoding::for_name(&path, None).unwrap().with_jpeg_quality(100);
    save(&path, &smooth, encoding, Existing::Refuse).unwrap();
    let after = read_picture(&path, &Limits::default()).unwrap();
    for (a, b) in smooth.colors.iter().zip(&after.colors) {
        for (a, b) in a.data().iter().zip(b.data()) {
            // Chroma and DCT rounding at quality 100: a few codes of 255.
            assert!((srgb::encode(*a) - srgb::encode(*b)).abs() < 4.0 / 255.0, "{a} {b}");
        }
    }
}

#[test]
fn codes_are_the_published_curve_and_nan_is_black() {
    let folder = Folder::new();
    let values = [0.0, 1.0, 0.214_041_14, 2.0, -1.0, f32::NAN, f32::INFINITY];
    let grey = Picture::opaque(vec![Plane::new(Size::new(7, 1), values.to_vec()).unwrap()]);
    let path = folder.path("a.png");
    write_png(&path, &grey, Bits::Eight, Existing::Refuse).unwrap();
    let codes = image::open(&path).unwrap();
    assert_eq!(codes.color(), image::ColorType::L8);
    assert_eq!(codes.into_luma8().into_raw(), [0, 255, 128, 255, 0, 0, 255]);
    // Others than numbers survive where the format has them.
    let path = save_as(&folder, "a.pfm", &grey, None);
    let depth = read_depth(&path, &Limits::default()).unwrap();
    assert!(depth.plane.data()[5].is_nan() && depth.plane.data()[6] == f32::INFINITY);
    let path = save_as(&folder, "a.hdr", &grey, None);
    let light = read_picture(&path, &Limits::default()).unwrap();
    let row = light.colors[0].data();
    assert_eq!((row[4], row[5]), (0.0, 0.0));
    assert!(row[6] > 9e36 && row[6].is_finite());
}

#[test]
fn planes_that_are_encoded_already_are_not_encoded_twice() {
    let folder = Folder::new();
    let codes =
        [0, 1, 2].map(|c| Plane::from_fn(SIZE, |x, y| ((x * 7 + y + c) % 256) as f32 / 255.0).unwrap());
    for (name, bits, step) in [
        ("a.png", Bits::Eight, 0.5 / 255.0),
        ("a.tif", Bits::Float, 0.0),
        ("a.tif", Bits::Sixteen, 0.5 / 65535.0),
    ] {
        let path = folder.path(name);
        let encoding = Encoding::for_name(&path, Some(bits)).unwrap();
        save_srgb(&path, &codes, encoding, Existing::Replace).unwrap();
        let after = read_picture(&path, &Limits::default()).unwrap();
        for (a, b) in codes.iter().zip(&after.colors) {
            for (a, b) in a.data().iter().zip(b.data()) {
                assert!((a - srgb::encode(*b)).abs() <= step + 1e-6, "{name}");
            }
        }
    }
}

#[test]
fn depth_is_raw() {
    let folder = Folder::new();
    let limits = Limits::default();
    let codes: Vec<u16> = (0..SIZE.area()).map(|i| (i * 700) as u16).collect();
    let bytes: Vec<u8> = codes.iter().flat_map(|c| c.to_ne_bytes()).collect();
    let path = folder.path("z.png");
    let (w, h) = (SIZE.width as u32, SIZE.height as u32);
    image::save_buffer(&path, &bytes, w, h, image::ColorType::L16).unwrap();
    let depth = read_depth(&path, &limits).unwrap();
    assert_eq!(depth.stored, Stored::Integer(16));
    for (value, &code) in depth.plane.data().iter().zip(&codes) {
        assert_eq!(*value, f32::from(code) / 65535.0);
    }

    let metres: Vec<f32> =
        (0..SIZE.area()).map(|i| if i == 3 { f32::INFINITY } else { i as f32 * 1.5 }).collect();
    let path = folder.path("z.tif");
    let mut encoder = tiff::encoder::TiffEncoder::new(fs::File::create(&path).unwrap()).unwrap();
    encoder.write_image::<tiff::encoder::colortype::Gray32Float>(w, h, &metres).unwrap();
    let depth = read_depth(&path, &limits).unwrap();
    assert_eq!((depth.stored, depth.plane.data()), (Stored::Float, metres.as_slice()));

    let rgb: Vec<f32> = metres.iter().flat_map(|&z| [z, 7.0, 8.0]).collect();
    encoder = tiff::encoder::TiffEncoder::new(fs::File::create(&path).unwrap()).unwrap();
    encoder.write_image::<tiff::encoder::colortype::RGB32Float>(w, h, &rgb).unwrap();
    assert_eq!(read_depth(&path, &limits).unwrap().plane.data(), metres.as_slice(), "the first channel");

    let plane = Plane::new(SIZE, metres.clone()).unwrap();
    let path = save_as(&folder, "z.pfm", &Picture::opaque(vec![plane]), None);
    assert_eq!(read_depth(&path, &limits).unwrap().plane.data(), metres.as_slice());
}

#[test]
fn associated_alpha_of_a_tiff_is_not_multiplied_again() {
    let folder = Folder::new();
    let path = folder.path("a.tif");
    {
        let mut encoder = tiff::encoder::TiffEncoder::new(fs::File::create(&path).unwrap()).unwrap();
        let mut image = encoder.new_image::<tiff::encoder::colortype::RGB8>(2, 1).unwrap();
        image.extra_samples(&[tiff::tags::ExtraSamples::AssociatedAlpha]).unwrap();
        image.write_strip(&[64, 32, 0, 128, 200, 100, 50, 255]).unwrap();
        image.finish().unwrap();
    }
    let picture = read_picture(&path, &Limits::default()).unwrap();
    let alpha = 128.0 / 255.0;
    // Half-covered sRGB 127.5, multiplied in as code.
    let expected = srgb::decode(64.0 / 128.0) * alpha;
    assert!((picture.colors[0].at(0, 0) - expected).abs() < 1e-6);
    assert!((picture.colors[0].at(1, 0) - srgb::decode(200.0 / 255.0)).abs() < 1e-6);
    assert_eq!(picture.alpha.unwrap().data(), [alpha, 1.0]);
}

/// Files that the crate for TIFF cannot write: `images_of_others/make.py` says what is in them.
#[test]
fn tiffs_of_other_programs_are_read() {
    let file = |name: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/images_of_others").join(name);
    let limits = Limits::default();
    let real = |c: usize, x: usize, y: usize| (100 * c + 10 * y + x) as f32 / 256.0;
    let all = |plane: &Plane, expected: &dyn Fn(usize, usize) -> f32| {
        assert_eq!(plane.size(), Size::new(5, 4));
        assert_eq!(plane, &Plane::from_fn(plane.size(), expected).unwrap());
    };
    for name in ["planar_float.tif", "tiled_half.tif"] {
        let picture = read_picture(&file(name), &limits).unwrap();
        for (c, plane) in picture.colors.iter().enumerate() {
            all(plane, &|x, y| real(c, x, y));
        }
    }
    let depth = read_depth(&file("big_endian_double.tif"), &limits).unwrap();
    assert_eq!(depth.stored, Stored::Float);
    all(&depth.plane, &|x, y| real(0, x, y));
    let masked = read_picture(&file("mask_beside_colours.tif"), &limits).unwrap();
    assert!(masked.alpha.is_none(), "a mask is no alpha");
    for (c, plane) in masked.colors.iter().enumerate() {
        all(plane, &|x, y| srgb::decode((25 * c + 10 * y + x) as f32 / 255.0));
    }
    let said = read_depth(&file("signed.tif"), &limits).unwrap_err().to_string();
    assert!(said.contains("signed") && said.contains("save it as"), "{said}");
}

/// A JPEG with EXIF's orientation in its second segment.
fn turned_jpeg(orientation: u8) -> Vec<u8> {
    let mut plain = Cursor::new(Vec::new());
    // Left half dark, right half bright, 16 x 8.
    let light = Plane::from_fn(Size::new(16, 8), |x, _| if x < 8 { 0.0 } else { 1.0 }).unwrap();
    let encoding = Encoding::for_name(Path::new("a.jpg"), None).unwrap();
    write_image(&mut plain, Path::new("a.jpg"), &Picture::opaque(vec![light]), encoding).unwrap();
    let plain = plain.into_inner();
    let mut exif = b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".to_vec();
    exif.extend([orientation, 0, 0, 0, 0, 0, 0]);
    let mut turned = plain[..2].to_vec();
    turned.extend([0xff, 0xe1]);
    turned.extend((exif.len() as u16 + 2).to_be_bytes());
    turned.extend(exif);
    turned.extend(&plain[2..]);
    turned
}

#[test]
fn a_photograph_is_turned_upright() {
    let folder = Folder::new();
    let read = |orientation| {
        let path = folder.file("a.jpg", &turned_jpeg(orientation));
        read_picture(&path, &Limits::default()).unwrap().colors.remove(0)
    };
    let (plain, over, clockwise) = (read(1), read(3), read(6));
    assert!(plain.at(1, 4) < 0.1 && plain.at(14, 4) > 0.9);
    assert!(over.at(1, 4) > 0.9 && over.at(14, 4) < 0.1);
    // Turned clockwise, what was at the left is at the top.
    assert_eq!(clockwise.size(), Size::new(8, 16));
    assert!(clockwise.at(4, 1) < 0.1 && clockwise.at(4, 14) > 0.9);
}

#[test]
fn names_say_what_is_written() {
    for (name, bits, word) in [
        ("a", None, "ending"),
        ("a.bmp", None, "ending"),
        ("a.exr", None, "OpenEXR"),
        ("a.png", Some(Bits::Float), "exr, tif or pfm"),
        ("a.jpg", Some(Bits::Sixteen), "8 bits"),
        ("a.pfm", Some(Bits::Eight), "floats"),
    ] {
        let said = Encoding::for_name(Path::new(name), bits).unwrap_err().to_string();
        assert!(said.contains(word), "{said}");
    }
    assert_eq!(Format::of_name(Path::new("b/A.Jpeg")), Some(Format::Jpeg));
}

#[test]
fn pictures_that_a_format_cannot_hold_are_refused_and_leave_nothing() {
    let folder = Folder::new();
    let two = Picture::opaque(vec![Plane::filled(SIZE, 0.5).unwrap(); 2]);
    let long = Picture::opaque(vec![Plane::filled(Size::new(70_000, 1), 0.5).unwrap()]);
    for (name, picture) in [("a.png", &two), ("a.jpg", &long), ("a.tif", &Picture::default())] {
        let path = folder.path(name);
        let encoding = Encoding::for_name(&path, None).unwrap();
        let error = save(&path, picture, encoding, Existing::Refuse).unwrap_err();
        assert!(matches!(error, FileError::Unsupported { .. }), "{error}");
    }
    assert_eq!(fs::read_dir(folder.0.path()).unwrap().count(), 0);
}

#[test]
fn files_are_told_apart_by_their_content() {
    let folder = Folder::new();
    let png = save_as(&folder, "a.png", &picture(3, false), None);
    let disguised = folder.path("a.jpg");
    fs::rename(png, &disguised).unwrap();
    assert_eq!(Format::detect(&disguised).unwrap(), Format::Png);
    assert!(read_picture(&disguised, &Limits::default()).is_ok());
    for (bytes, word) in
        [(&b""[..], "empty"), (b"GIF89a..", "known format"), (b"\x76\x2f\x31\x01\x02", "OpenEXR")]
    {
        let said = read_picture(&folder.file("b", bytes), &Limits::default()).unwrap_err().to_string();
        assert!(said.contains(word), "{said}");
    }
    let said = read_picture(folder.0.path(), &Limits::default()).unwrap_err().to_string();
    assert!(said.contains("folder"), "{said}");
    let said = read_picture(&folder.path("none.png"), &Limits::default()).unwrap_err().to_string();
    assert!(said.contains("none.png") && said.contains("open"), "{said}");
}

#[test]
fn pfm_of_others_is_read() {
    let folder = Folder::new();
    let limits = Limits::default();
    let values = |bytes: &dyn Fn(f32) -> [u8; 4], n: usize| -> Vec<u8> {
        (0..n).flat_map(|i| bytes(i as f32 + 0.5)).collect()
    };
    // Big-endian, RGB, a blank before the width, a scale that is not 1.
    let mut file = b"PF\n2 2\n0.25\n".to_vec();
    file.extend(values(&f32::to_be_bytes, 12));
    let rgb = read_picture(&folder.file("a.pfm", &file), &limits).unwrap();
    // The lowest row comes first.
    assert_eq!(rgb.colors[0].data(), [6.5, 9.5, 0.5, 3.5]);
    assert_eq!(rgb.colors[2].data(), [8.5, 11.5, 2.5, 5.5]);
    let mut file = b"Pf 3  1\r\n-1\n".to_vec();
    file.extend(values(&f32::to_le_bytes, 3));
    assert_eq!(read_depth(&folder.file("a.pfm", &file), &limits).unwrap().plane.data(), [0.5, 1.5, 2.5]);
    for bad in [
        "PF\n2 2\n",
        "PF",
        "PX\n1 1\n1\n....",
        "Pf\n-1 1\n1\n....",
        "Pf\n1 1\n0\n....",
        "Pf\n1 1\nnan\n....",
        "Pf\n1 1\n1\n...",
        "Pf\n0 1\n1\n",
        "Pf\n4294967295 4294967295\n1\n....",
        "Pf\n65536 65536\n1\n....",
    ] {
        let error = read_depth(&folder.file("b.pfm", bad.as_bytes()), &limits).unwrap_err();
        assert!(!matches!(error, FileError::Io { .. }), "{bad}: {error}");
    }
    let endless = [b"Pf ".to_vec(), vec![b'1'; 10_000]].concat();
    assert!(read_depth(&folder.file("c.pfm", &endless), &limits).is_err());
}

/// One file of each kind, small.
fn specimens() -> &'static [(&'static str, Vec<u8>)] {
    static ALL: OnceLock<Vec<(&str, Vec<u8>)>> = OnceLock::new();
    ALL.get_or_init(|| {
        let folder = Folder::new();
        let mut all = vec![("turned.jpg", turned_jpeg(6))];
        for (name, colors, alpha, bits) in [
            ("rgba8.png", 3, true, Some(Bits::Eight)),
            ("grey16.png", 1, false, Some(Bits::Sixteen)),
            ("rgb.jpg", 3, false, None),
            ("rgba16.tif", 3, true, Some(Bits::Sixteen)),
            ("float.tif", 1, false, Some(Bits::Float)),
            ("rgb.hdr", 3, false, None),
            ("rgb.pfm", 3, false, None),
        ] {
            let path = save_as(&folder, name, &picture(colors, alpha), bits);
            all.push((name, fs::read(path).unwrap()));
        }
        all
    })
}

#[test]
fn a_file_cut_short_anywhere_is_an_error_or_a_picture_but_no_panic() {
    let folder = Folder::new();
    for (name, bytes) in specimens() {
        let (mut refused, mut tried) = (0, 0);
        // Every length of the headers, then some.
        for end in (0..bytes.len()).filter(|end| *end < 200 || end % 11 == 0) {
            tried += 1;
            let path = folder.file(name, &bytes[..end]);
            match read_picture(&path, &Limits::default()) {
                Ok(picture) => assert!(picture.size().area() > 0),
                Err(error) => {
                    refused += 1;
                    let said = error.to_string();
                    assert!(said.contains(name) && !said.contains('\n'), "{said}");
                }
            }
        }
        // Decoders may live with a missing end, but not with a missing half.
        assert!(refused >= tried / 2, "{name}: {refused} of {tried}");
    }
}

#[test]
fn a_jpeg_without_its_end_is_refused() {
    let folder = Folder::new();
    let picture = picture(3, false);
    let whole = std::fs::read(save_as(&folder, "whole.jpg", &picture, None)).unwrap();
    let read = |bytes: &[u8]| read_picture(&folder.file("cut.jpg", bytes), &Limits::default());
    let scan = whole.windows(2).rposition(|marker| marker == [0xff, 0xda]).unwrap();
    for end in scan..whole.len() {
        let said = read(&whole[..end]).unwrap_err().to_string();
        assert!(said.contains("cut.jpg") && said.contains("damaged or incomplete"), "{end}: {said}");
    }
    // What cameras put behind the end is theirs, and a small picture's end within a segment is not the end.
    let mut more = whole.clone();
    more.extend(b"behind \xff\xda it");
    assert!(read(&more).is_ok());
    let mut within = whole[..2].to_vec();
    within.extend(b"\xff\xe1\x00\x06\xff\xd8\xff\xd9");
    within.extend(&whole[2..]);
    assert!(read(&within).is_ok());
    assert!(read(&within[..within.len() - 2]).is_err());
}

#[test]
fn a_size_that_the_file_cannot_hold_is_refused_before_memory_is_taken() {
    let folder = Folder::new();
    // 30000 x 30000 in the header of a tiny file: width and height are the first eight bytes of IHDR.
    let mut png = fs::read(save_as(&folder, "a.png", &picture(3, false), None)).unwrap();
    png[16..24].copy_from_slice(&[0, 0, 0x75, 0x30, 0, 0, 0x75, 0x30]);
    let crc = png_crc(&png[12..29]);
    png[29..33].copy_from_slice(&crc.to_be_bytes());
    let mut limits = Limits { max_pixels: 1 << 40, max_plane_bytes: 1 << 40, ..Limits::default() };
    let path = folder.file("a.png", &png);
    let error = read_picture(&path, &limits).unwrap_err();
    assert!(matches!(error, FileError::Damaged { .. }) && error.to_string().contains("hold"), "{error}");
    limits.max_pixels = 1000;
    assert!(matches!(read_picture(&path, &limits), Err(FileError::TooLarge { .. })));
    limits = Limits { max_plane_bytes: 1000, ..Limits::default() };
    let sound = save_as(&folder, "b.png", &picture(3, false), None);
    assert!(matches!(read_picture(&sound, &limits), Err(FileError::TooLarge { .. })));
}

/// CRC-32 of a PNG chunk, bit by bit.
fn png_crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 * (crc & 1)))
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_damage_panics(which in 0usize..8, changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let folder = Folder::new();
        let (name, mut bytes) = specimens()[which].clone();
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        let path = folder.file(name, &bytes);
        let limits = Limits { max_pixels: 1 << 22, max_plane_bytes: 1 << 28, ..Limits::default() };
        if let Ok(picture) = read_picture(&path, &limits) {
            prop_assert!(picture.check().is_ok());
        }
        let _ = read_depth(&path, &limits);
    }

    #[test]
    fn pfm_holds_every_float(width in 1usize..9, height in 1usize..9, grey in any::<bool>(), seed in any::<u32>()) {
        let size = Size::new(width, height);
        let planes = (0..if grey { 1 } else { 3 }).map(|c| {
            Plane::from_fn(size, |x, y| {
                f32::from_bits(seed.wrapping_mul(2_654_435_761).wrapping_add((x * 977 + y * 7919 + c) as u32).wrapping_mul(0x9e37_79b9))
            }).unwrap()
        }).collect();
        let before = Picture::opaque(planes);
        let mut file = Cursor::new(Vec::new());
        let path = Path::new("a.pfm");
        write_image(&mut file, path, &before, Encoding::for_name(path, None).unwrap()).unwrap();
        let folder = Folder::new();
        let path = folder.file("a.pfm", &file.into_inner());
        let after = read_picture(&path, &Limits::default()).unwrap();
        for (a, b) in before.colors.iter().zip(&after.colors) {
            prop_assert!(a.data().iter().zip(b.data()).all(|(a, b)| a.to_bits() == b.to_bits()));
        }
    }

    #[test]
    fn no_text_breaks_pfm(header in "P[Ff][ \\n]?[-0-9 .e\\n]{0,24}", tail in proptest::collection::vec(any::<u8>(), 0..64)) {
        let folder = Folder::new();
        let path = folder.file("a.pfm", &[header.as_bytes(), &tail].concat());
        if let Ok(map) = read_depth(&path, &Limits::default()) {
            prop_assert!(map.plane.size().area() * 4 <= tail.len() + header.len());
        }
    }
}
