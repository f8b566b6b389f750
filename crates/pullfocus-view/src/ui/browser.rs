//! The window in which a file is chosen.

use super::App;
use crate::clip::file_name;
use crate::opening::{self, Entry};
use eframe::egui::{self, Ui, Window};
use pullfocus_job::failure::Result;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver};

/// What a file is chosen for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum For {
    Open,
    Reference,
    Save,
}

impl For {
    /// Whether a file is one of those that are chosen for this.
    fn takes(self, path: &Path) -> bool {
        match self {
            Self::Open => true,
            Self::Reference => !opening::is_shot(path) && !opening::is_config(path),
            Self::Save => opening::is_shot(path),
        }
    }

    /// The window's title, and what its button says.
    fn text(self) -> (&'static str, &'static str) {
        match self {
            Self::Open => ("Open a picture, a sequence or a shot", "Open"),
            Self::Reference => ("Choose a reference", "Compare"),
            Self::Save => ("Save the shot", "Save"),
        }
    }
}

/// What is in a folder: folders, and what can be opened.
type Listing = Result<(Vec<PathBuf>, Vec<Entry>)>;

/// A folder that is looked into.
#[derive(Debug)]
pub(super) struct Browser {
    purpose: For,
    folder: PathBuf,
    path: String,
    /// What is in the folder, once it has been read; it may be far away.
    listing: Option<Listing>,
    coming: Option<Receiver<Listing>>,
    /// A file that is there already, and may be replaced if the user says so.
    pub there: Option<PathBuf>,
    /// Whether it was not on the screen yet.
    is_new: bool,
}

/// What was clicked.
#[derive(Default)]
struct Click {
    file: Option<PathBuf>,
    folder: Option<PathBuf>,
    name: Option<String>,
    replace: bool,
}

impl Browser {
    pub fn new(ctx: &egui::Context, purpose: For, folder: PathBuf, path: String) -> Self {
        let mut browser = Self {
            purpose,
            folder: PathBuf::new(),
            path,
            listing: None,
            coming: None,
            there: None,
            is_new: true,
        };
        browser.go(ctx, folder);
        browser
    }

    fn go(&mut self, ctx: &egui::Context, folder: PathBuf) {
        let (sender, receiver) = mpsc::channel();
        let (theirs, ctx) = (folder.clone(), ctx.clone());
        let read = move || {
            // Nobody waits any more where this fails.
            let _ = sender.send(opening::entries(&theirs));
            ctx.request_repaint();
        };
        // Without a thread there is no list; a name can be typed all the same.
        let started = std::thread::Builder::new().name("folder".into()).spawn(read);
        self.coming = started.is_ok().then_some(receiver);
        (self.listing, self.folder) = (None, folder);
    }

    /// The file that is named in the field: names stand in the folder that is shown, and a shot is known by its ending.
    fn named(&self) -> PathBuf {
        let text = self.path.trim();
        let mut path = self.folder.join(text);
        if self.purpose == For::Save && !opening::is_shot(&path) && !text.ends_with(std::path::is_separator) {
            path.as_mut_os_string().push(".toml");
        }
        path
    }

    fn field(&mut self, ui: &mut Ui) -> Option<PathBuf> {
        ui.horizontal(|ui| {
            let label = ui.label("File");
            let width = (ui.available_width() - 80.0).max(120.0);
            let field = egui::TextEdit::singleline(&mut self.path)
                .desired_width(width)
                .hint_text("frame.exr, shot.####.exr, a folder, pull.toml");
            let hint = "A file's name, or a whole path; a name alone stands in the folder below.";
            let response = ui.add(field).labelled_by(label.id).on_hover_text(hint);
            if std::mem::take(&mut self.is_new) {
                response.request_focus();
            }
            let entered = response.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
            let button = ui.button(self.purpose.text().1);
            let clicked = button.on_hover_text("Take the file that is named here.").clicked();
            ((entered || clicked) && !self.path.trim().is_empty()).then(|| self.named())
        })
        .inner
    }

