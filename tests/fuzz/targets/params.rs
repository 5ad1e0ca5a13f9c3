//! Files of parameters (TOML), and single settings.
#![no_main]

use gable_pipeline::Params;
use gable_pipeline::params::parameters;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let text = String::from_utf8_lossy(data);
    let from_file = Params::assemble(None, Some(&text), &[]);
    let settings: Vec<(String, String)> =
        text.lines().filter_map(|line| line.split_once('=')).map(|(n, v)| (n.trim().to_owned(), v.trim().to_owned())).collect();
    let from_settings = Params::assemble(None, None, &settings);
    for params in [from_file, from_settings].into_iter().flatten() {
        // What was taken is taken again.
        let values: Vec<(String, String)> =
            parameters().iter().filter(|p| p.applies(&params)).map(|p| (p.name.to_owned(), p.value(&params))).filter(|(_, v)| !v.is_empty()).collect();
        Params::assemble(None, None, &values).unwrap_or_else(|e| panic!("{e}"));
    }
});
