//! Display transforms from OpenColorIO configs: what is chosen, the thread that reads configs, and the table that pictures go through.

mod choice;
#[cfg(feature = "ocio")]
mod config;
mod table;
mod worker;

pub use choice::{Choice, Display, Menu, Source};
pub use table::{SIDE, Table, shaper};
pub use worker::{Ask, Colors, State};

/// Configs, where the program was built without them.
#[cfg(not(feature = "ocio"))]
mod config {
    use super::{Ask, Menu, Table};
    use std::sync::Arc;

    /// Nothing: there is no library to read with.
    pub struct Reader;

    impl Reader {
        pub fn new(_: Option<String>) -> Self {
            Self
        }

        pub fn read(&mut self, _: &Ask) -> (Option<Menu>, Result<Arc<Table>, String>) {
            let sentence = "this program was built without OpenColorIO; build it with the feature ocio, or choose another \
                            display transform (the picture is shown in sRGB)";
            (None, Err(sentence.into()))
        }
    }
}