    fn list(&self, ui: &mut Ui, recent: &[PathBuf], click: &mut Click) {
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            if self.purpose == For::Open && !recent.is_empty() {
                let list = ui.collapsing("Recent", |ui| {
                    for path in recent {
                        if ui.link(file_name(path)).on_hover_text(path.display().to_string()).clicked() {
                            click.file = Some(path.clone());
                        }
                    }
                });
                list.header_response.on_hover_text("What was open before, the last one first.");
            }
            if let Some(parent) = self.folder.parent()
                && ui.link("..").on_hover_text("The folder above.").clicked()
            {
                click.folder = Some(parent.to_owned());
            }
            let (folders, entries) = match &self.listing {
                None => {
                    ui.spinner();
                    return;
                }
                Some(Err(failure)) => {
                    ui.strong(failure.to_string());
                    return;
                }
                Some(Ok(found)) => found,
            };
            for path in folders {
                let hint = format!("Look into {}.", path.display());
                if ui.link(format!("{}/", file_name(path))).on_hover_text(hint).clicked() {
                    click.folder = Some(path.clone());
                }
            }
            for entry in entries.iter().filter(|entry| self.purpose.takes(&entry.path)) {
                let text = if entry.frames > 1 {
                    format!("{} ({} frames)", entry.name, entry.frames)
                } else {
                    entry.name.clone()
                };
                let hint = match self.purpose {
                    For::Open => "Open it.",
                    For::Reference => "Compare the picture with it.",
                    For::Save => "Take its name; you are asked before it is replaced.",
                };
                if ui.link(text).on_hover_text(hint).clicked() {
                    match self.purpose {
                        For::Save => click.name = Some(entry.name.clone()),
                        _ => click.file = Some(entry.path.clone()),
                    }
                }
            }
        });
    }
}

impl App {
    pub(super) fn browser(&mut self, ctx: &egui::Context) {
        let Some(mut browser) = self.windows.browser.take() else { return };
        if let Some(listing) = browser.coming.as_ref().and_then(|coming| coming.try_recv().ok()) {
            (browser.listing, browser.coming) = (Some(listing), None);
        }
        let (mut open, mut click) = (true, Click::default());
        let window = Window::new(browser.purpose.text().0).open(&mut open).collapsible(false);
        window.default_size([560.0, 420.0]).show(ctx, |ui| {
            click.file = browser.field(ui);
            ui.label(browser.folder.display().to_string());
            // Another name is another file.
            browser.there = browser.there.take().filter(|there| *there == browser.named());
            if let Some(there) = &browser.there {
                click.replace = self.replace_question(ui, there);
            }
            browser.list(ui, &self.session.recent, &mut click);
        });
        if let Some(name) = click.name {
            browser.path = name;
        }
        if let Some(folder) = click.folder {
            browser.go(ctx, folder);
        }
        let chosen = if click.replace { browser.there.clone() } else { click.file };
        match chosen {
            Some(path) => match browser.purpose {
                For::Open => self.open_path(&path),
                For::Reference => self.open_reference(&path),
                For::Save if click.replace || self.may_save(&path) => self.save(&path, click.replace),
                For::Save => {
                    browser.there = Some(path);
                    self.windows.browser = Some(browser);
                }
            },
            None if open => self.windows.browser = Some(browser),
            None => {}
        }
    }

    /// Asks whether a file that is there may go; true where it may.
    fn replace_question(&self, ui: &mut Ui, there: &Path) -> bool {
        ui.horizontal(|ui| {
            let name = file_name(there);
            ui.strong(match &self.saved {
                Some(saved) if saved.path == *there => {
                    format!("{name} holds what was not saved here; saving would lose that.")
                }
                _ => format!("{name} is there already."),
            });
            let hint = "Write this shot in its place; what it holds now is lost.";
            ui.button("Replace it").on_hover_text(hint).clicked()
        })
        .inner
    }
}
