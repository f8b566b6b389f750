//! Windows over the picture: opening, saving, rendering, the sheet of keys.

use super::App;
use super::keyboard::SHORTCUTS;
use crate::export::{Export, Order, What};
use crate::opening::{self, Entry};
use eframe::egui::{self, Window};
use std::path::{Path, PathBuf};

/// What a file is chosen for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum For {
    Open,
    Reference,
    Save,
}

/// A folder that is looked into.
#[derive(Debug)]
struct Browser {
    purpose: For,
    folder: PathBuf,
    path: String,
    folders: Vec<PathBuf>,
    entries: Vec<Entry>,
    fault: Option<String>,
    /// Whether it was not on the screen yet.
    is_new: bool,
}

impl Browser {
    fn new(purpose: For, folder: PathBuf, path: String) -> Self {
        let mut browser = Self {
            purpose,
            folder: PathBuf::new(),
            path,
            folders: vec![],
            entries: vec![],
            fault: None,
            is_new: true,
        };
        browser.go(folder);
        browser
    }

    fn go(&mut self, folder: PathBuf) {
        match opening::entries(&folder) {
            Ok((folders, entries)) => (self.folders, self.entries, self.fault) = (folders, entries, None),
            Err(failure) => self.fault = Some(failure.to_string()),
        }
        self.folder = folder;
    }
}

/// Which windows are open.
#[derive(Debug, Default)]
pub struct Windows {
    pub shortcuts: bool,
    pub export: bool,
    order: Option<Draft>,
    browser: Option<Browser>,
    wants_reference: bool,
}

/// What is typed for an export.
#[derive(Debug, Clone, Default)]
struct Draft {
    what: What,
    output: String,
    overwrite: bool,
}

impl Windows {
    pub fn ask_for_reference(&mut self) {
        self.wants_reference = true;
    }
}

impl App {
    pub(super) fn folder(&self) -> PathBuf {
        let open = self.plate.as_ref().map(|plate| plate.path.clone());
        let path = open.or_else(|| self.session.recent.first().cloned());
        let folder = path.and_then(|path| path.parent().map(Path::to_owned)).filter(|folder| folder.is_dir());
        folder.or_else(|| std::env::current_dir().ok()).unwrap_or_default()
    }

    pub(super) fn open_window(&mut self) {
        self.windows.browser = Some(Browser::new(For::Open, self.folder(), String::new()));
    }

    pub(super) fn save_or_ask(&mut self) {
        match self.saved.clone() {
            Some((path, _)) => self.save(&path),
            None => self.save_window(),
        }
    }

    pub(super) fn save_window(&mut self) {
        let folder = self.folder();
        let name = self.saved.as_ref().map_or_else(|| folder.join("pull.toml"), |(path, _)| path.clone());
        self.windows.browser = Some(Browser::new(For::Save, folder, name.display().to_string()));
    }

    pub(super) fn windows(&mut self, ctx: &egui::Context) {
        if std::mem::take(&mut self.windows.wants_reference) {
            self.windows.browser = Some(Browser::new(For::Reference, self.folder(), String::new()));
        }
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

    fn browser(&mut self, ctx: &egui::Context) {
        let Some(mut browser) = self.windows.browser.take() else { return };
        let (title, verb) = match browser.purpose {
            For::Open => ("Open a picture, a sequence or a shot", "Open"),
            For::Reference => ("Choose a reference", "Compare"),
            For::Save => ("Save the shot", "Save"),
        };
        let (mut open, mut chosen, mut folder) = (true, None, None);
        Window::new(title).open(&mut open).collapsible(false).default_size([560.0, 420.0]).show(ctx, |ui| {
            ui.horizontal(|ui| {
                let label = ui.label("File");
                let width = (ui.available_width() - 80.0).max(120.0);
                let field = egui::TextEdit::singleline(&mut browser.path)
                    .desired_width(width)
                    .hint_text("frame.exr, shot.####.exr, a folder, pull.toml");
                let response = ui.add(field).labelled_by(label.id);
                if std::mem::take(&mut browser.is_new) {
                    response.request_focus();
                }
                let entered = response.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
                let clicked = ui.button(verb).on_hover_text("Take the file that is named here.").clicked();
                if (entered || clicked) && !browser.path.trim().is_empty() {
                    // Names stand in the folder that is shown.
                    chosen = Some(browser.folder.join(browser.path.trim()));
                }
            });
            ui.label(browser.folder.display().to_string());
            if let Some(fault) = &browser.fault {
                ui.label(egui::RichText::new(fault).strong());
            }
            egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                if let Some(parent) = browser.folder.parent()
                    && ui.link("..").on_hover_text("The folder above.").clicked()
                {
                    folder = Some(parent.to_owned());
                }
                for path in &browser.folders {
                    if ui.link(format!("{}/", crate::clip::file_name(path))).clicked() {
                        folder = Some(path.clone());
                    }
                }
                for entry in &browser.entries {
                    let text = if entry.frames > 1 {
                        format!("{} ({} frames)", entry.name, entry.frames)
                    } else {
                        entry.name.clone()
                    };
                    if ui.link(text).clicked() {
                        match browser.purpose {
                            For::Save => browser.path.clone_from(&entry.name),
                            _ => chosen = Some(entry.path.clone()),
                        }
                    }
                }
            });
        });
        if let Some(folder) = folder {
            browser.go(folder);
        }
        match chosen {
            Some(path) => match browser.purpose {
                For::Open => self.open_path(&path),
                For::Reference => self.open_reference(&path),
                For::Save => self.save(&path),
            },
            None if open => self.windows.browser = Some(browser),
            None => {}
        }
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
                    "What is seen, as pictures",
                    "With this exposure and display transform, as PNG files.",
                ),
                (
                    What::Movie,
                    "What is seen, as a movie",
                    "To send round. It is made by ffmpeg, if that is installed.",
                ),
            ] {
                ui.radio_value(&mut draft.what, what, name).on_hover_text(hint);
            }
            ui.horizontal(|ui| {
                let label = ui.label("To");
                let hint = match draft.what {
                    What::Shot => "out/shot.####.exr",
                    What::Pictures => "out/seen.####.png",
                    What::Movie => "seen.mp4",
                };
                let field =
                    egui::TextEdit::singleline(&mut draft.output).desired_width(320.0).hint_text(hint);
                ui.add(field).labelled_by(label.id);
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
            });
            self.tell(result);
        }
        self.windows.order = Some(draft);
    }
}
