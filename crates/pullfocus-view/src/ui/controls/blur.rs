//! How the blur is made.

use crate::ui::App;
use crate::ui::color::named;
use eframe::egui::{self, Slider, SliderClamping, Ui};
use pullfocus_core::aperture::{LEAST_BLADES, MOST_BLADES};
use pullfocus_job::options::{Blur, LayeringName, MethodName, PresetName, PsfName};
use pullfocus_job::settings::of_diffusion;
use pullfocus_job::values::{Number, Shape};

/// The methods, by name, and what each does to the picture.
const METHODS: [(MethodName, &str, &str); 7] = [
    (MethodName::Aperture, "Aperture", "Points of light take the aperture's own shape: nearest to a lens."),
    (
        MethodName::Diffusion,
        "Diffusion",
        "Colours run like heat and stop at sharp edges: smooth and quick, without a shape.",
    ),
    (
        MethodName::Pyramid,
        "Pyramid",
        "Points of light become soft spots (Gaussians), at any size alike quick.",
    ),
    (
        MethodName::Tensor,
        "Tensor",
        "Soft spots as well, made of averages at few places: the larger the blur, the quicker and the coarser.",
    ),
    (
        MethodName::Square,
        "Square",
        "Points of light become squares: quick, and seen as squares in highlights.",
    ),
    (
        MethodName::Gather,
        "Gather (slow)",
        "Each pixel is an average over its own circle: blurred things end in hard edges.",
    ),
    (
        MethodName::Naive,
        "Naive (slow)",
        "Each pixel is spread over its circle one by one: what the others are measured by.",
    ),
];

/// The method of a preset.
fn usual_method(preset: PresetName) -> MethodName {
    if preset == PresetName::Preview { MethodName::Diffusion } else { MethodName::Aperture }
}

/// The method that the options come to.
fn method_of(blur: &Blur) -> MethodName {
    let usual = usual_method(blur.preset.unwrap_or(PresetName::Final));
    // Who says how diffusion works means diffusion.
    let meant = if of_diffusion(blur).is_some() { MethodName::Diffusion } else { usual };
    blur.method.unwrap_or(meant)
}

/// What stays of a shot's blur with another preset. A preset is a whole: how the blur is made goes, what the lens and
/// the files are like stays.
fn with_preset(blur: &Blur, preset: PresetName) -> Blur {
    fitting(Blur {
        preset: Some(preset),
        aperture: blur.aperture.clone(),
        aperture_rotation: blur.aperture_rotation,
        aperture_roundness: blur.aperture_roundness,
        squeeze: blur.squeeze,
        bokeh_threshold: blur.bokeh_threshold,
        bokeh_gain: blur.bokeh_gain,
        bokeh_knee: blur.bokeh_knee,
        bokeh_least: blur.bokeh_least,
        cats_eye: blur.cats_eye,
        show: blur.show,
        channels: blur.channels.clone(),
        preview_png: blur.preview_png.clone(),
        device: blur.device.clone(),
        gpu_storage: blur.gpu_storage,
        ..Blur::default()
    })
}

/// What stays of a shot's blur with another method: all that the method has.
fn with_method(blur: &Blur, method: MethodName) -> Blur {
    let mut blur = blur.clone();
    if method != MethodName::Diffusion {
        (blur.integrator, blur.steps, blur.calibration) = (None, None, None);
        (blur.solver, blur.sweeps, blur.tolerance) = (None, None, None);
    }
    if method != MethodName::Pyramid {
        (blur.quality, blur.mipmap) = (None, None);
    }
    if method != MethodName::Tensor {
        (blur.tensor_sites, blur.tensor_spacing) = (None, None);
        (blur.tensor_gather, blur.tensor_spread) = (None, None);
    }
    if !matches!(method, MethodName::Naive | MethodName::Gather) {
        blur.psf = None;
    }
    let usual = usual_method(blur.preset.unwrap_or(PresetName::Final));
    blur.method = (method != usual).then_some(method);
    fitting(blur)
}

/// Whether points of light have the aperture's shape.
fn is_shaped(blur: &Blur) -> bool {
    let psf = blur.psf == Some(PsfName::Aperture);
    psf || method_of(blur) == MethodName::Aperture || blur.bokeh_threshold.is_some()
}

/// The options without those of highlights and of the aperture's shape that have nothing to act on.
fn fitting(mut blur: Blur) -> Blur {
    if blur.bokeh_threshold.is_none() {
        (blur.bokeh_gain, blur.bokeh_knee, blur.bokeh_least, blur.cats_eye) = (None, None, None, None);
    }
    if !is_shaped(&blur) {
        (blur.aperture, blur.aperture_rotation) = (None, None);
        (blur.aperture_roundness, blur.squeeze) = (None, None);
    }
    blur
}

