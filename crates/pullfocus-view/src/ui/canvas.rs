//! The picture: what is drawn, and what a hand does on it.

use super::App;
use crate::clip::Plate;
use crate::document::Quantity;
use crate::engine::OnDevice;
use crate::framing::{Framing, looked_at};
use crate::look::View;
use crate::screen::{Area, Kind, Paint, Side, Texture};
use eframe::egui::{self, Pos2, Rect, Response, Sense, Vec2};
use pullfocus_core::coc::CocCurve;
use pullfocus_core::{CocFormula, Frame};
use std::sync::Arc;

/// Screen points for a pixel, at the least and at the most.
const ZOOMS: [f32; 2] = [0.02, 64.0];

/// Where the picture's pixels lie in the window.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// The window's part.
    pub rect: Rect,
    /// Picture pixel at its upper left corner, counted from the first that the file holds.
    pub origin: [f32; 2],
    /// Picture pixels in a point.
    pub step: [f32; 2],
}

impl Place {
    /// The picture's pixel under a point of the window, parts included.
    pub fn pixel(&self, point: Pos2) -> [f32; 2] {
        let offset = point - self.rect.min;
        [self.origin[0] + self.step[0] * offset.x, self.origin[1] + self.step[1] * offset.y]
    }

    /// The point of the window over a pixel.
    pub fn point(&self, pixel: [f32; 2]) -> Pos2 {
        self.rect.min
            + Vec2::new(
                (pixel[0] - self.origin[0]) / self.step[0],
                (pixel[1] - self.origin[1]) / self.step[1],
            )
    }
}

