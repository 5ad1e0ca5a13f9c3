//! Sending a mesh that the service cannot see: in parts, each with its hash, so that a connection that breaks costs one of them, and
//! the same command goes on where it was cut off.

mod companions;
mod pack;
mod parts;

use crate::exit::UsageError;
use crate::remote::Remote;
use crate::terminal;
use anyhow::Context as _;
use parts::PartSender;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Meshes that are sent as they are.
const WHOLE: [&str; 8] = ["zip", "7z", "tar", "tgz", "tzst", "ply", "off", "glb"];

/// A mesh on this machine.
#[derive(Debug)]
pub(crate) enum Mesh {
    /// One file, sent as it is.
    File(PathBuf),
    /// Files of a folder, packed while they are sent. Their paths are from the folder.
    Files { name: String, folder: PathBuf, files: Vec<PathBuf> },
}

impl Mesh {
    /// The mesh at a path; with an OBJ file go its libraries and textures.
    ///
    /// # Errors
    /// If it is no mesh, or cannot be read.
    pub(crate) fn at(path: &Path) -> anyhow::Result<Self> {
        let path = path.canonicalize().map_err(|e| UsageError(format!("{}: {e}", path.display())))?;
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        if path.is_dir() {
            let files = pack::files_below(&path)?;
            if files.is_empty() {
                return Err(UsageError(format!("{}: the folder has no file", path.display())).into());
            }
            return Ok(Self::Files { name: format!("{}.zip", plain(&name)), folder: path, files });
        }
        let end = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        let packed = ["tar.gz", "tar.zst"].iter().any(|end| name.to_lowercase().ends_with(&format!(".{end}")));
        if packed || WHOLE.contains(&&*end) {
            return Ok(Self::File(path));
        }
        if end != "obj" {
            let text = format!(
                "{} is no mesh that can be sent: give a folder, or a file that ends with .zip, .7z, .tar, .tar.gz, .tar.zst, .ply, .off, .glb or .obj",
                path.display()
            );
            return Err(UsageError(text).into());
        }
        let folder = path.parent().unwrap_or(Path::new("/")).to_owned();
        let files = companions::of_obj(&path)?;
        Ok(Self::Files { name: format!("{}.zip", plain(&name)), folder, files })
    }

    /// The name under which it is sent.
    fn name(&self) -> String {
        match self {
            Self::File(path) => plain(&path.file_name().unwrap_or_default().to_string_lossy()),
            Self::Files { name, .. } => name.clone(),
        }
    }

    /// Bytes of its files.
    fn bytes(&self) -> anyhow::Result<u64> {
        Ok(match self {
            Self::File(path) => std::fs::metadata(path)?.len(),
            Self::Files { folder, files, .. } => {
                let mut bytes = 0;
                for file in files {
                    bytes += std::fs::metadata(folder.join(file))?.len();
                }
                bytes
            }
        })
    }
}

/// A name as the service takes it: letters, digits, spaces, and signs that mean nothing in a path.
fn plain(name: &str) -> String {
    let fits = |c: char| if c.is_alphanumeric() || "._- ()[]{},;'+&!#@=~^%$".contains(c) { c } else { '_' };
    let name: String = name.chars().map(fits).collect();
    let name = name.trim_start_matches('.');
    // The end of the name says what it is.
    let long = name.chars().count().saturating_sub(60);
    let name: String = name.chars().skip(long).collect();
    if name.is_empty() { "mesh".to_owned() } else { name }
}

/// Writes a file as it is.
fn whole(path: &Path, mut out: impl Write) -> anyhow::Result<()> {
    let mut file = std::fs::File::open(path).with_context(|| format!("file {}", path.display()))?;
    std::io::copy(&mut file, &mut out).with_context(|| format!("file {}", path.display()))?;
    Ok(())
}

/// Sends a mesh; gives what a job names as its source.
///
/// # Errors
/// If it cannot be read, or the service refuses it or stays away.
pub(crate) fn send(remote: &Remote, mesh: &Mesh, city: &str, quiet: bool) -> anyhow::Result<String> {
    let bytes = mesh.bytes()?;
    let mut sender = PartSender::open(remote, &mesh.name(), city, bytes, quiet)?;
    if !quiet {
        terminal::stderr_line(&format!(
            "sending {} ({:.1} MB), for the service cannot see it",
            mesh.name(),
            bytes as f64 / 1e6
        ));
    }
    let read = match mesh {
        Mesh::File(path) => whole(path, &mut sender),
        Mesh::Files { folder, files, .. } => pack::pack(folder, files, &mut sender),
    };
    read.map_err(|e| sender.explain(e))?;
    sender.complete()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_that_a_service_takes() {
        assert_eq!(plain("delft (2026), a+b & c's [x].zip"), "delft (2026), a+b & c's [x].zip");
        assert_eq!(plain("a/b:c\"d.zip"), "a_b_c_d.zip");
        assert_eq!(plain(".hidden"), "hidden");
        assert_eq!(plain("…"), "_");
        assert_eq!(plain(""), "mesh");
        let long = plain(&format!("{}.ply", "é".repeat(300)));
        assert!(long.ends_with(".ply") && long.len() <= 200, "{long}");
    }

    #[test]
    fn what_is_no_mesh_is_not_sent() {
        let folder = tempfile::tempdir().unwrap();
        let told = |path: &Path| Mesh::at(path).unwrap_err().to_string();
        assert!(told(folder.path()).contains("has no file"));
        std::fs::write(folder.path().join("passwd"), "root").unwrap();
        assert!(told(&folder.path().join("passwd")).contains("no mesh that can be sent"));
        assert!(told(&folder.path().join("none.ply")).contains("none.ply"));
    }
}
