//! What is told: the menu, the line at the bottom, the pixel under the cursor, the histogram of depth.

use super::keyboard::Action;
use super::{App, MESSAGE};
use crate::engine::Probe;
use eframe::egui::{self, Color32, Rect, Sense, Ui, Vec2};
use pullfocus_core::focus::{self, distance};

impl App {
    pub(super) fn menu(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            let mut action = None;
            for (name, does, hint) in [
                ("Open…", Action::Open, "A picture, a sequence or a shot."),
                (
                    "Save shot",
                    Action::Save,
                    "Keep lens, settings and keys in a small file that `pullfocus render --shot` renders.",
                ),
                ("Undo", Action::Undo, "Take the last change back."),
                ("Redo", Action::Redo, "Make it again."),
            ] {
                if ui.button(name).on_hover_text(hint).clicked() {
                    action = Some(does);
                }
            }
            if ui
                .button("Render…")
                .on_hover_text(
                    "Render the shot, pictures or a movie of the result, or the moving lens, to files.",
                )
                .clicked()
            {
                self.windows.export = true;
            }
            if ui.button("Reference…").on_hover_text("Choose a picture to compare with.").clicked() {
                self.reference_window();
            }
            if ui.button("Keys").on_hover_text("The sheet of keyboard shortcuts (F1).").clicked() {
                action = Some(Action::Shortcuts);
            }
            let dark = ui.visuals().dark_mode;
            if ui
                .button(if dark { "Light" } else { "Dark" })
                .on_hover_text("Change the window's colours.")
                .clicked()
            {
                self.session.dark = Some(!dark);
                self.keep_session();
                ui.ctx().set_theme(if dark { egui::Theme::Light } else { egui::Theme::Dark });
            }
            if let Some(clip) = &self.clip {
                ui.separator();
                ui.label(&clip.name);
            }
            if let Some(action) = action {
                self.act(action);
            }
        });
    }

    pub(super) fn status(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            ui.set_height(20.0);
            let (reading, fault) = {
                let shelf = self.loader.shelf();
                let index = self.clip.as_ref().map(|clip| clip.nearest(self.frame as f64));
                (shelf.reading.clone(), index.and_then(|index| shelf.faults.get(&index).cloned()))
            };
            let is_reading = reading.is_some();
            if let Some(name) = reading {
                ui.spinner();
                ui.label(format!("Reading {name}"));
                if ui.small_button("Cancel").on_hover_text("Stop reading.").clicked() {
                    self.loader.cancel();
                }
            }
            let (state_fault, busy, note, stages) = {
                let state = self.engine.state();
                let shown = state.shown[self.front()].as_ref();
                let stages = shown.map(|shown| {
                    let ms = |time: std::time::Duration| format!("{:.1}", 1e3 * time.as_secs_f64());
                    let each: Vec<String> = shown
                        .report
                        .stages
                        .iter()
                        .map(|stage| format!("{} {}", stage.name, ms(stage.time)))
                        .collect();
                    let size =
                        if shown.reduced > 1 { format!(" at 1/{}", shown.reduced) } else { String::new() };
                    (format!("{} ms{size} on {}", ms(shown.time), shown.device), each.join(", "))
                });
                (state.fault.clone(), state.busy, state.note.clone(), stages)
            };
            let message = self
                .message
                .as_ref()
                .filter(|(_, since)| since.elapsed() < MESSAGE)
                .map(|(text, _)| text.clone());
            if message.is_some() {
                ui.ctx().request_repaint_after(MESSAGE);
            }
            let lens_fault = self.lens_faults.iter().flatten().next().cloned();
            if let Some(text) = fault.or(lens_fault).or(state_fault).or(message) {
                ui.label(egui::RichText::new(text.clone()).strong()).on_hover_text(text);
                return;
            }
            if is_reading {
                return;
            }
            // The right end first: what is left is the stages', shortened where it is not enough.
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let text =
                    if note.is_some() { "CPU (this time)".into() } else { self.engine.device_text.clone() };
                let hint = note.unwrap_or_else(|| {
                    "What renders. Without a GPU pictures are smaller while something moves.".into()
                });
                ui.label(text)
                    .on_hover_text(format!("{hint} The window is drawn by {}.", self.engine.window_device));
                ui.separator();
                // Its place is kept, so that nothing moves when it comes and goes.
                let (place, _) = ui.allocate_exact_size(Vec2::splat(14.0), Sense::hover());
                if busy {
                    egui::Spinner::new().paint_at(ui, place);
                }
                let Some((total, stages)) = stages else { return };
                ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                    ui.label(total).on_hover_text("How long the last picture took.");
                    ui.separator();
                    let hint = format!("Each stage, in milliseconds: {stages}");
                    ui.add(egui::Label::new(stages).truncate()).on_hover_text(hint);
                });
            });
        });
    }

    /// The pixel under the cursor, and the histogram.
    pub(super) fn inspector(&mut self, ui: &mut Ui) {
        ui.heading("Pixel");
        let Some(plate) = self.plate.clone() else { return };
        let units = self.look.units();
        let frame = self.frame_number();
        // The pointer was over the frame before, which may have been larger.
        let hovered = self.hovered.filter(|(at, _)| plate.has_pixel(*at));
        let side = hovered.map_or(self.front(), |(_, side)| side);
        let take = self.document.take(side, &plate, frame).ok();
        let curve = take.and_then(|take| take.curve(&plate.scene.frame));
        let mut rows: [(&str, String); 5] = [
            ("at", "–".into()),
            ("pinhole", "–".into()),
            ("result", "–".into()),
            ("depth", "–".into()),
            ("circle", "–".into()),
        ];
        if let Some(([x, y], side)) = hovered {
            let color: Vec<String> =
                plate.colors_at(x, y).into_iter().map(|value| format!("{value:.3}")).collect();
            let [column, row] = plate.coordinates([x, y]);
            rows[0].1 = format!("{column}, {row}");
            rows[1].1 = color.join(" ");
            let probe = Probe { side, at: [x, y] };
            self.engine.probe(probe.clone());
            let probed = self.engine.state().probed.clone();
            if let Some((_, [r, g, b, _])) = probed.filter(|(known, _)| *known == probe) {
                rows[2].1 = format!("{r:.3} {g:.3} {b:.3}");
            }
            let depth = plate.depth_at(x, y);
            if !plate.has_coc {
                rows[3].1 =
                    depth.map_or_else(|| "nothing there".into(), |metres| distance::format(metres, units));
            }
            if let Some(curve) = curve {
                let circle = if plate.has_coc {
                    curve.adjust(f64::from(plate.distances().plane.at(x, y)))
                } else {
                    curve.diameter(depth.unwrap_or(f64::INFINITY))
                };
                rows[4].1 = format!("{circle:+.2} px");
            }
        }
        egui::Grid::new("pixel").num_columns(2).min_col_width(60.0).show(ui, |ui| {
            for (name, value) in rows {
                ui.label(name);
                ui.monospace(value);
                ui.end_row();
            }
        });
        self.histogram(ui);
    }

    /// How much of the picture is how far away, and what of it is in focus.
    fn histogram(&mut self, ui: &mut Ui) {
        let Some(plate) = self.plate.clone() else { return };
        let distances = plate.distances();
        let histogram = &distances.histogram;
        if histogram.range.is_none() {
            return;
        }
        ui.label("Distances").on_hover_text(
            "How much of the picture is how far away; what is in focus is green. Click to focus.",
        );
        let (rect, response) =
            ui.allocate_exact_size(Vec2::new(ui.available_width(), 60.0), Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Histogram of depth"));
        let response =
            response.on_hover_text("How much is how far away. Click or drag to focus at that distance.");
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
        let x = |place: f64| rect.left() + rect.width() * place.clamp(0.0, 1.0) as f32;
        if let Ok(resolved) = self.document.lens(self.front(), &plate, self.frame_number()) {
            let [near, far] = focus::limits(&resolved.camera, &plate.scene.frame, self.look.sharp_px);
            if let (Some(near), Some(far)) = (histogram.place(near), histogram.place(far)) {
                let range = Rect::from_x_y_ranges(x(near)..=x(far).max(x(near) + 1.0), rect.y_range());
                painter.rect_filled(range, 0.0, Color32::from_rgba_unmultiplied(40, 200, 70, 110));
            }
        }
        let most = histogram.bars.iter().copied().max().unwrap_or(1).max(1) as f32;
        let width = rect.width() / histogram.bars.len() as f32;
        for (i, &count) in histogram.bars.iter().enumerate() {
            // The root, so that small things are seen beside large ones.
            let height = (count as f32 / most).sqrt() * (rect.height() - 4.0);
            let left = rect.left() + i as f32 * width;
            let bar = Rect::from_min_max(
                [left, rect.bottom() - height].into(),
                [left + width, rect.bottom()].into(),
            );
            painter.rect_filled(bar, 0.0, ui.visuals().text_color());
        }
        if let Some(pointer) =
            response.interact_pointer_pos().filter(|_| response.clicked() || response.dragged())
        {
            let place = f64::from((pointer.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
            if let Some(metres) = histogram.distance(place) {
                self.change(crate::document::Quantity::FocusDistance, metres);
            }
        }
        ui.horizontal(|ui| {
            let units = self.look.units();
            let [near, far] = histogram.range.unwrap_or_default();
            ui.small(distance::format(near, units));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.small(distance::format(far, units))
            });
        });
    }
}
