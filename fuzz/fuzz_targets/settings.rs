//! Any text as a settings file: options or one sentence, and from options the same ones by way of another file, and a
//! validated setting or one sentence.
//!
//! Run with `RUSTC_BOOTSTRAP=1 cargo +stable fuzz run settings`.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pullfocus_job::{camera, config, settings};

fuzz_target!(|text: &str| {
    match config::parse(text) {
        Ok(options) => {
            let merged = options.clone().over(config::Options::default());
            assert_eq!(merged, options);
            assert_eq!(config::parse(&config::write(&options)).as_ref(), Ok(&options));
            if let Ok(settings) = settings::settings(&options.blur, &options.circle, &options.depth) {
                settings.check().expect("settings that were let through are in range");
            }
            let _ = settings::decoding(&options.depth);
            if camera::check(&options.lens).is_ok() {
                let _ = camera::resolve(&options.lens, &camera::FileCamera::default(), "frame.exr");
            }
        }
        Err(sentence) => assert!(!sentence.is_empty() && !sentence.contains('\n'), "{sentence:?}"),
    }
});
