//! Builds the dashboard with npm and lists its files for embedding.
//!
//! Node is not needed: without it, or where the registry cannot be reached, the list is empty, the build says so, and the service
//! serves its plain page. All work is done in `OUT_DIR`, and only again if a source of the dashboard changed; packages are only
//! installed again if the lock file did.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs, io};

/// What the dashboard is built from.
const SOURCES: [&str; 6] =
    ["package.json", "package-lock.json", "index.html", "vite.config.ts", "tsconfig.json", "src"];

fn main() {
    for source in SOURCES {
        println!("cargo::rerun-if-changed=dashboard/{source}");
    }
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=GABLE_DASHBOARD");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let files = if env::var("GABLE_DASHBOARD").is_ok_and(|v| v == "off") {
        Vec::new()
    } else {
        build(&out.join("dashboard")).unwrap_or_else(|reason| {
            println!("cargo::warning=the service will serve its plain page, for the dashboard was not built: {reason}");
            Vec::new()
        })
    };
    fs::write(out.join("dashboard_files.rs"), list(&files)).expect("OUT_DIR can be written");
}

/// Builds in `folder`; gives the files, relative to the root of the site, with where they lie.
fn build(folder: &Path) -> Result<Vec<(String, PathBuf)>, String> {
    let failed = |e: io::Error| e.to_string();
    fs::create_dir_all(folder).map_err(failed)?;
    let source = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").ok_or("no manifest")?).join("dashboard");
    fs::remove_dir_all(folder.join("src")).or_else(absent).map_err(failed)?;
    for name in SOURCES {
        copy(&source.join(name), &folder.join(name)).map_err(|e| format!("{name}: {e}"))?;
    }
    let stamp = folder.join("installed");
    let lock = fs::read(folder.join("package-lock.json")).map_err(failed)?;
    if fs::read(&stamp).ok().as_ref() != Some(&lock) {
        // A registry that does not answer costs seconds, not minutes.
        let patience = ["--fetch-retries=1", "--fetch-retry-mintimeout=1000", "--fetch-timeout=30000"];
        let quiet = ["--ignore-scripts", "--no-audit", "--no-fund", "--prefer-offline", "--loglevel=error"];
        run(folder, "npm", &[&["ci"], &patience[..], &quiet[..]].concat())?;
        fs::write(&stamp, lock).map_err(failed)?;
    }
    fs::remove_dir_all(folder.join("dist")).or_else(absent).map_err(failed)?;
    run(folder, "npm", &["run", "--silent", "build"])?;
    let mut files = Vec::new();
    walk(&folder.join("dist"), "", &mut files).map_err(failed)?;
    files.sort();
    if files.iter().any(|(name, _)| name == "index.html") { Ok(files) } else { Err("it has no index.html".to_owned()) }
}

fn run(folder: &Path, program: &str, arguments: &[&str]) -> Result<(), String> {
    // On Windows npm is a script, which only a shell starts.
    let mut command = if cfg!(windows) { Command::new("cmd") } else { Command::new(program) };
    if cfg!(windows) {
        command.args(["/C", program]);
    }
    let done = command.args(arguments).current_dir(folder).output();
    let done = done.map_err(|e| format!("{program} cannot be started ({e}); install Node 20 or newer"))?;
    if done.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&done.stderr);
    let line = said.lines().find(|l| !l.trim().is_empty()).unwrap_or("it said nothing").trim().to_owned();
    Err(format!("{program} {} failed: {line}", arguments[0]))
}

fn absent(error: io::Error) -> io::Result<()> {
    if error.kind() == io::ErrorKind::NotFound { Ok(()) } else { Err(error) }
}

fn copy(from: &Path, to: &Path) -> io::Result<()> {
    if !from.is_dir() {
        return fs::copy(from, to).map(drop);
    }
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        copy(&entry.path(), &to.join(entry.file_name()))?;
    }
    Ok(())
}

fn walk(folder: &Path, prefix: &str, files: &mut Vec<(String, PathBuf)>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            walk(&entry.path(), &format!("{name}/"), files)?;
        } else {
            files.push((name, entry.path()));
        }
    }
    Ok(())
}

/// The list as Rust: name, media type, tag and bytes of each file.
fn list(files: &[(String, PathBuf)]) -> String {
    let mut text = "[\n".to_owned();
    for (name, path) in files {
        let kind = match name.rsplit('.').next() {
            Some("html") => "text/html; charset=utf-8",
            Some("js") => "text/javascript; charset=utf-8",
            Some("css") => "text/css; charset=utf-8",
            Some("svg") => "image/svg+xml",
            Some("png") => "image/png",
            _ => "application/octet-stream",
        };
        let tag = fs::read(path).map(|bytes| hash(&bytes)).unwrap_or_default();
        text += &format!("    ({name:?}, {kind:?}, \"\\\"{tag:016x}\\\"\", include_bytes!({path:?})),\n");
    }
    text + "]\n"
}

/// FNV-1a: tells one version of a file from another, no more.
fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |h, &b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3))
}