impl App {
    pub(super) fn blur_controls(&mut self, ui: &mut Ui) {
        ui.heading("Blur");
        let front = self.front();
        let blur = &mut self.document.takes[front].blur;
        let preset = blur.preset.unwrap_or(PresetName::Final);
        ui.horizontal(|ui| {
            for (name, text, hint) in [
                (
                    PresetName::Preview,
                    "Preview",
                    "Two layers and one step of diffusion: quick, to choose focus and f-stop.",
                ),
                (
                    PresetName::Final,
                    "Final",
                    "Layers through the whole depth and the aperture's own shape: the picture to keep.",
                ),
            ] {
                if ui.selectable_label(preset == name, text).on_hover_text(hint).clicked() {
                    *blur = with_preset(blur, name);
                }
            }
        });
        let mut method = method_of(blur);
        ui.horizontal(|ui| {
            ui.label("Method");
            let name = METHODS.iter().find(|(known, ..)| *known == method).map_or("", |(_, name, _)| name);
            let before = method;
            let combo = egui::ComboBox::from_id_salt("method").selected_text(name).show_ui(ui, |ui| {
                for (choice, name, hint) in METHODS {
                    ui.selectable_value(&mut method, choice, name).on_hover_text(hint);
                }
            });
            named(&combo.response, "Method", name);
            combo.response.on_hover_text(
                "How each layer is blurred. Aperture is nearest to a lens; the others are there to compare.",
            );
            if method != before {
                *blur = with_method(blur, method);
            }
        });
        let usual =
            if preset == PresetName::Preview { LayeringName::Background } else { LayeringName::General };
        let mut layering = blur.layering.unwrap_or(usual);
        ui.horizontal(|ui| {
            ui.label("Layers");
            let before = layering;
            for (choice, name, hint) in [
                (LayeringName::Single, "one", "One layer: near and far things bleed into each other."),
                (
                    LayeringName::Background,
                    "background",
                    "Far things blur behind sharp ones, as in the first paper.",
                ),
                (LayeringName::General, "all", "Layers through the whole depth, near ones included."),
            ] {
                ui.selectable_value(&mut layering, choice, name).on_hover_text(hint);
            }
            if layering != before {
                blur.layering = (layering != usual).then_some(layering);
                blur.layers = None;
                blur.layer_threshold = None;
            }
        });
        let mut lights = blur.bokeh_threshold.is_some();
        ui.horizontal(|ui| {
            let hint = "Bright light out of focus as sharp images of the aperture.";
            let checkbox = ui.checkbox(&mut lights, "Highlights").on_hover_text(hint);
            if checkbox.changed() {
                blur.bokeh_threshold = lights.then_some(Number(2.0));
                *blur = fitting(blur.clone());
            }
            if let Some(Number(threshold)) = &mut blur.bokeh_threshold {
                let drag = egui::DragValue::new(threshold)
                    .range(0.001..=f64::MAX)
                    .clamp_existing_to_range(false)
                    .speed(0.02)
                    .prefix("from ");
                ui.add(drag)
                    .labelled_by(checkbox.id)
                    .on_hover_text("Brightness from which light is a highlight; 1 is white.");
            }
        });
        if is_shaped(blur) {
            let mut blades = match blur.aperture {
                Some(Shape::Blades(count)) => count,
                _ => 0,
            };
            let slider = Slider::new(&mut blades, 0..=MOST_BLADES)
                .clamping(SliderClamping::Edits)
                .text("blades")
                .custom_formatter(|count, _| if count < 3.0 { "disc".into() } else { format!("{count}") })
                .custom_parser(|text| if text == "disc" { Some(0.0) } else { text.parse().ok() });
            if ui.add(slider).on_hover_text("Blades of the iris: the shape of lights out of focus.").changed()
            {
                blur.aperture = (blades >= LEAST_BLADES).then_some(Shape::Blades(blades));
                if blades < LEAST_BLADES {
                    blur.aperture_roundness = None;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_job::options::{Circle, Depth};

    fn blur(text: &str) -> Blur {
        pullfocus_job::config::parse(text).unwrap().blur
    }

    #[test]
    fn another_method_or_preset_keeps_what_goes_with_it() {
        let kept = "preview-png = 'seen.png'\nshow = 'layer:1'\nlayers = 5\n";
        let before = blur(&format!("{kept}squeeze = 2\naperture = 'blades:6'\naperture-roundness = 0.5"));
        assert_eq!(with_method(&before, MethodName::Diffusion), blur(&format!("{kept}method = 'diffusion'")));
        let lit = Blur { bokeh_threshold: Some(Number(2.0)), ..before.clone() };
        let other = with_method(&lit, MethodName::Diffusion);
        assert_eq!(other, Blur { method: Some(MethodName::Diffusion), ..lit.clone() });
        assert_eq!(with_method(&other, MethodName::Aperture), lit);
        let preview = with_preset(&lit, PresetName::Preview);
        assert_eq!(preview, Blur { preset: Some(PresetName::Preview), layers: None, ..lit });
        let preview = with_preset(&before, PresetName::Preview);
        assert_eq!(preview, blur("preset = 'preview'\npreview-png = 'seen.png'\nshow = 'layer:1'"));
    }

    #[test]
    fn every_change_gives_options_that_go_together() {
        for text in [
            "squeeze = 2\nbokeh-threshold = 1\ncats-eye = 0.5",
            "method = 'naive'\npsf = 'aperture'\nsqueeze = 2",
            "integrator = 'backward-euler'\nsteps = 3",
            "method = 'tensor'\ntensor-spacing = 0.5",
            "method = 'pyramid'\nquality = 'fine'\nmipmap = 'nearest'",
        ] {
            let before = blur(text);
            let settings = |blur: &Blur| {
                pullfocus_job::settings::settings(blur, &Circle::default(), &Depth::default()).unwrap()
            };
            settings(&before);
            for (method, ..) in METHODS {
                let after = with_method(&before, method);
                assert_eq!(settings(&after).method, pullfocus_job::settings::method_of(method), "{text}");
                assert_eq!(method_of(&after), method, "{text}");
            }
            for preset in [PresetName::Preview, PresetName::Final] {
                settings(&with_preset(&before, preset));
            }
            settings(&fitting(Blur { bokeh_threshold: None, ..before }));
        }
    }
}
