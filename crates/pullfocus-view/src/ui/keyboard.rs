//! Keys.

use super::App;
use crate::document::Quantity;
use crate::look::View;
use eframe::egui::{self, Key, KeyboardShortcut, Modifiers};
use pullfocus_core::focus::stops;

/// What a key does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    Open,
    Save,
    SaveAs,
    Undo,
    Redo,
    Play,
    Before,
    After,
    First,
    Last,
    KeyHere,
    RemoveKey,
    Wider,
    Narrower,
    Nearer,
    Farther,
    Fit,
    Full,
    Overlay,
    Wipe,
    Swap,
    Brighter,
    Darker,
    Show(View),
    Shortcuts,
}

/// From f/0.5 to f/128, in thirds.
const STOPS: [i32; 2] = [-6, 42];

const fn plain(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::NONE, key)
}

const fn command(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::COMMAND, key)
}

/// Every key, in the order of the sheet.
pub const SHORTCUTS: &[(KeyboardShortcut, Action, &str)] = &[
    (command(Key::O), Action::Open, "Open a picture, a sequence or a shot"),
    (
        KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::S),
        Action::SaveAs,
        "Save the shot as",
    ),
    (command(Key::S), Action::Save, "Save the shot"),
    (KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z), Action::Redo, "Redo"),
    (command(Key::Z), Action::Undo, "Undo"),
    (plain(Key::P), Action::Play, "Play, stop"),
    (plain(Key::ArrowLeft), Action::Before, "One frame back"),
    (plain(Key::ArrowRight), Action::After, "One frame on"),
    (plain(Key::Home), Action::First, "First frame"),
    (plain(Key::End), Action::Last, "Last frame"),
    (plain(Key::K), Action::KeyHere, "Key the lens at this frame"),
    (plain(Key::Delete), Action::RemoveKey, "Remove the chosen key"),
    (plain(Key::OpenBracket), Action::Wider, "Open the aperture by a third of a stop"),
    (plain(Key::CloseBracket), Action::Narrower, "Close the aperture by a third of a stop"),
    (plain(Key::Comma), Action::Nearer, "Focus a little nearer"),
    (plain(Key::Period), Action::Farther, "Focus a little farther"),
    (plain(Key::F), Action::Fit, "All of the picture"),
    (plain(Key::Num0), Action::Full, "One pixel for one of the screen's"),
    (plain(Key::O), Action::Overlay, "Circle of confusion over the picture"),
    (plain(Key::W), Action::Wipe, "Wipe to the pinhole picture, or back"),
    (plain(Key::B), Action::Swap, "Take A, take B"),
    (plain(Key::Plus), Action::Brighter, "Half a stop brighter on the screen"),
    (plain(Key::Minus), Action::Darker, "Half a stop darker on the screen"),
    (plain(Key::Num1), Action::Show(View::ALL[0]), "Show the result"),
    (plain(Key::Num2), Action::Show(View::ALL[1]), "Show the pinhole picture"),
    (plain(Key::Num3), Action::Show(View::ALL[2]), "Show depth"),
    (plain(Key::Num4), Action::Show(View::ALL[3]), "Show the circle of confusion"),
    (plain(Key::Num5), Action::Show(View::ALL[4]), "Show take B"),
    (plain(Key::Num6), Action::Show(View::ALL[5]), "Show the reference"),
    (plain(Key::Num7), Action::Show(View::ALL[6]), "Show the difference to the reference"),
    (plain(Key::F1), Action::Shortcuts, "This sheet"),
];

