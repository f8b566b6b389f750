//! What can go wrong, said with its numbers.

use crate::size::Size;

/// A result whose error is [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// Every way in which the library refuses or stops. Its text is one sentence: what, where, what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A lens or focus value outside what a lens can be.
    #[error("the camera's {name} is {value}, which {reason}")]
    Camera {
        /// The field's name, as a user says it: "f-stop", "focus distance".
        name: &'static str,
        /// The value given.
        value: f64,
        /// Why it cannot be, and what could.
        reason: &'static str,
    },
    /// A setting outside its range.
    #[error("the setting {name} is {value}, which {reason}")]
    Setting {
        /// The setting's name.
        name: &'static str,
        /// The value given.
        value: f64,
        /// Why it cannot be, and what could.
        reason: &'static str,
    },
    /// Two planes that belong together differ in size.
    #[error("{what} is {found} but the picture is {expected}; both must have the same size")]
    SizeMismatch {
        /// Which plane.
        what: &'static str,
        /// Its size.
        found: Size,
        /// The size wanted.
        expected: Size,
    },
    /// Plane data whose length is not width times height.
    #[error("a plane of {size} needs {expected} values, but {found} were given")]
    Length {
        /// The size asked for.
        size: Size,
        /// width * height.
        expected: usize,
        /// The number of values given.
        found: usize,
    },
    /// Depth was given and no camera to turn it into circles of confusion.
    #[error(
        "depth needs a camera: give a focus distance and a lens, or a circle of confusion instead of depth"
    )]
    NoCamera,
    /// Memory for the picture cannot be had.
    #[error("not enough memory for {what} of {size} ({bytes} bytes)")]
    OutOfMemory {
        /// What was to be allocated.
        what: &'static str,
        /// The picture's size.
        size: Size,
        /// Bytes asked for.
        bytes: u64,
    },
    /// A device's limit is too small for this picture.
    #[error("{device} allows {allowed} for {what}, but {needed} are needed; {instead}")]
    DeviceLimit {
        /// The device's name.
        device: String,
        /// What is limited, with its unit: "bytes in one binding".
        what: &'static str,
        /// How much is needed.
        needed: u64,
        /// How much the device allows.
        allowed: u64,
        /// What to do instead.
        instead: &'static str,
    },
    /// A device stopped working.
    #[error("{device} was lost ({reason}); open it again, or use another device")]
    DeviceLost {
        /// The device's name.
        device: String,
        /// What the driver said.
        reason: String,
    },
    /// The device that was asked for is not there, or cannot be used.
    #[error("{wanted}; {found}")]
    NoDevice {
        /// What was looked for and not found.
        wanted: String,
        /// What there is, or what to do.
        found: String,
    },
    /// Something that this way of rendering cannot do.
    #[error("{what} is not possible here: {reason}")]
    Unsupported {
        /// What was asked for.
        what: &'static str,
        /// Why it cannot be, and what to do instead.
        reason: &'static str,
    },
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled,
}
