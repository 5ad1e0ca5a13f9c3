//! Weights of the classifiers, which a parameter names.
#![no_main]

use gable_segmentation::Model;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    if let Ok(model) = Model::from_json(&String::from_utf8_lossy(data)) {
        let _ = Model::from_json(&model.to_json());
    }
});
