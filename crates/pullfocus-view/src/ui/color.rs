//! The view of an OpenColorIO config: which, and the thread that makes it.

use super::App;
use super::controls::WIDTH;
use crate::color::{Ask, Choice, Colors, Source, State, Table};
use crate::screen::Transform;
use eframe::egui::{self, ComboBox, Ui};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What stands behind the controls.
pub struct Panel {
    colors: Colors,
    state: State,
    /// What is typed for a config's file, until it is taken.
    path: String,
    /// How often files were asked to be read again.
    again: u64,
}

impl Panel {
    pub fn start(ctx: &egui::Context, environment: Option<String>, choice: &Choice) -> std::io::Result<Self> {
        let colors = Colors::start(ctx, environment)?;
        let path = match &choice.config {
            Source::File(path) => path.display().to_string(),
            _ => String::new(),
        };
        Ok(Self { colors, state: State::default(), path, again: 0 })
    }

    pub fn is_busy(&self) -> bool {
        self.colors.is_busy()
    }
}

impl App {
    /// The view as a table, if one is looked through and there is one.
    pub fn table(&self) -> Option<Arc<Table>> {
        self.colors.state.table.clone().filter(|_| self.look.transform == Transform::Ocio)
    }

    /// Looks through a config from now on.
    pub fn choose_config(&mut self, path: &Path) {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        self.colors.path = path.display().to_string();
        // Names of another config are none of this one's.
        self.look.color = Choice { config: Source::File(path), ..Choice::default() };
        self.look.transform = Transform::Ocio;
        self.colors.again += 1;
    }

    /// Asks for the view that is chosen, and takes what was made.
    pub(super) fn take_colors(&mut self) {
        if self.look.transform != Transform::Ocio {
            return;
        }
        let files = self.clip.as_ref().and_then(|clip| clip.files(0));
        let file = files.and_then(|files| files.input.clone().or_else(|| files.behind.clone()));
        self.colors.colors.ask(Ask { choice: self.look.color.clone(), file, again: self.colors.again });
        self.colors.state = self.colors.colors.state();
        if let Some(sentence) = self.colors.colors.take_fault() {
            self.say(sentence);
        }
    }

    /// Config, display, view and colour space, where a config is looked through.
    pub(super) fn color_controls(&mut self, ui: &mut Ui) {
        if self.look.transform != Transform::Ocio {
            return;
        }
        egui::Grid::new("color").num_columns(2).show(ui, |ui| {
            self.config_control(ui);
            self.view_choices(ui);
        });
        // One line in any case, so that what is below stays where it is.
        ui.horizontal(|ui| {
            ui.set_min_height(ui.spacing().interact_size.y);
            if self.colors.is_busy() {
                ui.add(egui::Spinner::new().size(12.0));
                ui.label("Making the view");
            } else if let Some(fault) = &self.colors.state.fault {
                ui.add(egui::Label::new(egui::RichText::new(fault).strong()).truncate())
                    .on_hover_text(fault.as_str());
            } else if let Some(menu) = &self.colors.state.menu {
                ui.add(egui::Label::new(egui::RichText::new(&menu.config).weak()).truncate())
                    .on_hover_text("The config whose view is shown.");
            }
        });
    }

