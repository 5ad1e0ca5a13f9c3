//! The binary under test: built once for the profile of the tests, and run.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;

/// How a run of the binary ended.
#[derive(Clone, Debug)]
pub struct Finished {
    /// Exit code; 128 and more stand for signals, as a shell says it.
    pub code: i32,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

impl Finished {
    /// The standard output as JSON.
    ///
    /// # Panics
    /// If it is none.
    #[must_use]
    pub fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.stdout)
            .unwrap_or_else(|e| panic!("no JSON ({e}):\n{}\n{}", self.stdout, self.stderr))
    }

    /// This, if the code is 0.
    ///
    /// # Panics
    /// If it is not.
    #[must_use]
    pub fn success(self) -> Self {
        assert_eq!(self.code, 0, "{}\n{}", self.stdout, self.stderr);
        self
    }
}

/// The folder of the binaries of this profile, such as `target/debug`.
fn folder() -> PathBuf {
    let test = std::env::current_exe().expect("a test knows where it is");
    let deps = test.parent().expect("a test lies in a folder");
    deps.parent().expect("tests lie in a folder of the profile").to_owned()
}

static BINARY: OnceLock<PathBuf> = OnceLock::new();

/// Makes another program the binary of this test program.
///
/// # Panics
/// If a test has started one already that is not this.
pub fn use_binary(path: &Path) {
    let used = BINARY.get_or_init(|| path.to_owned());
    assert_eq!(used, path, "another binary is in use");
}

/// The binary, built if it is not fresh.
///
/// # Panics
/// If it cannot be built.
#[must_use]
pub fn gable() -> &'static Path {
    BINARY.get_or_init(|| {
        if let Some(given) = std::env::var_os("GABLE_BINARY") {
            return given.into();
        }
        let folder = folder();
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let mut build = Command::new(cargo);
        build
            .args(["build", "--quiet", "--package", "gable", "--features", "otlp", "--target-dir"])
            .arg(folder.parent().expect("a target folder"));
        if folder.file_name() == Some(OsStr::new("release")) {
            build.arg("--release");
        }
        let status = build.current_dir(env!("CARGO_MANIFEST_DIR")).status().expect("cargo can be started");
        assert!(status.success(), "the binary cannot be built");
        folder.join(format!("gable{}", std::env::consts::EXE_SUFFIX))
    })
}

/// The command, with logs off and outputs piped.
fn command(arguments: &[&OsStr]) -> Command {
    let mut command = Command::new(gable());
    command
        .args(arguments)
        .env_remove("RUST_LOG")
        .env_remove("GABLE_TOKEN")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// Runs the binary to its end.
///
/// # Panics
/// If it cannot be started.
pub fn run_gable<A: AsRef<OsStr>>(arguments: &[A]) -> Finished {
    let arguments: Vec<_> = arguments.iter().map(AsRef::as_ref).collect();
    let output = command(&arguments).output().expect("the binary can be started");
    Finished {
        code: code(output.status),
        stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
        stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

/// Starts the binary and returns at once.
///
/// # Panics
/// If it cannot be started.
pub fn start_gable<A: AsRef<OsStr>>(arguments: &[A]) -> Child {
    let arguments: Vec<_> = arguments.iter().map(AsRef::as_ref).collect();
    command(&arguments).spawn().expect("the binary can be started")
}

fn code(status: std::process::ExitStatus) -> i32 {
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        return 128 + signal;
    }
    status.code().unwrap_or(-1)
}