impl App {
    /// Draws the picture and listens to the hand on it.
    pub(super) fn canvas(&mut self, ui: &mut egui::Ui) {
        let response = ui.allocate_response(ui.available_size(), Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Picture"));
        let Some(plate) = self.plate.clone() else {
            self.place = None;
            self.empty_canvas(ui, response.rect);
            return;
        };
        let frame = &plate.scene.frame;
        let (aspect, framing) = (frame.vertical_scale(), Framing::of(frame));
        let rect = response.rect;
        let [width, height] = framing.size;
        let fit = (rect.width() / (width * aspect)).min(rect.height() / height).max(ZOOMS[0]);
        self.navigate(ui, &response, (framing.middle(), aspect, fit));
        let zoom = self.look.zoom.unwrap_or(fit);
        let center = if self.look.zoom.is_some() { self.look.center } else { framing.middle() };
        let step = [1.0 / (zoom * aspect), 1.0 / zoom];
        let half = [0.5 * rect.width() * step[0], 0.5 * rect.height() * step[1]];
        let origin = [0, 1].map(|axis| framing.origin[axis] + center[axis] - half[axis]);
        let place = Place { rect, origin, step };
        self.place = Some(place);
        self.focus_by_hand(ui, &response, &place);

        let left = self.side(self.look.left, &plate);
        let right = self.side(self.look.right.unwrap_or(self.look.left), &plate);
        let curve = |view: View| {
            let take = self.document.take(self.take_of(view), &plate, self.plate_frame).ok();
            take.and_then(|take| take.curve(&plate.scene.frame)).unwrap_or(NOTHING)
        };
        let curves = [self.look.left, self.look.right.unwrap_or(self.look.left)].map(curve);
        let depth_range = plate.distances().histogram.range.unwrap_or([1.0, 10.0]);
        let paint = Paint {
            rect,
            origin,
            step,
            sides: [left, right],
            wipe: self.look.right.map(|_| self.look.wipe),
            distances: self.on_device(&plate, |frame| frame.distances.clone()),
            are_coc: plate.has_coc,
            coc_range: curves.iter().map(|curve| self.coc_range(&plate, curve)).fold(1.0, f32::max),
            curves,
            depth_range: [depth_range[0] as f32, depth_range[1] as f32],
            overlay: self.look.overlay,
            gain: self.look.exposure.exp2(),
            transform: self.look.transform,
            table: self.table(),
        };
        ui.painter().with_clip_rect(rect).add(self.display.paint(&paint, ui.ctx().pixels_per_point()));
        if frame.data != looked_at(frame) {
            let [x, y] = framing.origin;
            let outline = Rect::from_two_pos(place.point([x, y]), place.point([x + width, y + height]));
            let stroke = egui::Stroke::new(1.0, egui::Color32::from_white_alpha(90));
            ui.painter().with_clip_rect(rect).rect_stroke(outline, 0.0, stroke, egui::StrokeKind::Inside);
        }
        self.labels(ui, rect);
        self.wipe_handle(ui, rect);
        if let (Some((from, _)), Some(to)) = (self.rack_from, response.interact_pointer_pos()) {
            let line = [place.point(from), to];
            ui.painter().line_segment(line, egui::Stroke::new(2.0, egui::Color32::WHITE));
            ui.painter().circle_stroke(line[0], 6.0, egui::Stroke::new(2.0, egui::Color32::WHITE));
        }
        self.hovered = response.hover_pos().and_then(|point| {
            let at = place.pixel(point);
            let at = at.iter().all(|&at| at >= 0.0).then(|| at.map(|at| at as usize))?;
            plate.has_pixel(at).then(|| (at, self.side_at(&place, point)))
        });
    }

    fn empty_canvas(&mut self, ui: &mut egui::Ui, rect: Rect) {
        let mut ui = ui.new_child(egui::UiBuilder::new().max_rect(rect.shrink(24.0)));
        ui.vertical_centered(|ui| {
            ui.add_space(0.3 * rect.height());
            ui.heading("Drop a picture with depth here");
            ui.label("An OpenEXR file, a folder of frames, or a shot (.toml).");
            ui.add_space(8.0);
            if ui.button("Open…").on_hover_text("Choose a picture, a sequence or a shot.").clicked() {
                self.open_window();
            }
            for path in self.session.recent.clone() {
                if ui.link(path.display().to_string()).on_hover_text("Open this file again.").clicked() {
                    self.open_path(&path);
                }
            }
        });
    }

    /// Zoom about the cursor by the wheel or a pinch, pan by the right or the middle button.
    fn navigate(&mut self, ui: &egui::Ui, response: &Response, (whole, aspect, fit): ([f32; 2], f32, f32)) {
        let rect = response.rect;
        if let Some(pointer) = response.hover_pos() {
            let (wheel, pinch) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
            let factor = (wheel * 0.005).exp() * pinch;
            if factor != 1.0 {
                let zoom = self.look.zoom.unwrap_or(fit);
                let center = if self.look.zoom.is_some() { self.look.center } else { whole };
                let new = (zoom * factor).clamp(ZOOMS[0], ZOOMS[1]);
                let from_middle = pointer - rect.center();
                // The pixel under the cursor stays there.
                let shift = 1.0 / zoom - 1.0 / new;
                self.look.center =
                    [center[0] + from_middle.x * shift / aspect, center[1] + from_middle.y * shift];
                self.look.zoom = Some(new);
            }
        }
        let pans = response.dragged_by(egui::PointerButton::Secondary)
            || response.dragged_by(egui::PointerButton::Middle)
            || (response.dragged_by(egui::PointerButton::Primary)
                && ui.input(|input| input.key_down(egui::Key::Space)));
        if pans {
            let zoom = self.look.zoom.unwrap_or(fit);
            let center = if self.look.zoom.is_some() { self.look.center } else { whole };
            let by = response.drag_delta();
            self.look.center = [center[0] - by.x / (zoom * aspect), center[1] - by.y / zoom];
            self.look.zoom = Some(zoom);
        }
    }

    /// A click focuses there; a drag racks from there to wherever the cursor is, with Shift as two keys.
    fn focus_by_hand(&mut self, ui: &egui::Ui, response: &Response, place: &Place) {
        let primary = egui::PointerButton::Primary;
        let (space, shift) = ui.input(|input| (input.key_down(egui::Key::Space), input.modifiers.shift));
        if self.dragging_wipe || space {
            return;
        }
        let pointer = response.interact_pointer_pos();
        if response.drag_started_by(primary)
            && let Some(origin) = ui.input(|input| input.pointer.press_origin())
        {
            self.rack_from = Some((place.pixel(origin), self.side_at(place, origin)));
        }
        if response.clicked_by(primary)
            && let Some(point) = pointer
        {
            self.focus_at(place.pixel(point), self.side_at(place, point));
        }
        if response.dragged_by(primary)
            && let (Some(point), Some((_, side))) = (pointer, self.rack_from)
        {
            self.focus_at(place.pixel(point), side);
        }
        if response.drag_stopped_by(primary) {
            if let (Some((from, side)), Some(point), true) = (self.rack_from, pointer, shift) {
                self.rack(from, place.pixel(point), side);
            }
            self.rack_from = None;
        }
    }

    /// The distance at a pixel, if something is there.
    fn distance_at(&self, pixel: [f32; 2]) -> Option<f64> {
        let [x, y] = pixel;
        if x < 0.0 || y < 0.0 {
            return None;
        }
        self.plate.as_ref()?.depth_to_focus(x as usize, y as usize)
    }

    /// The picture, if it is the frame's in front; else says that it is not there.
    pub(super) fn plate_here(&mut self) -> Option<Arc<Plate>> {
        if self.plate_frame != self.frame_number() {
            self.say(format!(
                "Frame {} is not there yet: this is {}.",
                self.frame_number(),
                self.plate_frame
            ));
            return None;
        }
        self.plate.clone()
    }

    /// One pixel of the picture for one of the screen's, about the middle of what is seen.
    pub(super) fn full_size(&mut self) {
        let Some(plate) = &self.plate else { return };
        if self.look.zoom.is_none() {
            self.look.center = Framing::of(&plate.scene.frame).middle();
        }
        self.look.zoom = Some(1.0 / self.ctx.pixels_per_point());
    }

    /// The take that is looked at there.
    pub(super) fn side_at(&self, place: &Place, point: Pos2) -> usize {
        let border = place.rect.left() + self.look.wipe * place.rect.width();
        let right = self.look.right.filter(|_| point.x >= border);
        self.take_of(right.unwrap_or(self.look.left))
    }

    /// Focuses a take on what is at a pixel; on infinity where nothing is.
    fn focus_at(&mut self, pixel: [f32; 2], side: usize) {
        let Some(plate) = self.plate_here() else { return };
        let size = plate.size();
        let outside = |at: f32, length: usize| at < 0.0 || at >= length as f32;
        if plate.has_coc || outside(pixel[0], size.width) || outside(pixel[1], size.height) {
            return;
        }
        let metres = self.distance_at(pixel).unwrap_or(f64::INFINITY);
        self.change_of(side, Quantity::FocusDistance, metres);
    }

    /// Keys a rack from one pixel here to another a second later, or at the last frame.
    fn rack(&mut self, from: [f32; 2], to: [f32; 2], side: usize) {
        if self.plate_here().is_none_or(|plate| plate.has_coc) || !self.may_key() {
            return;
        }
        let [from, to] = [from, to].map(|pixel| self.distance_at(pixel).unwrap_or(f64::INFINITY));
        let (first, last) = self.frame_range();
        let start = self.frame_number();
        let end = (start + self.look.fps.round() as i64).min(last).max(first);
        if end == start {
            self.say("A rack needs a frame after this one: hold the still, or go back in the sequence.");
            return;
        }
        for (frame, metres) in [(start, from), (end, to)] {
            let key = pullfocus_core::pull::Key { focus_distance_m: Some(metres), ..Default::default() };
            let result = self.document.set_key(side, key, frame);
            self.tell(result);
        }
    }

    /// What a side shows of this plate, or of the one before until there is more.
    fn side(&self, view: View, plate: &Plate) -> Side {
        let frame = &plate.scene.frame;
        let here = area(frame, frame);
        let shown = |side: usize| {
            let shown = self.engine.state().shown[side].clone()?;
            Some((shown.texture.clone(), area(&shown.plate.scene.frame, frame)))
        };
        let pinhole = || self.on_device(plate, |frame| frame.pinhole.clone());
        let (kind, picture) = match view {
            View::Result => (Kind::Light, shown(0).or_else(pinhole)),
            View::Other => (Kind::Light, shown(1).or_else(pinhole)),
            View::Pinhole => (Kind::Light, pinhole()),
            View::Depth | View::Coc => {
                let kind = if view == View::Depth && !plate.has_coc { Kind::Depth } else { Kind::Coc };
                let area = self.on_device(plate, |frame| frame.distances.clone()).map(|(_, area)| area);
                // Distances are there for every view.
                return Side { kind, texture: None, area: area.unwrap_or(here) };
            }
            View::Reference => {
                let lies =
                    |beside: &Option<Frame>| beside.as_ref().map_or(here, |beside| area(beside, frame));
                let reference = self.references.now.as_ref();
                (Kind::Light, reference.map(|now| (now.texture.clone(), lies(&now.beside))))
            }
            View::Difference => {
                let state = self.engine.state();
                let comparison = state.comparison.as_ref();
                (Kind::Encoded, comparison.map(|found| (found.map.clone(), area(found.frame(), frame))))
            }
        };
        let area = picture.as_ref().map_or(here, |(_, area)| *area);
        Side { kind, texture: picture.map(|(texture, _)| texture), area }
    }

    /// Something of the frame on the device, and where it lies in this plate.
    fn on_device(&self, plate: &Plate, of: impl Fn(&OnDevice) -> Texture) -> Option<(Texture, Area)> {
        let frame = self.engine.state().frame.clone()?;
        Some((of(&frame), area(&frame.plate.scene.frame, &plate.scene.frame)))
    }

    fn labels(&self, ui: &egui::Ui, rect: Rect) {
        let label = |at: Pos2, align, text: &str| {
            let galley = ui.painter().layout_no_wrap(
                text.into(),
                egui::FontId::proportional(13.0),
                egui::Color32::WHITE,
            );
            let place = align_at(at, align, galley.size());
            ui.painter().rect_filled(
                Rect::from_min_size(place, galley.size()).expand(4.0),
                4.0,
                egui::Color32::from_black_alpha(140),
            );
            ui.painter().galley(place, galley, egui::Color32::WHITE);
        };
        let text = |view: View| {
            let text = view.text().0;
            // A frame that is not there yet, or a lens that cannot be, is not what it seems.
            if self.plate_frame != self.frame_number() {
                format!("{text} – still frame {}", self.plate_frame)
            } else if matches!(view, View::Result | View::Other)
                && self.lens_faults[self.take_of(view)].is_some()
            {
                format!("{text} – not rendered")
            } else {
                text.to_owned()
            }
        };
        label(rect.left_top() + Vec2::splat(10.0), 0.0, &text(self.look.left));
        if let Some(right) = self.look.right {
            label(rect.right_top() + Vec2::new(-10.0, 10.0), 1.0, &text(right));
        }
    }

    /// The border between the sides, to be taken with the mouse.
    fn wipe_handle(&mut self, ui: &mut egui::Ui, rect: Rect) {
        self.dragging_wipe = false;
        if self.look.right.is_none() {
            return;
        }
        let x = rect.left() + self.look.wipe * rect.width();
        let handle = Rect::from_center_size(Pos2::new(x, rect.bottom() - 24.0), Vec2::new(28.0, 28.0));
        let response = ui.interact(handle, ui.scope_id().with("wipe"), Sense::drag());
        response.widget_info(|| egui::WidgetInfo::slider(true, f64::from(self.look.wipe), "Wipe"));
        let response = response.on_hover_text("Drag the border between both sides.");
        ui.painter().circle_filled(handle.center(), 12.0, egui::Color32::from_black_alpha(160));
        ui.painter().text(
            handle.center(),
            egui::Align2::CENTER_CENTER,
            "< >",
            egui::FontId::proportional(12.0),
            egui::Color32::WHITE,
        );
        if response.dragged() {
            self.dragging_wipe = true;
            self.look.wipe = (self.look.wipe + response.drag_delta().x / rect.width()).clamp(0.0, 1.0);
        }
        if response.hovered() || response.dragged() {
            ui.ctx().set_cursor_icon(egui::CursorIcon::ResizeHorizontal);
        }
    }

    /// Diameter that has the full colour: the largest in the picture.
    fn coc_range(&self, plate: &Plate, curve: &CocCurve) -> f32 {
        if plate.has_coc {
            return plate.largest_coc;
        }
        let distances = plate.distances();
        let Some([near, far]) = distances.histogram.range else { return 1.0 };
        let nothing = if distances.histogram.nothing > 0 { f64::INFINITY } else { far };
        curve.diameter(near).abs().max(curve.diameter(nothing).abs()).max(1.0)
    }
}

/// Where a frame's pixels lie in those of another one: they show the same display window.
fn area(frame: &Frame, other: &Frame) -> Area {
    let [from, to] = [frame, other].map(|frame| Framing::of(frame).origin);
    let size = frame.data.size;
    Area { origin: [to[0] - from[0], to[1] - from[1]], size: [size.width as f32, size.height as f32] }
}

fn align_at(at: Pos2, align: f32, size: Vec2) -> Pos2 {
    Pos2::new(at.x - align * size.x, at.y)
}

/// The curve where there is none.
const NOTHING: CocCurve = CocCurve {
    formula: CocFormula { at_infinity: 0.0, metre_pixels: 0.0 },
    front: 1.0,
    back: 1.0,
    max: 1.0,
    protect: None,
};