    fn config_control(&mut self, ui: &mut Ui) {
        let environment = self.colors.colors.environment().map(str::to_owned);
        let usual = match environment {
            Some(_) => "From OCIO",
            None => "Built-in (ACES)",
        };
        let mut config = self.look.color.config.clone();
        let text = match &config {
            Source::Usual => usual,
            Source::BuiltIn => "Built-in (ACES)",
            Source::File(_) => "A file",
        };
        ui.label("Config");
        let combo = ComboBox::from_id_salt("config").selected_text(text).width(WIDTH - 110.0);
        let shown = combo.show_ui(ui, |ui| {
            if let Some(path) = &environment {
                ui.selectable_value(&mut config, Source::Usual, usual)
                    .on_hover_text(format!("The one that the environment variable OCIO names: {path}"));
            }
            let built_in = if environment.is_some() { Source::BuiltIn } else { Source::Usual };
            ui.selectable_value(&mut config, built_in, "Built-in (ACES)")
                .on_hover_text("The newest ACES studio config, which comes with the program.");
            let file = Source::File(PathBuf::from(self.colors.path.trim()));
            ui.selectable_value(&mut config, file, "A file").on_hover_text(
                "A config.ocio or .ocioz of your own. Dropping it on the window does the same.",
            );
        });
        named(&shown.response, "Colour config", text);
        let hint = self.colors.state.menu.as_ref().map_or_else(String::new, |menu| menu.config.clone());
        shown.response.on_hover_text(format!("Whose colours the picture is shown with. {hint}"));
        ui.end_row();
        if matches!(config, Source::File(_)) {
            let label = ui.label("File");
            let field = egui::TextEdit::singleline(&mut self.colors.path).desired_width(WIDTH - 110.0);
            let response = ui.add(field.hint_text("studio/config.ocio")).labelled_by(label.id);
            let response = response.on_hover_text(
                "The config's file. Enter takes it, and reads it again if it is taken already.",
            );
            if response.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter)) {
                let path = self.folder().join(self.colors.path.trim());
                self.choose_config(&path);
                config = self.look.color.config.clone();
            }
            ui.end_row();
        }
        if config != self.look.color.config {
            // Names of another config are none of this one's.
            self.look.color = Choice { config, ..Choice::default() };
        }
    }

    fn view_choices(&mut self, ui: &mut Ui) {
        let Some(menu) = self.colors.state.menu.clone() else { return };
        let color = &mut self.look.color;
        let displays: Vec<&str> = menu.displays.iter().map(|display| display.name.as_str()).collect();
        let hint = "The screen that the picture is made for: choose what yours is set to.";
        if let Some(display) =
            choice(ui, "Display", &menu.display, &displays, (hint, "Show the picture as for the screen "))
        {
            // A view of the same name is kept.
            let view = color.view.take().filter(|view| menu.views(&display).contains(view));
            (color.display, color.view) = (Some(display), view);
        }
        let views: Vec<&str> = menu.views(&menu.display).iter().map(String::as_str).collect();
        let hint = "How scene light becomes that screen's: tone, contrast, and how bright and saturated colours fit in.";
        if let Some(view) =
            choice(ui, "View", &menu.view, &views, (hint, "Turn scene light into the screen's by "))
        {
            color.view = Some(view);
        }
        let spaces: Vec<&str> = menu.spaces.iter().map(String::as_str).collect();
        let hint = "The linear colour space that the picture was rendered in. A wrong one shows colours too dull or too strong.";
        if let Some(space) =
            choice(ui, "Pixels are", &menu.space, &spaces, (hint, "Take the picture's numbers as "))
        {
            color.space = Some(space);
        }
    }
}

/// What a screen reader calls it.
pub(super) fn named(response: &egui::Response, name: &str, value: &str) {
    response.widget_info(|| egui::WidgetInfo {
        current_text_value: Some(value.to_owned()),
        ..egui::WidgetInfo::labeled(egui::Role::ComboBox, true, name)
    });
}

/// One of several names in a row of its own: what was chosen, if anything.
fn choice(ui: &mut Ui, label: &str, now: &str, names: &[&str], (hint, item): (&str, &str)) -> Option<String> {
    let mut chosen = None;
    ui.label(label);
    let combo = ComboBox::from_id_salt(label).selected_text(now).width(WIDTH - 110.0).truncate();
    let shown = combo.show_ui(ui, |ui| {
        for name in names {
            let response = ui.selectable_label(*name == now, *name).on_hover_text(format!("{item}{name}"));
            // Also the one that is shown: it may stand there in the place of a name that the config has not.
            if response.clicked() {
                chosen = Some((*name).to_owned());
            }
        }
    });
    named(&shown.response, label, now);
    shown.response.on_hover_text(format!("{hint} Now: {now}"));
    ui.end_row();
    chosen
}
