//! The command line: help, parameters, exit codes, and where what is written.

use gable_tests::run_gable;
use std::process::Command;

/// What a program of the toolchain says.
fn said_by(variable: &str, program: &str, arguments: &[&str]) -> String {
    let program = std::env::var_os(variable).unwrap_or_else(|| program.into());
    let done = Command::new(program).args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8(done.stdout).unwrap()
}

/// Numbers of a version, such as 1.94 or 1.94.1.
fn version(text: &str) -> Vec<u32> {
    let mut numbers: Vec<u32> = text.split('.').map(|n| n.parse().unwrap()).collect();
    numbers.resize(3, 0);
    numbers
}

#[test]
fn no_dependency_needs_a_newer_compiler_than_the_manifest_says() {
    let compiler = said_by("RUSTC", "rustc", &["-vV"]);
    let host = compiler.lines().find_map(|line| line.strip_prefix("host: ")).unwrap();
    let arguments = ["metadata", "--format-version", "1", "--offline", "--locked", "--filter-platform", host];
    let metadata: serde_json::Value = serde_json::from_str(&said_by("CARGO", "cargo", &arguments)).unwrap();
    let packages = metadata["packages"].as_array().unwrap();
    let needs = |p: &serde_json::Value| p["rust_version"].as_str().map(version);
    let own = packages.iter().find(|p| p["name"] == "gable").and_then(needs).expect("the manifest says it");
    let newer = packages.iter().filter(|p| needs(p).is_some_and(|needed| needed > own));
    let newer: Vec<_> = newer.map(|p| format!("{} {}", p["name"], p["rust_version"])).collect();
    assert!(newer.is_empty(), "rust-version {own:?}, and these need more: {newer:?}");
}

#[test]
fn every_command_has_help_with_examples() {
    let help = run_gable(&["--help"]).success().stdout;
    let commands: Vec<&str> = help
        .lines()
        .skip_while(|line| !line.starts_with("Commands:"))
        .skip(1)
        .take_while(|line| line.starts_with("  "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .collect();
    assert!(commands.contains(&"run") && commands.contains(&"params"), "{help}");
    for command in commands {
        let help = run_gable(&[command, "--help"]).success().stdout;
        assert!(help.contains("Examples:") && help.contains(&format!("gable {command}")), "{command}:\n{help}");
    }
    assert!(help.contains("130 interrupted"), "exit codes are in the help");
}

#[test]
fn parameters_are_listed_for_people_and_programs() {
    let text = run_gable(&["params"]).success().stdout;
    assert!(text.contains("sampling.step") && text.contains("0.02 to 5"), "{text}");
    let list = run_gable(&["params", "--preset", "fine", "--json"]).success().json();
    let step = list["parameters"].as_array().unwrap().iter().find(|p| p["name"] == "sampling.step").unwrap().clone();
    assert_eq!((&step["unit"], &step["default"], &step["value"]), (&"m".into(), &"0.2".into(), &"0.1".into()));
    let filtered = run_gable(&["params", "beta"]).success().stdout;
    assert!(filtered.contains("modeling.beta") && !filtered.contains("sampling.step"));
}

#[test]
fn config_files_and_flags_are_layered() {
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("city.toml");
    std::fs::write(&config, "preset = 'fast'\n[modeling]\nbeta = 0.7\n").unwrap();
    let config = config.to_str().unwrap();
    let list = run_gable(&["params", "--config", config, "--step", "0.3", "--json"]).success().json();
    let value = |name: &str| {
        list["parameters"].as_array().unwrap().iter().find(|p| p["name"] == name).unwrap()["value"].clone()
    };
    assert_eq!((value("sampling.step"), value("modeling.beta")), ("0.3".into(), "0.7".into()));
    assert_eq!(value("segmentation.patch"), "256", "the preset holds where nothing else is said");
}

#[test]
fn wrong_usage_ends_with_2_and_says_what_to_do() {
    let cases: &[(&[&str], &str)] = &[
        (&["run", "x.obj"], "--out"),
        (&["run", "x.obj", "--out", "o", "--set", "stp=1"], "did you mean \"sampling.step\"?"),
        (&["run", "x.obj", "--out", "o", "--step", "50"], "give 0.02 to 5 m"),
        (&["run", "x.obj", "--out", "o", "--grid", "16"], "such as 16x16"),
        (&["run", "x.obj", "--out", "o", "--grid", "0x4"], "such as 16x16, or auto"),
        (&["run", "x.obj", "--out", "o", "--preset", "fin"], "did you mean \"fine\"?"),
        (&["run", "x.obj", "--out", "o", "--crs", "RD"], "EPSG:7415"),
        (&["run", "x.obj", "--out", "o", "--up", "x"], "one of auto, z, y"),
        (&["run", "x.obj", "--out", "o", "--formats", "kml"], "cityjson, cityjsonseq, citygml"),
        (&["run", "x.obj", "--out", "o", "--config", "absent.toml"], "absent.toml"),
        (&["synth", "--out", "o"], "--procedural"),
        (&["synth", "--case", "igloo", "--out", "o"], "the cases are gable"),
        (&["synth", "--procedural", "--density", "99", "--out", "o"], "0.05 to 30 faces per m²"),
        (&["synth", "--place", "moon", "--out", "o"], "give any or one of town, village, farm"),
        (&["synth", "--place", "farm", "--with", "rim,sea", "--out", "o"], "cannot be had with \"sea\""),
        (&["synth", "--place", "any", "--with", "rim", "--out", "o"], "leave out --with"),
        (&["synth", "--place", "farm", "--side", "5", "--out", "o"], "40 to 1000 m"),
        (&["synth", "--place", "farm", "--season", "monsoon", "--out", "o"], "one of spring, summer, drought"),
        (&["synth", "--place", "farm", "--texel", "9", "--out", "o"], "0.02 to 2 m"),
        (&["synth", "--place", "farm", "--cast", "1,1", "--out", "o"], "give three gains"),
        (&["bench", "places", "--variants", "--out", "o"], "leave out --variants"),
        (&["bench", "places", "--only", "moon", "--out", "o"], "there is no place \"moon\""),
        (&["fly"], "unrecognized subcommand"),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (arguments, expected) in cases {
        let mut arguments: Vec<String> = arguments.iter().map(|a| (*a).to_owned()).collect();
        // Nothing may be written, and if it were, then not into the checkout.
        for argument in &mut arguments {
            if argument == "o" {
                *argument = folder.path().join("o").display().to_string();
            }
        }
        let finished = run_gable(&arguments);
        assert_eq!(finished.code, 2, "{arguments:?}: {}", finished.stderr);
        assert!(finished.stderr.contains(expected), "{arguments:?} should say {expected:?}: {}", finished.stderr);
        assert!(finished.stdout.is_empty(), "{arguments:?}: messages go to standard error");
        assert!(!folder.path().join("o").exists(), "{arguments:?} leaves nothing behind");
    }
}

#[test]
fn failures_are_told_as_json_too() {
    let finished = run_gable(&["run", "/does/not/exist.obj", "--out", "/does/not/exist", "--json"]);
    assert_eq!(finished.code, 2);
    let told = finished.json();
    assert_eq!((told["status"].as_str(), told["exit_code"].as_u64()), (Some("failed"), Some(2)));
    assert!(told["error"].as_str().unwrap().contains("/does/not/exist.obj"), "{told}");
}
