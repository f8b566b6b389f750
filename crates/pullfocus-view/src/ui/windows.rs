//! Windows over the picture: opening, saving, rendering, the sheet of keys.

use super::App;
use super::browser::{Browser, For};
use super::keyboard::SHORTCUTS;
use crate::export::{ENCODER, Export, Order, What};
use eframe::egui::{self, Window};
use std::path::{Path, PathBuf};

/// Which windows are open.
#[derive(Debug, Default)]
pub struct Windows {
    pub shortcuts: bool,
    pub export: bool,
    order: Option<Draft>,
    pub(super) browser: Option<Browser>,
}

/// What is typed for an export.
#[derive(Debug, Clone, Default)]
struct Draft {
    what: What,
    output: String,
    overwrite: bool,
}

impl App {
    pub(super) fn folder(&self) -> PathBuf {
        let open = self.plate.as_ref().map(|plate| plate.path.clone());
        let path = open.or_else(|| self.session.recent.first().cloned());
        let folder = path.and_then(|path| path.parent().map(Path::to_owned)).filter(|folder| folder.is_dir());
        folder.or_else(|| std::env::current_dir().ok()).unwrap_or_default()
    }

    fn browse(&mut self, purpose: For, path: String) {
        self.windows.browser = Some(Browser::new(&self.ctx, purpose, self.folder(), path));
    }

    pub(super) fn open_window(&mut self) {
        self.browse(For::Open, String::new());
    }

    pub(super) fn reference_window(&mut self) {
        self.browse(For::Reference, String::new());
    }

    pub(super) fn save_or_ask(&mut self) {
        match self.saved.as_ref().map(|saved| saved.path.clone()) {
            Some(path) if self.may_save(&path) => self.save(&path, false),
            there => {
                self.save_window();
                if let Some(browser) = &mut self.windows.browser {
                    browser.there = there;
                }
            }
        }
    }

    pub(super) fn save_window(&mut self) {
        let folder = self.folder();
        let name = self.saved.as_ref().map_or_else(|| folder.join("pull.toml"), |saved| saved.path.clone());
        self.browse(For::Save, name.display().to_string());
    }

    pub(super) fn windows(&mut self, ctx: &egui::Context) {
        self.browser(ctx);
        self.export_window(ctx);
        let mut open = self.windows.shortcuts;
        Window::new("Keys and mouse").open(&mut open).resizable(false).show(ctx, |ui| {
            egui::Grid::new("mouse").num_columns(2).striped(true).show(ui, |ui| {
                for (how, what) in [
                    ("Click", "Focus there"),
                    ("Drag", "Rack from there to the cursor"),
                    ("Shift and drag", "The same as two keys, a second apart"),
                    ("Wheel, pinch", "Zoom about the cursor"),
                    ("Right or middle drag, Space and drag", "Move the picture"),
                ] {
                    ui.monospace(how);
                    ui.label(what);
                    ui.end_row();
                }
                for (shortcut, _, what) in SHORTCUTS {
                    ui.monospace(ctx.format_shortcut(shortcut));
                    ui.label(*what);
                    ui.end_row();
                }
            });
        });
        self.windows.shortcuts = open;
    }

    fn export_window(&mut self, ctx: &egui::Context) {
        let mut open = self.windows.export;
        let mut draft = self.windows.order.clone().unwrap_or_default();
        let mut start = false;
        Window::new("Render to files").open(&mut open).collapsible(false).resizable(false).show(ctx, |ui| {
            for (what, name, hint) in [
                (
                    What::Shot,
                    "The shot",
                    "At full quality, as `pullfocus render` writes it: OpenEXR with every channel.",
                ),
                (
                    What::Pictures,
                    "The result, as pictures",
                    "As the screen shows it: this exposure and display transform. PNG files of the take that is looked at.",
                ),
                (
                    What::Camera,
                    "The camera, for other programs",
                    "Focus, f-stop, focal length and what is in focus, frame by frame: a table or a USD layer.",
                ),
                (
                    What::Movie,
                    "The result, as a movie",
                    "As the screen shows it: this exposure and display transform. To send round; ffmpeg makes it, if that is installed.",
                ),
            ] {
                ui.radio_value(&mut draft.what, what, name).on_hover_text(hint);
            }
            let [shot, other] = &self.document.takes;
            // Its place is kept, so that nothing moves with the choice.
            let is_other = self.front() == 1 && shot != other && matches!(draft.what, What::Shot | What::Camera);
            let text = "This is take A's; B to A makes the take in front the shot.";
            ui.add_visible(is_other, egui::Label::new(text));
            ui.horizontal(|ui| {
                let label = ui.label("To");
                let hint = match draft.what {
                    What::Shot => "out/shot.####.exr",
                    What::Pictures => "out/result.####.png",
                    What::Movie => "result.mp4",
                    What::Camera => "camera.usda, camera.csv",
                };
                let field =
                    egui::TextEdit::singleline(&mut draft.output).desired_width(320.0).hint_text(hint);
                let hint = "The file to write; #### stands for the frame's number. A name alone stands beside the picture.";
                ui.add(field).labelled_by(label.id).on_hover_text(hint);
            });
            ui.checkbox(&mut draft.overwrite, "Replace files that are there")
                .on_hover_text("Else a file that is there stops the run before it begins.");
            match self.export.as_ref().map(Export::progress) {
                Some(progress) if progress.end.is_none() => {
                    let part = progress.done as f32 / progress.of.max(1) as f32;
                    ui.add(
                        egui::ProgressBar::new(part).text(format!("{} of {}", progress.done, progress.of)),
                    );
                    if ui
                        .button("Stop")
                        .on_hover_text("End after this frame; what is written stays.")
                        .clicked()
                        && let Some(export) = &self.export
                    {
                        export.cancel();
                    }
                }
                ended => {
                    if let Some(end) = ended.and_then(|progress| progress.end) {
                        ui.label(end.unwrap_or_else(|sentence| sentence));
                    }
                    let ready = self.clip.is_some() && !draft.output.trim().is_empty();
                    let button = ui.add_enabled(ready, egui::Button::new("Render"));
                    start = button.on_hover_text("Begin; the window stays usable.").clicked();
                }
            }
        });
        self.windows.export = open;
        if start {
            let result = self.start_export(Order {
                what: draft.what,
                output: self.folder().join(draft.output.trim()),
                overwrite: draft.overwrite,
                transform: self.look.transform,
                table: self.table(),
                gain: self.look.exposure.exp2(),
                fps: self.look.fps,
                sharp_px: self.look.sharp_px,
                side: self.front(),
                show: self.look.layer.map(|_| self.look.show()),
                encoder: ENCODER.into(),
            });
            self.tell(result);
        }
        self.windows.order = Some(draft);
    }
}
