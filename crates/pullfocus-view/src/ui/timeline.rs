//! The shot in time: frames, keys, the lens as curves. Keys are those of the take in front.

use super::App;
use super::keyboard::Action;
use crate::document::{Quantity, of};
use eframe::egui::{self, Color32, Pos2, Rect, Sense, Stroke, Ui, Vec2};
use pullfocus_core::focus::distance;
use pullfocus_core::pull::{Easing, Pull};

/// Height of the strip.
const HEIGHT: f32 = 64.0;

/// How a quantity that has keys is drawn.
struct Curve {
    quantity: Quantity,
    /// Of the keys, as [`Curve::measure`] has it.
    low: f64,
    high: f64,
}

impl Curve {
    /// None where no key says anything of the quantity.
    fn of(keys: &Pull, quantity: Quantity) -> Option<Self> {
        let values: Vec<f64> =
            keys.keys().iter().filter_map(|key| Some(Self::measure(quantity, of(key, quantity)?))).collect();
        let low = values.iter().copied().reduce(f64::min)?;
        let high = values.iter().copied().reduce(f64::max)?;
        Some(Self { quantity, low, high })
    }

    /// What moves evenly: dioptres, and stops.
    fn measure(quantity: Quantity, value: f64) -> f64 {
        match quantity {
            Quantity::FocusDistance => 1.0 / value,
            Quantity::FStop | Quantity::FocalLength => value.log2(),
        }
    }

    /// Where a value is, 0 to 1: near, narrow and long are up.
    fn height(&self, value: f64) -> f32 {
        let span = self.high - self.low;
        if span <= 0.0 {
            return 0.5;
        }
        ((Self::measure(self.quantity, value) - self.low) / span).clamp(0.0, 1.0) as f32
    }

    /// Its value at a frame.
    fn at(&self, keys: &Pull, frame: f64) -> Option<f64> {
        let moment = keys.at(frame);
        match self.quantity {
            Quantity::FocusDistance => moment.focus_distance_m,
            Quantity::FStop => moment.f_stop,
            Quantity::FocalLength => moment.focal_length_mm,
        }
    }

    fn name(&self) -> &'static str {
        match self.quantity {
            Quantity::FocusDistance => "focus",
            Quantity::FStop => "f-stop",
            Quantity::FocalLength => "focal length",
        }
    }

    fn hint(&self) -> &'static str {
        match self.quantity {
            Quantity::FocusDistance => "Near is up.",
            Quantity::FStop => "A small aperture is up.",
            Quantity::FocalLength => "Long is up.",
        }
    }

    fn color(&self) -> Color32 {
        match self.quantity {
            Quantity::FocusDistance => Color32::from_rgb(60, 165, 85),
            Quantity::FStop => Color32::from_rgb(220, 130, 40),
            Quantity::FocalLength => Color32::from_rgb(165, 110, 225),
        }
    }
}

