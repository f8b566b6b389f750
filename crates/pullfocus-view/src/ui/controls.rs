//! The lens, how the blur is made, and how it is looked at.

mod blur;

use super::App;
use super::color::named;
use super::keyboard::Action;
use crate::document::{LensValues, Quantity};
use crate::look::{From, View};
use crate::screen::Transform;
use eframe::egui::{self, Slider, SliderClamping, Ui};
use pullfocus_core::focus::distance::{self, Units};
use pullfocus_core::focus::{self, stops};
use pullfocus_core::sensor::{self, SENSORS};
use pullfocus_job::values::Number;

/// Width of the panel, so that nothing moves when a value grows longer.
pub const WIDTH: f32 = 330.0;

/// Why some views are not to be had.
const NO_REFERENCE: &str = "No picture to compare with is open: choose one with Reference… above.";
const NO_DEPTH: &str = "The file holds circles of confusion, and no depth.";

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
                    self.bring_to_front(if side == 1 { View::Other } else { View::Result });
                }
            }
            let (name, hint) = [
                ("A to B", "Make take B what take A is now."),
                ("B to A", "Make take A, which is the shot that is saved and rendered, what take B is now."),
            ][front];
            if ui.small_button(name).on_hover_text(hint).clicked() {
                self.undo.add_undo(&self.document);
                self.document.takes[1 - front] = self.document.takes[front].clone();
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

    /// A distance from the entrance pupil as the window tells distances: from there, or from the sensor.
    pub(super) fn measured(&self, metres: f64) -> f64 {
        let resolved = || {
            let plate = self.plate.as_ref().filter(|_| self.look.from == From::SensorPlane)?;
            self.document.lens(self.front(), plate, self.frame_number()).ok()
        };
        resolved().map_or(metres, |resolved| focus::to_sensor_plane(&resolved.camera.lens(), metres))
    }

    /// A quantity's diamond: whether it has keys.
    fn keyed(&mut self, ui: &mut Ui, quantity: Quantity, value: f64) {
        let keyed = self.document.is_keyed(self.front(), quantity);
        let hint =
            if keyed { "Take this value's keys away." } else { "Let this value move: key it at this frame." };
        let response = ui.selectable_label(keyed, "key").on_hover_text(hint);
        if response.clicked() && (keyed || self.may_key()) {
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
        // None where it cannot be; the field is the way out.
        let lens = lens.map(|resolved| resolved.camera.lens());
        let mut value = self.measured(values.focus_m);
        // What the field showed when it was entered: its text is read more than once.
        let entered = egui::Id::unique("focus distance entered");
        let before = ui.data(|data| data.get_temp(entered)).unwrap_or(value);
        let [near, far] =
            self.plate.as_ref().and_then(|plate| plate.distances().histogram.range).unwrap_or([0.3, 30.0]);
        ui.horizontal(|ui| {
            self.keyed(ui, Quantity::FocusDistance, values.focus_m);
            ui.label("Focus distance");
        });
        let slider = Slider::new(&mut value, 0.3 * near..=f64::INFINITY)
            .logarithmic(true)
            .largest_finite(3.0 * far)
            .clamping(SliderClamping::Never)
            .custom_formatter(move |metres, _| distance::format(metres, units))
            .update_while_editing(false)
            .custom_parser(move |text| typed(text, before, units));
        let response = ui.add(slider);
        if response.gained_focus() || !(response.has_focus() || response.lost_focus()) {
            ui.data_mut(|data| data.insert_temp(entered, value));
        }
        response.widget_info(|| egui::WidgetInfo::slider(true, value, "Focus distance"));
        let response = response.on_hover_text(
            "What is sharp. Click on the picture to focus there. Type 2.5, 320 cm, 10' 6\" or inf.",
        );
        if response.changed() {
            let metres = match (from, &lens) {
                (From::SensorPlane, Some(lens)) => focus::from_sensor_plane(lens, value),
                _ => Some(value),
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
            let front = self.front();
            let diameter = &mut self.document.takes[front].lens.aperture_diameter;
            if let Some(Number(metres)) = diameter {
                let mut mm = *metres * 1e3;
                ui.label("Aperture diameter");
                let slider = Slider::new(&mut mm, 0.0..=200.0)
                    .suffix(" mm")
                    .logarithmic(true)
                    .smallest_positive(0.1)
                    .clamping(SliderClamping::Never);
                let response = ui.add(slider);
                response.widget_info(|| egui::WidgetInfo::slider(true, mm, "Aperture diameter"));
                let hint = "How wide the aperture is: the wider, the blurrier.";
                if response.on_hover_text(hint).changed() && mm >= 0.0 {
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
        let mut stop = stops::t_stop(f_stop, light);
        let snap = self.look.thirds;
        let slider = Slider::new(&mut stop, 1.0..=64.0)
            .logarithmic(true)
            .smart_aim(false)
            .clamping(SliderClamping::Never)
            .custom_formatter(|stop, _| stop_text(stop))
            .custom_parser(|text| {
                let text = text.trim().trim_start_matches(['f', 'F', 't', 'T']).trim_start_matches('/');
                text.parse::<f64>().ok().filter(|stop| *stop > 0.0)
            });
        let response = ui.add(slider);
        response.widget_info(|| egui::WidgetInfo::slider(true, stop, "f-stop"));
        let response = response
            .on_hover_text("How wide the aperture is: the smaller the number, the blurrier. Keys [ and ].");
        if response.changed() {
            // What is typed stays as it is; what is dragged goes in thirds.
            let thirds = (6.0 * stop.log2()).round();
            let snapped = if snap && response.dragged() { (thirds / 6.0).exp2() } else { stop };
            self.change(Quantity::FStop, stops::from_t_stop(snapped, light));
        }
        ui.horizontal(|ui| {
            ui.checkbox(&mut self.look.thirds, "thirds").on_hover_text("Drag in thirds of a stop.");
            let mut t_stops = transmittance.is_some();
            let hint = "Show T-stops: the light that comes through. The blur is the f-stop's all the same.";
            let checkbox = ui.checkbox(&mut t_stops, "T-stop").on_hover_text(hint);
            if checkbox.changed() {
                self.look.transmittance = t_stops.then_some(0.85);
            }
            if let Some(light) = &mut self.look.transmittance {
                let drag = egui::DragValue::new(light).range(0.1..=1.0).speed(0.01).max_decimals(2);
                ui.add(drag)
                    .labelled_by(checkbox.id)
                    .on_hover_text("The part of the light that the lens lets through.");
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
            .clamping(SliderClamping::Never);
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
            let label = ui.label("Sensor");
            let drag = egui::DragValue::new(&mut width)
                .range(0.01..=f64::MAX)
                .clamp_existing_to_range(false)
                .speed(0.1)
                .suffix(" mm");
            ui.add(drag).labelled_by(label.id).on_hover_text(
                "Width of the sensor (film back): the narrower, the blurrier at the same lens.",
            );
        });
        let name = sensor::find(width).map_or("Sensors by name", |sensor| sensor.name);
        let response = egui::ComboBox::from_id_salt("sensor")
            .selected_text(name)
            .width(WIDTH - 40.0)
            .show_ui(ui, |ui| {
                for sensor in SENSORS {
                    let text = format!("{}  ({} mm)", sensor.name, sensor.width_mm);
                    let hint =
                        format!("Blur as on a sensor of {} x {} mm.", sensor.width_mm, sensor.height_mm);
                    ui.selectable_value(&mut width, sensor.width_mm, text).on_hover_text(hint);
                }
            })
            .response;
        named(&response, "Sensors by name", name);
        response.on_hover_text("Usual sensors by name; one of them sets the width.");
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
        let (units, sharp) = (self.look.units(), self.look.sharp_px);
        let text = |metres: f64| distance::format(self.measured(metres), units);
        // Where the lens cannot be, the rows stay where they are.
        let (range, hyperfocal) = match self.document.lens(self.front(), plate, self.frame_number()) {
            Ok(resolved) => {
                let frame = &plate.scene.frame;
                let [near, far] = focus::limits(&resolved.camera, frame, sharp).map(text);
                (format!("{near} to {far}"), text(focus::hyperfocal_m(&resolved.camera, frame, sharp)))
            }
            Err(_) => ("there is no such lens".into(), "–".into()),
        };
        egui::Grid::new("readout").num_columns(2).show(ui, |ui| {
            ui.label("In focus");
            ui.label(range).on_hover_text("Nearest and farthest distance at which the picture is sharp.");
            ui.end_row();
            ui.label("Hyperfocal");
            ui.label(hyperfocal)
                .on_hover_text("Focused here, everything from half of it to infinity is sharp.");
            ui.end_row();
            let label = ui.label("Sharp up to");
            let drag =
                egui::DragValue::new(&mut self.look.sharp_px).range(0.2..=20.0).speed(0.05).suffix(" px");
            ui.add(drag).labelled_by(label.id).on_hover_text(
                "Diameter of the circle of confusion that still counts as sharp, in the picture's pixels.",
            );
            ui.end_row();
        });
    }

    /// Why there is nothing to be seen of a view, if there is nothing.
    pub(super) fn lacks(&self, view: View) -> Option<&'static str> {
        match view {
            View::Reference | View::Difference => self.references.now.is_none().then_some(NO_REFERENCE),
            View::Depth => self.plate.as_ref().is_some_and(|plate| plate.has_coc).then_some(NO_DEPTH),
            _ => None,
        }
    }

    fn view_controls(&mut self, ui: &mut Ui) {
        ui.heading("View");
        ui.horizontal_wrapped(|ui| {
            for view in View::ALL {
                let (name, hint) = view.text();
                let lacks = self.lacks(view);
                let button = egui::Button::selectable(self.look.left == view, name);
                let response = ui.add_enabled(lacks.is_none(), button).on_hover_text(hint);
                if response.on_disabled_hover_text(lacks.unwrap_or_default()).clicked() {
                    self.act(Action::Show(view));
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
            let lacks = View::ALL.map(|view| self.lacks(view));
            if let Some(right) = &mut self.look.right {
                let now = right.text().0;
                let response = egui::ComboBox::from_id_salt("right")
                    .selected_text(now)
                    .show_ui(ui, |ui| {
                        for (view, lacks) in View::ALL.into_iter().zip(lacks) {
                            let (name, hint) = view.text();
                            let button = egui::Button::selectable(*right == view, name);
                            let response = ui.add_enabled(lacks.is_none(), button).on_hover_text(hint);
                            if response.on_disabled_hover_text(lacks.unwrap_or_default()).clicked() {
                                *right = view;
                            }
                        }
                    })
                    .response;
                named(&response, "Right of the border", now);
                response.on_hover_text("What is shown right of the border.");
            }
        });
        ui.horizontal(|ui| {
            let mut alone = self.look.layer.is_some();
            let hint = "Show one layer of the composite alone, over nothing.";
            let checkbox = ui.checkbox(&mut alone, "Layer alone").on_hover_text(hint);
            if checkbox.changed() {
                self.look.layer = alone.then_some(0);
            }
            let front = self.front();
            if let Some(layer) = &mut self.look.layer {
                let count =
                    self.engine.state().shown[front].as_ref().map_or(1, |shown| shown.report.layers.max(1));
                let most = if self.engine.on_gpu { 16 } else { count as u32 - 1 };
                // What was chosen before the first picture is there may be one of its layers.
                ui.add(egui::DragValue::new(layer).range(0..=most).clamp_existing_to_range(false))
                    .labelled_by(checkbox.id)
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
        if self.look.shows(View::Difference) {
            let text = match &self.engine.state().comparison {
                Some(found) => format!("FLIP {:.4}, PSNR {:.2} dB", found.flip, found.psnr),
                None => "FLIP and PSNR are on their way".into(),
            };
            ui.label(text).on_hover_text("Take A beside the reference: FLIP 0 and a high PSNR mean alike.");
        }
    }
}

/// A distance as it is typed into a field that shows another: a number alone has the unit that is shown.
fn typed(text: &str, shown: f64, units: Units) -> Option<f64> {
    let (text, was) = (text.trim(), distance::format(shown, units));
    if text == was {
        // Nothing was typed; what is shown is rounded.
        return Some(shown);
    }
    let alone = text.chars().all(|c| c.is_ascii_digit() || " ./½¼¾".contains(c));
    let unit = match units {
        Units::Metres => ["mm", "cm"].into_iter().find(|unit| was.ends_with(unit)).unwrap_or("m"),
        Units::Feet if was.ends_with('"') && !was.contains('\'') => "\"",
        Units::Feet => "'",
    };
    let text = if alone { format!("{text} {unit}") } else { text.to_owned() };
    distance::parse(&text).ok()
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

    #[test]
    fn a_number_alone_has_the_unit_that_is_shown() {
        for (text, shown, units, metres) in [
            ("8", 3.0, Units::Metres, Some(8.0)),
            ("50", 0.45, Units::Metres, Some(0.5)),
            ("50", 0.045, Units::Metres, Some(0.05)),
            ("2 m", 0.45, Units::Metres, Some(2.0)),
            ("8", 3.0, Units::Feet, Some(8.0 * 0.3048)),
            ("8 1/2", 3.0, Units::Feet, Some(8.5 * 0.3048)),
            ("8 m", 3.0, Units::Feet, Some(8.0)),
            ("8", 0.1, Units::Feet, Some(8.0 * 0.0254)),
            ("5", f64::INFINITY, Units::Metres, Some(5.0)),
            ("5", f64::INFINITY, Units::Feet, Some(5.0 * 0.3048)),
            ("inf", 0.45, Units::Metres, Some(f64::INFINITY)),
            // What stands there already stays to the last digit.
            ("45.1 cm", 0.45123, Units::Metres, Some(0.45123)),
            ("", 3.0, Units::Metres, None),
        ] {
            let found = typed(text, shown, units);
            // A few roundings of a product.
            let near = |a: f64, b: f64| a == b || (a / b - 1.0).abs() < 1e-12;
            let same = match (found, metres) {
                (Some(found), Some(metres)) => near(found, metres),
                (found, metres) => found == metres,
            };
            assert!(same, "{text} beside {shown}: {found:?}");
        }
    }
}
