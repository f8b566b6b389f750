//! Which view of which config.

use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Where the config comes from.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// The file that the environment variable OCIO names; the built-in config where it names none.
    #[default]
    Usual,
    /// The newest ACES studio config, which the library brings.
    BuiltIn,
    /// A `.ocio` or `.ocioz` file.
    File(PathBuf),
}

/// A view of a config. What is not given is the config's own default.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct Choice {
    /// The config.
    pub config: Source,
    /// What the picture is looked at on.
    pub display: Option<String>,
    /// How it is rendered for that display.
    pub view: Option<String>,
    /// The colour space of the picture's pixels.
    pub space: Option<String>,
}

/// A display of a config, with what it offers.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Display {
    /// Its name.
    pub name: String,
    /// The names of its views.
    pub views: Vec<String>,
}

/// What a config offers, and what of it is used.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Menu {
    /// What the config goes by.
    pub config: String,
    /// Its displays.
    pub displays: Vec<Display>,
    /// Its linear colour spaces: pictures are blurred in linear light.
    pub spaces: Vec<String>,
    /// The display in use.
    pub display: String,
    /// The view in use.
    pub view: String,
    /// The colour space in use.
    pub space: String,
}

impl Menu {
    /// The views of a display.
    pub fn views(&self, display: &str) -> &[String] {
        self.displays.iter().find(|known| known.name == display).map_or(&[], |known| &known.views)
    }
}
