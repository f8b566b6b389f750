//! The lens, how the blur is made, and how it is looked at.

use super::App;
use crate::document::{LensValues, Quantity};
use crate::look::{From, View};
use crate::screen::Transform;
use eframe::egui::{self, Slider, Ui};
use pullfocus_core::focus::{self, distance, stops};
use pullfocus_core::sensor::{self, SENSORS};
use pullfocus_job::options::{LayeringName, MethodName, PresetName};
use pullfocus_job::values::{Number, Shape};

/// Width of the panel, so that nothing moves when a value grows longer.
pub const WIDTH: f32 = 330.0;

impl App {
    /// The lens of the take in front at this frame.
    pub fn lens_values(&self) -> Option<LensValues> {
        let plate = self.plate.as_ref().filter(|plate| !plate.has_coc)?;
        Some(self.document.values(self.front(), plate, self.frame_number()))
    }

    pub(super) fn controls(&mut self, ui: &mut Ui) {
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            ui.spacing_mut().slider_width = WIDTH - 150.0;
            ui.set_max_width(WIDTH - 20.0);
            self.lens_controls(ui);
            ui.separator();
            self.blur_controls(ui);
            ui.separator();
            self.view_controls(ui);
            ui.separator();
            self.inspector(ui);
        });
    }

    fn lens_controls(&mut self, ui: &mut Ui) {
        let front = self.front();
        ui.horizontal(|ui| {
            ui.heading("Lens");
            for (side, name) in ["A", "B"].into_iter().enumerate() {
                let hint = "The take whose lens and settings are below; B is compared with A.";
                if ui.selectable_label(front == side, format!("Take {name}")).on_hover_text(hint).clicked() {
                    self.look.left = if side == 1 { View::Other } else { View::Result };
                }
            }
            if ui.small_button("A to B").on_hover_text("Make take B what take A is now.").clicked() {
                self.document.takes[1] = self.document.takes[0].clone();
            }
        });
        let Some(values) = self.lens_values() else {
            let text = if self.plate.is_some() {
                "The file holds circles of confusion: its lens is done."
            } else {
                "No picture is open."
            };
            ui.label(text);
            return;
        };
        self.focus_control(ui, &values);
        self.stop_control(ui, &values);
        self.focal_control(ui, &values);
        self.sensor_control(ui, &values);
        self.readout(ui);
    }

    /// A quantity's diamond: whether it has keys.
    fn keyed(&mut self, ui: &mut Ui, quantity: Quantity, value: f64) {
        let keyed = self.document.is_keyed(self.front(), quantity);
        let hint =
            if keyed { "Take this value's keys away." } else { "Let this value move: key it at this frame." };
        let response = ui.selectable_label(keyed, "key").on_hover_text(hint);
        if response.clicked() {
            let frame = self.frame_number();
            let result = self.document.toggle_keyed(self.front(), quantity, value, frame);
            self.tell(result);
        }
    }

    fn focus_control(&mut self, ui: &mut Ui, values: &LensValues) {
        let (units, from) = (self.look.units(), self.look.from);
        let lens = self
            .plate
            .as_ref()
            .and_then(|plate| self.document.lens(self.front(), plate, self.frame_number()).ok());
        let Some(lens) = lens.map(|resolved| resolved.camera.lens()) else { return };
        let shown = |metres: f64| {
            if from == From::SensorPlane { focus::to_sensor_plane(&lens, metres) } else { metres }
        };
        let mut value = shown(values.focus_m);
        let [near, far] = self.plate.as_ref().and_then(|plate| plate.histogram.range).unwrap_or([0.3, 30.0]);
        ui.horizontal(|ui| {
            self.keyed(ui, Quantity::FocusDistance, values.focus_m);
            ui.label("Focus distance");
        });
        let slider = Slider::new(&mut value, 0.3 * near..=f64::INFINITY)
            .logarithmic(true)
            .largest_finite(3.0 * far)
            .clamping(egui::SliderClamping::Never)
            .custom_formatter(move |metres, _| distance::format(metres, units))
            .custom_parser(|text| distance::parse(text).ok());
        let response = ui.add(slider);
        response.widget_info(|| egui::WidgetInfo::slider(true, value, "Focus distance"));
        let response = response.on_hover_text(
            "What is sharp. Click on the picture to focus there. Type 2.5, 320 cm, 10' 6\" or inf.",
        );
        if response.changed() {
            let metres = match from {
                From::EntrancePupil => Some(value),
                From::SensorPlane => focus::from_sensor_plane(&lens, value),
            };
            match metres.filter(|metres| *metres > 0.0) {
                Some(metres) => self.change(Quantity::FocusDistance, metres),
                None => {
                    self.say("no lens focuses so near: from the sensor it is four focal lengths at the least")
                }
            }
        }
        ui.horizontal(|ui| {
            let toggle = ui.selectable_label(!self.look.feet, "m").on_hover_text("Distances in metres.");
            if toggle.clicked() {
                self.look.feet = false;
            }
            if ui
                .selectable_label(self.look.feet, "ft in")
                .on_hover_text("Distances in feet and inches.")
                .clicked()
            {
                self.look.feet = true;
            }
            ui.separator();
            for (choice, name, hint) in [
                (
                    From::EntrancePupil,
                    "from lens",
                    "Distances from the entrance pupil, where a renderer's camera is.",
                ),
                (
                    From::SensorPlane,
                    "from sensor",
                    "Distances from the sensor plane, as marks on a lens and a tape are.",
                ),
            ] {
                ui.selectable_value(&mut self.look.from, choice, name).on_hover_text(hint);
            }
        });
    }

    fn stop_control(&mut self, ui: &mut Ui, values: &LensValues) {
        let Some(f_stop) = values.f_stop else {
            let diameter =
                &mut self.document.takes[usize::from(self.look.left == View::Other)].lens.aperture_diameter;
            if let Some(Number(metres)) = diameter {
                let mut mm = *metres * 1e3;
                ui.label("Aperture diameter");
                let slider =
                    Slider::new(&mut mm, 0.0..=200.0).suffix(" mm").logarithmic(true).smallest_positive(0.1);
                if ui
                    .add(slider)
                    .on_hover_text("How wide the aperture is: the wider, the blurrier.")
                    .changed()
                {
                    *diameter = Some(Number(mm * 1e-3));
                }
            }
            return;
        };
        let transmittance = self.look.transmittance;
        ui.horizontal(|ui| {
            self.keyed(ui, Quantity::FStop, f_stop);
            ui.label(if transmittance.is_some() { "T-stop" } else { "f-stop" });
        });
        let light = transmittance.unwrap_or(1.0);
        let mut thirds = 6.0 * stops::t_stop(f_stop, light).log2();
        let snap = self.look.thirds;
        let slider = Slider::new(&mut thirds, 0.0..=36.0)
            .clamping(egui::SliderClamping::Never)
            .custom_formatter(move |thirds, _| stop_text((thirds / 6.0).exp2()))
            .custom_parser(|text| {
                let text = text.trim().trim_start_matches(['f', 'F', 't', 'T']).trim_start_matches('/');
                text.parse::<f64>().ok().filter(|stop| *stop > 0.0).map(|stop| 6.0 * stop.log2())
            });
        let response = ui.add(slider);
        response.widget_info(|| egui::WidgetInfo::slider(true, thirds, "f-stop"));
        let response = response
            .on_hover_text("How wide the aperture is: the smaller the number, the blurrier. Keys [ and ].");
        if response.changed() {
            // What is typed stays as it is; what is dragged goes in thirds.
            let snapped = if snap && response.dragged() { thirds.round() } else { thirds };
            self.change(Quantity::FStop, stops::from_t_stop((snapped / 6.0).exp2(), light));
        }
        ui.horizontal(|ui| {
            ui.checkbox(&mut self.look.thirds, "thirds").on_hover_text("Drag in thirds of a stop.");
            let mut t_stops = transmittance.is_some();
            let hint = "Show T-stops: the light that comes through. The blur is the f-stop's all the same.";
            if ui.checkbox(&mut t_stops, "T-stop").on_hover_text(hint).changed() {
                self.look.transmittance = t_stops.then_some(0.85);
            }
            if let Some(light) = &mut self.look.transmittance {
                let drag = egui::DragValue::new(light).range(0.1..=1.0).speed(0.01).max_decimals(2);
                ui.add(drag).on_hover_text("The part of the light that the lens lets through.");
            }
        });
    }

    fn focal_control(&mut self, ui: &mut Ui, values: &LensValues) {
        let Some(mut focal) = values.focal_mm else { return };
        ui.horizontal(|ui| {
            self.keyed(ui, Quantity::FocalLength, focal);
            ui.label("Focal length");
        });
        let slider = Slider::new(&mut focal, 8.0..=400.0)
            .logarithmic(true)
            .suffix(" mm")
            .max_decimals(1)
            .clamping(egui::SliderClamping::Never);
        let response = ui.add(slider);
        response.widget_info(|| egui::WidgetInfo::slider(true, focal, "Focal length"));
        let hint = "The lens's focal length: the longer, the blurrier. The picture's frame stays as it was rendered.";
        if response.on_hover_text(hint).changed() && focal > 0.0 {
            self.change(Quantity::FocalLength, focal);
        }
    }

    fn sensor_control(&mut self, ui: &mut Ui, values: &LensValues) {
        let Some(mut width) = values.sensor_mm else { return };
        let before = width;
        ui.horizontal(|ui| {
            ui.label("Sensor");
            let drag = egui::DragValue::new(&mut width).range(1.0..=200.0).speed(0.1).suffix(" mm");
            ui.add(drag).on_hover_text(
                "Width of the sensor (film back): the narrower, the blurrier at the same lens.",
            );
        });
        let name = sensor::find(width).map_or("Sensors by name", |sensor| sensor.name);
        egui::ComboBox::from_id_salt("sensor")
            .selected_text(name)
            .width(WIDTH - 40.0)
            .show_ui(ui, |ui| {
                for sensor in SENSORS {
                    let text = format!("{}  ({} mm)", sensor.name, sensor.width_mm);
                    ui.selectable_value(&mut width, sensor.width_mm, text);
                }
            })
            .response
            .on_hover_text("Usual sensors by name; one of them sets the width.");
        if width != before {
            let front = self.front();
            let lens = &mut self.document.takes[front].lens;
            lens.sensor_width = Some(Number(width));
            if lens.focal_length.is_some() {
                lens.fov_x = None;
            }
        }
    }

    /// Near and far limit of focus, and the hyperfocal distance.
    fn readout(&mut self, ui: &mut Ui) {
        let Some(plate) = &self.plate else { return };
        let Ok(resolved) = self.document.lens(self.front(), plate, self.frame_number()) else { return };
        let (units, sharp) = (self.look.units(), self.look.sharp_px);
        let frame = &plate.scene.frame;
        let lens = resolved.camera.lens();
        let text = |metres: f64| {
            let shown = if self.look.from == From::SensorPlane {
                focus::to_sensor_plane(&lens, metres)
            } else {
                metres
            };
            distance::format(shown, units)
        };
        let [near, far] = focus::limits(&resolved.camera, frame, sharp);
        let hyperfocal = focus::hyperfocal_m(&resolved.camera, frame, sharp);
        let (near, far, hyperfocal) = (text(near), text(far), text(hyperfocal));
        egui::Grid::new("readout").num_columns(2).show(ui, |ui| {
            ui.label("In focus");
            ui.label(format!("{near} to {far}"))
                .on_hover_text("Nearest and farthest distance at which the picture is sharp.");
            ui.end_row();
            ui.label("Hyperfocal");
            ui.label(hyperfocal)
                .on_hover_text("Focused here, everything from half of it to infinity is sharp.");
            ui.end_row();
            ui.label("Sharp up to");
            let drag =
                egui::DragValue::new(&mut self.look.sharp_px).range(0.2..=20.0).speed(0.05).suffix(" px");
            ui.add(drag).on_hover_text(
                "Diameter of the circle of confusion that still counts as sharp, in the picture's pixels.",
            );
            ui.end_row();
        });
    }

    fn blur_controls(&mut self, ui: &mut Ui) {
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
                    // A preset is a whole; what was chosen over it goes.
                    *blur = pullfocus_job::options::Blur {
                        preset: Some(name),
                        aperture: None,
                        bokeh_threshold: blur.bokeh_threshold,
                        channels: blur.channels.clone(),
                        device: blur.device.clone(),
                        gpu_storage: blur.gpu_storage,
                        ..Default::default()
                    };
                }
            }
        });
        let usual = if preset == PresetName::Preview { MethodName::Diffusion } else { MethodName::Aperture };
        let mut method = blur.method.unwrap_or(usual);
        let methods = [
            (MethodName::Aperture, "Aperture"),
            (MethodName::Diffusion, "Diffusion"),
            (MethodName::Pyramid, "Pyramid"),
            (MethodName::Tensor, "Tensor"),
            (MethodName::Square, "Square"),
            (MethodName::Gather, "Gather (slow)"),
            (MethodName::Naive, "Naive (slow)"),
        ];
        ui.horizontal(|ui| {
            ui.label("Method");
            let name = methods.iter().find(|(known, _)| *known == method).map_or("", |(_, name)| name);
            let before = method;
            egui::ComboBox::from_id_salt("method").selected_text(name).show_ui(ui, |ui| {
                for (choice, name) in methods {
                    ui.selectable_value(&mut method, choice, name);
                }
            })
            .response
            .on_hover_text("How each layer is blurred. Aperture is nearest to a lens; the others are there to compare.");
            if method != before {
                // Options of one method are none of another's.
                *blur = pullfocus_job::options::Blur {
                    preset: blur.preset,
                    method: (method != usual).then_some(method),
                    layering: blur.layering,
                    layers: blur.layers,
                    bokeh_threshold: blur.bokeh_threshold,
                    channels: blur.channels.clone(),
                    device: blur.device.clone(),
                    gpu_storage: blur.gpu_storage,
                    ..Default::default()
                };
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
            if ui.checkbox(&mut lights, "Highlights").on_hover_text(hint).changed() {
                blur.bokeh_threshold = lights.then_some(Number(2.0));
                if !lights {
                    (blur.bokeh_gain, blur.bokeh_knee, blur.bokeh_least, blur.cats_eye) =
                        (None, None, None, None);
                }
            }
            if let Some(Number(threshold)) = &mut blur.bokeh_threshold {
                let drag = egui::DragValue::new(threshold).range(0.05..=1000.0).speed(0.02).prefix("from ");
                ui.add(drag).on_hover_text("Brightness from which light is a highlight; 1 is white.");
            }
        });
        let shaped = method == MethodName::Aperture || lights;
        if shaped {
            let mut blades = match blur.aperture {
                Some(Shape::Blades(count)) => count,
                _ => 0,
            };
            let slider = Slider::new(&mut blades, 0..=12)
                .text("blades")
                .custom_formatter(|count, _| if count < 3.0 { "disc".into() } else { format!("{count}") })
                .custom_parser(|text| if text == "disc" { Some(0.0) } else { text.parse().ok() });
            if ui.add(slider).on_hover_text("Blades of the iris: the shape of lights out of focus.").changed()
            {
                blur.aperture = (blades >= 3).then_some(Shape::Blades(blades));
                if blades < 3 {
                    blur.aperture_roundness = None;
                }
            }
        }
    }

    fn view_controls(&mut self, ui: &mut Ui) {
        ui.heading("View");
        ui.horizontal_wrapped(|ui| {
            for view in View::ALL {
                let (name, hint) = view.text();
                let there = match view {
                    View::Reference | View::Difference => self.reference.is_some(),
                    _ => true,
                };
                let chosen = self.look.left == view;
                let response =
                    ui.add_enabled(there, egui::Button::selectable(chosen, name)).on_hover_text(hint);
                if response.clicked() {
                    self.look.left = view;
                }
            }
        });
        ui.horizontal(|ui| {
            let mut wipes = self.look.right.is_some();
            if ui
                .checkbox(&mut wipes, "Wipe to")
                .on_hover_text("Show another view right of a border.")
                .changed()
            {
                self.look.right = wipes.then_some(View::Pinhole);
            }
            if let Some(right) = &mut self.look.right {
                egui::ComboBox::from_id_salt("right")
                    .selected_text(right.text().0)
                    .show_ui(ui, |ui| {
                        for view in View::ALL {
                            ui.selectable_value(right, view, view.text().0);
                        }
                    })
                    .response
                    .on_hover_text("What is shown right of the border.");
            }
        });
        ui.horizontal(|ui| {
            let mut alone = self.look.layer.is_some();
            let hint = "Show one layer of the composite alone, over nothing.";
            if ui.checkbox(&mut alone, "Layer alone").on_hover_text(hint).changed() {
                self.look.layer = alone.then_some(0);
            }
            if let Some(layer) = &mut self.look.layer {
                let count =
                    self.engine.state().shown[0].as_ref().map_or(1, |shown| shown.report.layers.max(1));
                let most = if self.engine.on_gpu { 16 } else { count as u32 - 1 };
                ui.add(egui::DragValue::new(layer).range(0..=most))
                    .on_hover_text("Its number; 0 is the farthest.");
                ui.checkbox(&mut self.look.matte, "Matte")
                    .on_hover_text("How much the layer covers of what is behind it, in place of its colour.");
            }
        });
        let hint = "How strongly the circle of confusion lies over the picture: front red, in focus green, behind blue.";
        ui.add(Slider::new(&mut self.look.overlay, 0.0..=1.0).text("overlay")).on_hover_text(hint);
        ui.add(Slider::new(&mut self.look.exposure, -8.0..=8.0).text("stops").max_decimals(1))
            .on_hover_text("Exposure of the screen alone; what is rendered stays.");
        ui.horizontal(|ui| {
            for transform in Transform::ALL {
                let (name, hint) = transform.text();
                ui.selectable_value(&mut self.look.transform, transform, name).on_hover_text(hint);
            }
        });
        self.color_controls(ui);
        let state = self.engine.state();
        if let Some(comparison) = &state.comparison {
            ui.label(format!("FLIP {:.4}, PSNR {:.2} dB", comparison.flip, comparison.psnr))
                .on_hover_text("Take A beside the reference: FLIP 0 and a high PSNR mean alike.");
        }
    }
}

/// A stop as it is engraved, or with two digits where none is.
fn stop_text(stop: f64) -> String {
    let near = stops::nearest(stop);
    let mark = stops::mark(near);
    // Engraved numbers are rounded: 2.8 is not quite the third that it stands for.
    let is_third = (6.0 * (stop / stops::third(near)).log2()).abs() < 0.02;
    let is_mark = mark.parse::<f64>().is_ok_and(|engraved| (stop / engraved - 1.0).abs() < 1e-3);
    if is_third || is_mark { mark } else { format!("{stop:.2}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stops_are_told_as_they_are_engraved() {
        for (stop, text) in [(2.8, "2.8"), (stops::third(9), "2.8"), (2.0, "2"), (3.0, "3.00"), (5.6, "5.6")]
        {
            assert_eq!(stop_text(stop), text);
        }
    }
}
