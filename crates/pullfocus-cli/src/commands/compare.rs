//! `pullfocus compare`: how far apart two pictures are.

use crate::args::CompareArgs;
use crate::console::print_line;
use crate::report;
use anyhow::Context;
use pullfocus_core::Size;
use pullfocus_io::Limits;
use pullfocus_io::output::{Existing, check_target};
use pullfocus_job::draw::Canvas;
use pullfocus_job::failure::{Failure, Result};
use pullfocus_job::storage;
use serde::Serialize;
use std::path::Path;

#[derive(Debug, Serialize)]
struct Document {
    pullfocus: &'static str,
    command: &'static str,
    a: String,
    b: String,
    width: usize,
    height: usize,
    /// None where the pictures are equal: JSON has no infinity.
    psnr_db: Option<f64>,
    identical: bool,
    /// None for pictures below 11 x 11.
    ssim: Option<f64>,
    flip: f64,
    /// Values that are no numbers, in A and in B; they count as 0.
    not_finite: [usize; 2],
    output: Option<String>,
}

/// Compares, prints, and writes the difference.
///
/// # Errors
/// Files that cannot be read, pictures of different size.
pub fn run(args: &CompareArgs) -> Result<()> {
    let result = compare(args);
    if let (Err(failure), true) = (&result, args.json) {
        report::print_failure("compare", failure)?;
    }
    result
}

fn compare(args: &CompareArgs) -> Result<()> {
    let existing = if args.overwrite { Existing::Replace } else { Existing::Refuse };
    if let Some(output) = &args.output {
        storage::check_output(output, None)?;
        check_target(output, [&args.a, &args.b], existing)?;
    }
    let limits = storage::limits(args.allow_large_files);
    let [(a, size_a, bad_a), (b, size_b, bad_b)] = [shown(&args.a, &limits)?, shown(&args.b, &limits)?];
    if size_a != size_b {
        return Err(Failure::failed(format!(
            "{} is {size_a} but {} is {size_b}; only pictures of one size can be compared",
            args.a.display(),
            args.b.display()
        )));
    }
    // The second is the reference; PSNR and SSIM do not care.
    let psnr = pullfocus_metrics::psnr(&b, &a).context("PSNR cannot be taken")?;
    let ssim = match pullfocus_metrics::ssim(&b, &a) {
        Ok(ssim) => Some(ssim),
        Err(pullfocus_metrics::Error::TooSmall { .. }) => None,
        Err(error) => return Err(anyhow::Error::from(error).context("SSIM cannot be taken").into()),
    };
    let flip = pullfocus_metrics::flip(&b, &a).context("FLIP cannot be taken")?;
    if let Some(output) = &args.output {
        let map = pullfocus_metrics::magma(&flip.map).context("the difference cannot be drawn")?;
        storage::save_canvas(&Canvas::from_srgb(&map), output, existing)?;
    }
    let document = Document {
        pullfocus: env!("CARGO_PKG_VERSION"),
        command: "compare",
        a: args.a.display().to_string(),
        b: args.b.display().to_string(),
        width: size_a.width,
        height: size_a.height,
        psnr_db: psnr.is_finite().then_some(psnr),
        identical: psnr.is_infinite(),
        ssim,
        flip: flip.mean,
        not_finite: [bad_a, bad_b],
        output: args.output.as_ref().map(|path| path.display().to_string()),
    };
    if args.json {
        return report::print(&document);
    }
    if psnr.is_infinite() {
        print_line("PSNR  infinite: as seen on a screen, the pictures are the same");
    } else {
        print_line(&format!("PSNR  {psnr:.2} dB"));
    }
    print_line(&match ssim {
        Some(ssim) => format!("SSIM  {ssim:.4}"),
        None => "SSIM  none: its window of 11 x 11 pixels is larger than the picture".into(),
    });
    print_line(&format!("FLIP  {:.4}", flip.mean));
    for (path, bad) in [(&args.a, bad_a), (&args.b, bad_b)] {
        if bad > 0 {
            print_line(&format!("note: {} has {bad} values that are NaN or infinite", path.display()));
        }
    }
    if let Some(output) = &args.output {
        print_line(&format!(
            "wrote {}: black where FLIP sees no difference, light yellow where it sees the most",
            output.display()
        ));
    }
    Ok(())
}

type Shown = ([pullfocus_core::Plane; 3], Size, usize);

fn shown(path: &Path, limits: &Limits) -> Result<Shown> {
    let picture = storage::read_picture(path, limits)?;
    let bad = pullfocus_metrics::not_finite(picture.planes());
    let planes = pullfocus_metrics::display(&picture)
        .with_context(|| format!("{} cannot be shown", path.display()))?;
    Ok((planes, picture.size(), bad))
}
