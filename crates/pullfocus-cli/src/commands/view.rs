//! `pullfocus view`: the interactive program.

use crate::args::ViewArgs;
use pullfocus_core::Cancel;
use pullfocus_job::failure::Result;

/// Opens the window and stays until it is closed.
///
/// # Errors
/// Options that do not go together, files that are not there, a system without a screen.
#[cfg(feature = "view")]
pub fn run(args: ViewArgs, cancel: &Cancel) -> Result<()> {
    use pullfocus::Device;
    use pullfocus_core::pull::Pull;
    use pullfocus_job::config::Options;
    use pullfocus_job::failure::Failure;
    use pullfocus_job::options::{CocView, Run};
    use pullfocus_view::engine::Choice;
    use pullfocus_view::session::Session;
    use pullfocus_view::ui::Start;
    use pullfocus_view::{clip::Clip, loader, opening, window};

    let ViewArgs { files, lens, depth, circle, blur, no_session } = args;
    let device = match blur.device.clone().unwrap_or_default().0 {
        Device::Auto => Choice::Auto,
        Device::Cpu => Choice::Cpu,
        Device::Gpu(_) => Choice::Gpu,
    };
    let (view, run, keys) = (CocView::default(), Run::default(), Pull::default());
    let mut options = Options { files, lens, depth, circle, blur, view, run, keys };
    // What cannot be opened is told here, before there is a window.
    let path = match options.files.input.as_deref() {
        Some([single]) => Some(single.clone()),
        _ => None,
    };
    if let Some(path) = &path {
        Clip::open(&opening::options(path, &options)?)?;
        options.files.input = None;
    } else if options.files.input.is_some() || options.files.behind.is_some() {
        Clip::open(&options)?;
    }
    let session = if no_session { None } else { Session::usual_path() };
    let ocio = std::env::var("OCIO").ok();
    let (frame_memory, quit) = (loader::ROOM, cancel.clone());
    let start = Start { path, options, device, session, ocio, frame_memory, quit };
    window::run(start).map_err(Failure::failed)
}

/// The program was built without a window.
///
/// # Errors
/// Always.
#[cfg(not(feature = "view"))]
pub fn run(_: ViewArgs, _: &Cancel) -> Result<()> {
    Err(pullfocus_job::failure::Failure::usage(
        "this program was built without a window; build it with the feature view",
    ))
}
