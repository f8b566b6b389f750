//! What is noted of a file: colour profiles, which go along where they say the same of the result, and more.

use image::codecs::{jpeg::JpegEncoder, png::PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use pullfocus_core::Size;
use pullfocus_io::Limits;
use pullfocus_io::images::{Bits, Encoding, Image, Stored, read_image, read_picture, save_with_profile};
use pullfocus_io::output::Existing;
use std::fs::File;
use std::path::Path;

/// What is looked at of a profile here: its space, its mark and its name.
fn profile(space: &[u8; 4], name: &str) -> Vec<u8> {
    let mut bytes = vec![0; 128];
    bytes[16..20].copy_from_slice(space);
    bytes[36..40].copy_from_slice(b"acsp");
    bytes.extend(name.bytes());
    bytes
}

const SIZE: Size = Size::new(8, 4);

fn read(path: &Path) -> Image {
    read_image(path, &Limits::default()).unwrap()
}

/// A picture of a telephone.
fn write(path: &Path, color: ExtendedColorType, profile: Vec<u8>) {
    let codes: Vec<u8> =
        (0..SIZE.area() * usize::from(color.channel_count())).map(|i| (i * 5 % 251) as u8).collect();
    let out = File::create(path).unwrap();
    if path.extension().is_some_and(|ending| ending == "jpg") {
        let mut encoder = JpegEncoder::new(out);
        encoder.set_icc_profile(profile).unwrap();
        encoder.write_image(&codes, SIZE.width as u32, SIZE.height as u32, color).unwrap();
    } else {
        let mut encoder = PngEncoder::new(out);
        encoder.set_icc_profile(profile).unwrap();
        encoder.write_image(&codes, SIZE.width as u32, SIZE.height as u32, color).unwrap();
    }
}

#[test]
fn a_profile_goes_along_with_the_same_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let wide = profile(b"RGB ", "Display P3");
    for input in ["in.jpg", "in.png"] {
        let input = folder.path().join(input);
        write(&input, ExtendedColorType::Rgb8, wide.clone());
        let image = read(&input);
        assert_eq!(image.stored, Stored::Integer(8));
        assert_eq!(image.profile.as_ref().unwrap().bytes(), wide);
        let [note] = image.notes.as_slice() else { panic!("{:?}", image.notes) };
        assert!(note.contains("sRGB's curve") && note.contains("goes along"), "{note}");
        for (name, bits, kept) in [
            ("out.png", Some(Bits::Eight), true),
            ("out.png", None, true),
            ("out.jpg", None, true),
            ("out.tif", None, true),
            ("out.tif", Some(Bits::Eight), true),
            // Of linear numbers it would not be true.
            ("out.tif", Some(Bits::Float), false),
            ("out.hdr", None, false),
        ] {
            let output = folder.path().join(name);
            let encoding = Encoding::for_name(&output, bits).unwrap();
            let profile = image.profile.as_ref();
            save_with_profile(&output, &image.picture, encoding, profile, Existing::Replace).unwrap();
            let again = read(&output);
            let expected = kept.then_some(wide.as_slice());
            assert_eq!(again.profile.as_ref().map(|profile| profile.bytes()), expected, "{name} {bits:?}");
            assert_eq!(again.notes.is_empty(), !kept);
        }
    }
}

#[test]
fn a_profile_of_floats_goes_along_into_floats() {
    let folder = tempfile::tempdir().unwrap();
    let (png, float) = (folder.path().join("in.png"), folder.path().join("in.tif"));
    write(&png, ExtendedColorType::Rgb8, vec![]);
    let image = read(&png);
    assert_eq!((&image.profile, image.notes.len()), (&None, 0));
    // A file of floats with a profile, as other programs write it.
    {
        use tiff::encoder::{TiffEncoder, colortype};
        let mut encoder = TiffEncoder::new(File::create(&float).unwrap()).unwrap();
        let (width, height) = (SIZE.width as u32, SIZE.height as u32);
        let mut image = encoder.new_image::<colortype::RGB32Float>(width, height).unwrap();
        let wide = profile(b"RGB ", "linear");
        image.encoder().write_tag(tiff::tags::Tag::IccProfile, &wide[..]).unwrap();
        image.write_data(&vec![0.5; SIZE.area() * 3]).unwrap();
    }
    let image = read(&float);
    assert!(image.stored == Stored::Float && image.notes[0].contains("linear light"), "{:?}", image.notes);
    for (name, bits, kept) in [("out.tif", Bits::Float, true), ("out.tif", Bits::Sixteen, false)] {
        let output = folder.path().join(name);
        let encoding = Encoding::for_name(&output, Some(bits)).unwrap();
        save_with_profile(&output, &image.picture, encoding, image.profile.as_ref(), Existing::Replace)
            .unwrap();
        assert_eq!(read(&output).profile.is_some(), kept, "{bits:?}");
    }
}

#[test]
fn what_cannot_stand_beside_rgb_stays_behind_and_srgb_is_no_news() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    for (name, color, space) in [
        ("grey.png", ExtendedColorType::L8, profile(b"GRAY", "Dot Gain 20%")),
        ("short.jpg", ExtendedColorType::Rgb8, vec![1, 2, 3]),
    ] {
        write(&path(name), color, space);
        let image = read(&path(name));
        assert!(image.notes[0].contains("does not go along"), "{:?}", image.notes);
        let encoding = Encoding::for_name(Path::new("a.png"), None).unwrap();
        let profile = image.profile.as_ref();
        save_with_profile(&path("out.png"), &image.picture, encoding, profile, Existing::Replace).unwrap();
        assert_eq!(read(&path("out.png")).profile, None);
        assert_eq!(read_picture(&path(name), &Limits::default()).unwrap(), image.picture);
    }
    for (name, notes) in [("sRGB IEC61966-2.1", 0), ("sRGB built-in", 0), ("Linear sRGB", 1)] {
        write(&path("plain.png"), ExtendedColorType::Rgb8, profile(b"RGB ", name));
        let image = read(&path("plain.png"));
        assert_eq!((image.profile.is_some(), image.notes.len()), (notes > 0, notes), "{name}");
    }
}

#[test]
fn what_else_is_not_used_is_noted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.pfm");
    for (scale, noted) in [("-2.5", true), ("-1.0", false)] {
        let mut bytes = format!("Pf\n1 1\n{scale}\n").into_bytes();
        bytes.extend(0.5f32.to_le_bytes());
        std::fs::write(&path, bytes).unwrap();
        let notes = read(&path).notes;
        assert_eq!(notes.iter().any(|note| note.contains("scale of 2.5")), noted, "{notes:?}");
    }
}