impl App {
    pub(super) fn keyboard(&mut self, ctx: &egui::Context) {
        // Letters belong to a field that is being typed into.
        let typing = ctx.egui_wants_keyboard_input();
        let mut actions = Vec::new();
        let held: Vec<Key> = ctx.input(|input| {
            let repeated = |event: &egui::Event| match event {
                egui::Event::Key { key, repeat: true, .. } => Some(*key),
                _ => None,
            };
            input.events.iter().filter_map(repeated).collect()
        });
        for (shortcut, action, _) in SHORTCUTS {
            let is_text = matches!(action, Action::Undo | Action::Redo);
            if typing && (shortcut.modifiers == Modifiers::NONE || is_text) {
                continue;
            }
            if ctx.input_mut(|input| input.consume_shortcut(shortcut)) {
                actions.push((*action, held.contains(&shortcut.logical_key)));
            }
        }
        for (action, is_held) in actions {
            if is_held {
                // A key that is held down is one step.
                self.perform(action);
            } else {
                self.act(action);
            }
        }
    }

    pub(super) fn act(&mut self, action: Action) {
        if !matches!(action, Action::Undo | Action::Redo) {
            // What was is a step, however soon the next one follows.
            self.undo.add_undo(&self.document);
        }
        self.perform(action);
    }

    fn perform(&mut self, action: Action) {
        let frame = self.frame_number();
        if matches!(action, Action::Before | Action::After | Action::First | Action::Last) {
            self.playing = None;
        }
        match action {
            Action::Open => self.open_window(),
            Action::Save => self.save_or_ask(),
            Action::SaveAs => self.save_window(),
            Action::Undo => self.undo_redo(false),
            Action::Redo => self.undo_redo(true),
            Action::Play => self.toggle_play(),
            Action::Before => self.step(-1),
            Action::After => self.step(1),
            Action::First => self.go_to(i64::MIN),
            Action::Last => self.go_to(i64::MAX),
            Action::KeyHere => {
                if let Some(plate) = self.plate_here().filter(|_| self.may_key()) {
                    let result = self.document.key_here(self.front(), &plate, frame);
                    self.tell(result);
                }
            }
            Action::RemoveKey => {
                if let Some(key) = self.selected_key.take() {
                    self.document.remove_key(self.front(), key);
                }
            }
            Action::Wider => self.step_stop(-1),
            Action::Narrower => self.step_stop(1),
            Action::Nearer => self.step_focus(1.0),
            Action::Farther => self.step_focus(-1.0),
            Action::Fit => self.look.zoom = None,
            Action::Full => self.full_size(),
            Action::Overlay => self.look.overlay = if self.look.overlay > 0.0 { 0.0 } else { 0.5 },
            Action::Wipe => {
                self.look.right = match self.look.right {
                    Some(_) => None,
                    None => Some(View::Pinhole),
                }
            }
            Action::Swap => self.bring_to_front(if self.front() == 1 { View::Result } else { View::Other }),
            Action::Brighter => self.look.exposure += 0.5,
            Action::Darker => self.look.exposure -= 0.5,
            Action::Show(view) => match self.lacks(view) {
                Some(reason) => self.say(reason),
                None if matches!(view, View::Result | View::Other) => self.bring_to_front(view),
                None => self.look.left = view,
            },
            Action::Shortcuts => self.windows.shortcuts ^= true,
        }
    }

    fn step_stop(&mut self, thirds: i32) {
        let Some(f_stop) = self.lens_values().and_then(|values| values.f_stop) else { return };
        let next = stops::third(stops::nearest(f_stop).saturating_add(thirds).clamp(STOPS[0], STOPS[1]));
        // What lies beyond the ends stays there rather than turn back.
        if (next > f_stop) == (thirds > 0) && next != f_stop {
            self.change(Quantity::FStop, next);
        }
    }

    /// By a hundredth of the way from the nearest thing to infinity, in dioptres.
    fn step_focus(&mut self, steps: f64) {
        let Some(values) = self.lens_values() else { return };
        let nearest = self
            .plate
            .as_ref()
            .and_then(|plate| plate.distances().histogram.range)
            .map_or(1.0, |range| range[0]);
        let dioptres = 1.0 / values.focus_m + 0.01 * steps / nearest;
        self.change(Quantity::FocusDistance, if dioptres > 1e-9 { 1.0 / dioptres } else { f64::INFINITY });
    }
}