impl App {
    pub(super) fn timeline(&mut self, ui: &mut Ui) {
        let (first, last) = self.frame_range();
        let mut action = None;
        ui.horizontal(|ui| {
            for (name, does, hint) in [
                ("First", Action::First, "First frame (Home)."),
                ("Back", Action::Before, "One frame back (Left)."),
                (
                    if self.playing.is_some() { "Stop" } else { "Play" },
                    Action::Play,
                    "Play in real time, or stop (P).",
                ),
                ("On", Action::After, "One frame on (Right)."),
                ("Last", Action::Last, "Last frame (End)."),
            ] {
                let response = ui.button(name).on_hover_text(hint);
                if response.clicked() {
                    action = Some(does);
                }
            }
            let mut frame = self.frame_number();
            let drag = egui::DragValue::new(&mut frame).range(first..=last);
            if ui.add(drag).on_hover_text("The frame in front.").changed() && self.clip.is_some() {
                self.playing = None;
                self.go_to(frame);
            }
            ui.label(format!("{first}–{last}"));
            let fps = egui::DragValue::new(&mut self.look.fps).range(1.0..=120.0).suffix(" fps");
            ui.add(fps).on_hover_text("Frames a second while playing.");
            ui.separator();
            if ui.button("Key").on_hover_text("Key the lens as it is at this frame (K).").clicked() {
                action = Some(Action::KeyHere);
            }
            self.key_controls(ui);
            let is_still = self.clip.as_ref().is_some_and(|clip| clip.is_still());
            if is_still || self.clip.as_ref().is_some_and(|clip| clip.is_held()) {
                ui.separator();
                let (name, seconds, hint) = if is_still {
                    ("Hold the still", Some(2.0), "Hold this picture for two seconds, to pull focus on it.")
                } else {
                    ("Release", None, "Back to one picture; keys stay in the shot.")
                };
                if ui.button(name).on_hover_text(hint).clicked() {
                    self.hold(seconds);
                }
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                for curve in self.curves().iter().rev() {
                    let text = egui::RichText::new(curve.name()).small().color(curve.color());
                    ui.label(text).on_hover_text(curve.hint());
                }
            });
        });
        self.strip(ui, first, last);
        if let Some(action) = action {
            self.act(action);
        }
    }

    /// What has keys in the take in front.
    fn curves(&self) -> Vec<Curve> {
        let keys = &self.document.takes[self.front()].keys;
        Quantity::ALL.iter().filter_map(|&quantity| Curve::of(keys, quantity)).collect()
    }

    fn key_controls(&mut self, ui: &mut Ui) {
        let chosen = self.selected_key.and_then(|frame| {
            let keys = &self.document.takes[self.front()].keys;
            keys.keys().iter().find(|key| key.frame == frame).copied()
        });
        let Some(key) = chosen else {
            self.selected_key = None;
            ui.weak("No key is chosen.");
            return;
        };
        let units = self.look.units();
        let values = [
            key.focus_distance_m.map(|metres| distance::format(self.measured(metres), units)),
            key.f_stop.map(|f_stop| format!("f/{f_stop:.1}")),
            key.focal_length_mm.map(|focal| format!("{focal:.0} mm")),
        ];
        let values: Vec<String> = values.into_iter().flatten().collect();
        ui.label(format!("Key at {}: {}", key.frame, values.join(", ")));
        let mut easing = key.easing;
        egui::ComboBox::from_id_salt("easing")
            .selected_text(format!("{easing:?}"))
            .width(70.0)
            .show_ui(ui, |ui| {
                for (choice, hint) in [
                    (Easing::Smooth, "Starts and ends slowly."),
                    (Easing::Linear, "Evenly."),
                    (Easing::In, "Starts slowly."),
                    (Easing::Out, "Ends slowly."),
                    (Easing::Hold, "Stays, and jumps at the next key."),
                ] {
                    ui.selectable_value(&mut easing, choice, format!("{choice:?}")).on_hover_text(hint);
                }
            })
            .response
            .on_hover_text("How the lens goes on from this key to the next one.");
        if easing != key.easing {
            self.document.set_easing(self.front(), key.frame, easing);
        }
        if ui.button("Remove").on_hover_text("Remove this key (Delete).").clicked() {
            self.document.remove_key(self.front(), key.frame);
            self.selected_key = None;
        }
    }

    fn strip(&mut self, ui: &mut Ui, first: i64, last: i64) {
        let (rect, response) =
            ui.allocate_exact_size(Vec2::new(ui.available_width(), HEIGHT), Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, "Timeline"));
        let response =
            response.on_hover_text("Click or drag to go to a frame; drag a diamond to move its key.");
        let inner = rect.shrink2(Vec2::new(10.0, 4.0));
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
        let span = (last - first).max(1) as f32;
        let x = move |frame: f64| inner.left() + (frame - first as f64) as f32 / span * inner.width();
        let frame_at = move |x: f32| first as f64 + f64::from((x - inner.left()) / inner.width() * span);
        // Frames in memory.
        if let Some(clip) = self.clip.clone() {
            let shelf = self.loader.shelf();
            for index in 0..clip.len() {
                let source = clip.source(index);
                let color = if shelf.has(source) {
                    Color32::from_rgb(60, 130, 200)
                } else if shelf.faults.contains_key(&source) {
                    Color32::from_rgb(200, 60, 50)
                } else {
                    continue;
                };
                let at = x(clip.number(index) as f64);
                let width = (inner.width() / (span + 1.0)).clamp(1.0, 8.0);
                painter.rect_filled(
                    Rect::from_center_size(Pos2::new(at, inner.bottom()), Vec2::new(width, 3.0)),
                    0.0,
                    color,
                );
            }
        }
        let keys = self.document.takes[self.front()].keys.clone();
        let curves = self.curves();
        let y = |part: f32| inner.bottom() - 8.0 - part * (inner.height() - 16.0);
        for curve in &curves {
            let points: Vec<Pos2> = (0..=200)
                .filter_map(|i| {
                    let frame = first as f64 + f64::from(i) / 200.0 * f64::from(span);
                    Some(Pos2::new(x(frame), y(curve.height(curve.at(&keys, frame)?))))
                })
                .collect();
            painter.line(points, Stroke::new(1.5, curve.color()));
        }
        let now = x(self.frame_number() as f64);
        painter.vline(now, rect.y_range(), Stroke::new(2.0, ui.visuals().selection.bg_fill));
        // Keys, to be chosen and moved.
        let mut over_key = false;
        for key in keys.keys() {
            let heights: Vec<f32> =
                curves.iter().filter_map(|curve| Some(curve.height(of(key, curve.quantity)?))).collect();
            for &height in heights.iter().skip(1) {
                let center = Pos2::new(x(key.frame), y(height));
                painter.circle_filled(center, 2.5, ui.visuals().strong_text_color());
            }
            let center = Pos2::new(x(key.frame), y(heights.first().copied().unwrap_or(0.5)));
            let area = Rect::from_center_size(center, Vec2::splat(16.0));
            let id = ui.scope_id().with(("key", key.frame.to_bits()));
            let response = ui.interact(area, id, Sense::click_and_drag());
            let label = format!("Key at {}", key.frame);
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, label.clone()));
            let response = response.on_hover_text(label.clone());
            over_key |= response.hovered() || response.dragged();
            let chosen = self.selected_key == Some(key.frame);
            let color =
                if chosen { Color32::from_rgb(255, 200, 60) } else { ui.visuals().strong_text_color() };
            let diamond =
                [[0.0, -6.0], [6.0, 0.0], [0.0, 6.0], [-6.0, 0.0]].map(|[x, y]| center + Vec2::new(x, y));
            painter.add(egui::Shape::convex_polygon(diamond.to_vec(), color, Stroke::NONE));
            if response.clicked() || response.drag_started() {
                self.selected_key = Some(key.frame);
            }
            if response.clicked() {
                self.playing = None;
                self.go_to(key.frame.round() as i64);
            }
            if response.drag_stopped()
                && let Some(pointer) = response.interact_pointer_pos()
            {
                let to = frame_at(pointer.x).round().clamp(first as f64, last as f64);
                self.document.move_key(self.front(), key.frame, to);
                self.selected_key = Some(to);
            }
        }
        if !over_key
            && (response.clicked() || response.dragged())
            && let Some(pointer) = response.interact_pointer_pos()
        {
            self.playing = None;
            self.go_to(frame_at(pointer.x).round() as i64);
        }
    }
}
