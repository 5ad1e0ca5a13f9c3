//! `gable download`: the files of a job or of a city, from a service on another machine.

use crate::cli::DownloadArgs;
use crate::exit::Outcome;
use crate::remote::Remote;
use crate::terminal;
use anyhow::{Context as _, bail, ensure};
use gable_coordinator::escaped;
use serde::Deserialize;
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Component, Path, PathBuf};

/// A file that the service has.
#[derive(Deserialize)]
struct Listed {
    path: String,
    bytes: u64,
    hash: String,
}

/// Fetches.
pub(crate) fn run(args: &DownloadArgs, quiet: bool) -> anyhow::Result<Outcome> {
    let remote = Remote::new(&args.remote)?;
    let (base, generation, files) = list(&remote, args)?;
    let wanted: Vec<Listed> = files.into_iter().filter(|f| f.path.starts_with(&args.prefix)).collect();
    ensure!(!wanted.is_empty(), "there is no file to download");
    std::fs::create_dir_all(&args.out).with_context(|| format!("folder {}", args.out.display()))?;
    let (mut fetched, mut bytes) = (0, 0);
    for file in &wanted {
        let place = place(&args.out, &file.path)?;
        if is_there(&place, file)? {
            continue;
        }
        let escaped: Vec<String> = file.path.split('/').map(escaped).collect();
        let query = generation.map_or_else(String::new, |n| format!("?generation={n}"));
        fetch(&remote, &format!("{base}/files/{}{query}", escaped.join("/")), file, &place)?;
        fetched += 1;
        bytes += file.bytes;
        if !quiet {
            terminal::stderr_line(&file.path);
        }
    }
    let out = args.out.display();
    if args.json {
        terminal::json(
            &serde_json::json!({ "folder": args.out, "files": wanted.len(), "fetched": fetched, "bytes": bytes }),
        );
    } else {
        terminal::stdout(&format!("{} files in {out}, {fetched} of them fetched", wanted.len()));
    }
    Ok(Outcome::Success)
}

/// The address of what is wanted, its generation if it is a city, and its files.
fn list(remote: &Remote, args: &DownloadArgs) -> anyhow::Result<(String, Option<i64>, Vec<Listed>)> {
    if let Some(city) = &args.city {
        let base = format!("/cities/{}", escaped(city));
        let query = args.generation.map_or_else(String::new, |n| format!("?generation={n}"));
        let mut listed = remote.get(&format!("{base}/files{query}"))?;
        // All files of one generation, also if another is published meanwhile.
        let generation = listed["generation"].as_i64();
        return Ok((base, generation, serde_json::from_value(listed["files"].take())?));
    }
    let base = format!("/jobs/{}", escaped(args.job.as_deref().unwrap_or_default()));
    let listed = remote.get(&format!("{base}/files"))?;
    Ok((base, None, serde_json::from_value(listed)?))
}

/// Where a file is to be: below the folder, whatever the service calls it.
fn place(folder: &Path, path: &str) -> anyhow::Result<PathBuf> {
    let inside = !path.is_empty() && Path::new(path).components().all(|c| matches!(c, Component::Normal(_)));
    ensure!(inside, "the service names a file {path:?}, which would lie outside of the folder");
    Ok(folder.join(path))
}

fn is_there(place: &Path, file: &Listed) -> anyhow::Result<bool> {
    match File::open(place) {
        Ok(mut found) if found.metadata()?.len() == file.bytes => {
            let mut hasher = blake3::Hasher::new();
            hasher.update_reader(&mut found).with_context(|| place.display().to_string())?;
            Ok(hasher.finalize().to_hex().as_str() == file.hash)
        }
        _ => Ok(false),
    }
}

/// Fetches a file; it gets its name when it is whole and right.
fn fetch(remote: &Remote, address: &str, file: &Listed, place: &Path) -> anyhow::Result<()> {
    if let Some(folder) = place.parent() {
        std::fs::create_dir_all(folder).with_context(|| format!("folder {}", folder.display()))?;
    }
    let mut part = place.as_os_str().to_owned();
    part.push(".part");
    let part = PathBuf::from(part);
    let mut out = File::create(&part).with_context(|| part.display().to_string())?;
    // One byte more than there should be tells a file that is too long.
    let mut from = remote.file(address)?.take(file.bytes + 1);
    let mut hasher = blake3::Hasher::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        let read = from.read(&mut buffer).with_context(|| format!("while fetching {}", file.path))?;
        if read == 0 {
            break;
        }
        hasher.update(&buffer[..read]);
        out.write_all(&buffer[..read]).with_context(|| part.display().to_string())?;
    }
    if hasher.finalize().to_hex().as_str() != file.hash {
        std::fs::remove_file(&part).ok();
        bail!("{} came damaged: its hash is another; try again", file.path);
    }
    out.sync_all().and_then(|()| std::fs::rename(&part, place)).with_context(|| place.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_stay_in_the_folder() {
        let folder = Path::new("/tmp/out");
        assert_eq!(place(folder, "tiles/0_0.gml").unwrap(), folder.join("tiles/0_0.gml"));
        for bad in ["../x", "/etc/passwd", "a/../../x", "", "./x"] {
            assert!(place(folder, bad).is_err(), "{bad}");
        }
    }
}
