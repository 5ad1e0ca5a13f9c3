//! Images of every type that is read.
#![no_main]

use gable_scene::decode_image;
use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|data: &[u8]| {
    if let Ok(image) = decode_image(Path::new("a"), data) {
        let _ = image.into_rgb8();
    }
});
