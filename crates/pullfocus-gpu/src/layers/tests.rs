use pullfocus_core::layers::MOST_LAYERS;
use pullfocus_core::layers::general as core_layers;
use pullfocus_core::split as core_split;

#[test]
fn the_shaders_constants_are_cores() {
    use core_layers::*;
    use core_split::*;
    let text = crate::shader::part!("layers/constants").text;
    let mut lines = text.lines().skip(1);
    let mut expect = |line: String| assert_eq!(lines.next(), Some(line.as_str()));
    let pair = |name: &str, [a, b]: [f64; 2]| format!("const {name}: vec2f = vec2f({a:?}, {b:?});");
    expect(format!("const MOST_LAYERS: u32 = {MOST_LAYERS};"));
    expect(format!("const BINS: u32 = {BINS};"));
    for (name, value) in [
        ("U_MAX", U_MAX),
        ("BIN", BIN),
        ("EDGE_FROM", EDGE_FROM.into()),
        ("EDGE_TO", EDGE_TO.into()),
        ("WEIGHTS_DEVIATION", WEIGHTS_DEVIATION),
        ("PLACE_DEVIATION", PLACE_DEVIATION),
        ("LEAST_WINDOW", LEAST_WINDOW),
        ("LEAST_APART", LEAST_APART),
        ("ALL_PIXELS", ALL_PIXELS),
        ("LEAST_ENDS", LEAST_ENDS),
        ("NO_SPANS", NO_SPANS),
        ("NO_DENSITY", NO_DENSITY),
    ] {
        expect(format!("const {name}: f32 = {value:?};"));
    }
    expect(pair("HALF", HALF));
    expect(pair("OVERLAP", OVERLAP));
    expect(format!("const SHARPNESS: f32 = {SHARPNESS:?};"));
    expect(format!("const INERTIA: f32 = {INERTIA:?};"));
    expect(format!("const ROUNDS: u32 = {ROUNDS};"));
    expect(pair("EDGE_STEP", EDGE_STEP.map(f64::from)));
    for (name, value) in [
        ("EDGE_TRUST", EDGE_TRUST),
        ("COLOR_NOISE", COLOR_NOISE),
        ("VARIANCE", VARIANCE),
        ("LEAST_SHARE", LEAST_SHARE),
        ("OWN_FROM", OWN_FROM),
    ] {
        expect(format!("const {name}: f32 = {value:?};"));
    }
    assert_eq!(lines.next(), None);
}
