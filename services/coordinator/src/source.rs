//! Where a job's mesh comes from, and whether the service may read it.

use std::path::{Path, PathBuf};

/// What stands before the id of an upload.
const UPLOAD: &str = "upload:";

/// What stands before the place of an object store.
const OBJECTS: &str = "s3://";

/// Where a mesh is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// A file or a folder, absolute and without links.
    File(PathBuf),
    /// An object, or all below a prefix: `s3://BUCKET/PREFIX`.
    Objects(String),
    /// An upload, by its id.
    Upload(String),
}

/// The id of the upload that a source names, if it names one.
pub(crate) fn upload(given: &str) -> Option<&str> {
    given.strip_prefix(UPLOAD)
}

/// The place that a source names, if it lies in one of the roots. Whether objects or an upload are there is not asked.
///
/// # Errors
/// If it does not.
pub fn locate(given: &str, roots: &[PathBuf]) -> Result<Source, SourceError> {
    let refused = || SourceError::NotAllowed(given.to_owned());
    if let Some(id) = given.strip_prefix(UPLOAD) {
        let plain = !id.is_empty() && id.len() <= 64 && id.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-');
        return if plain { Ok(Source::Upload(id.to_owned())) } else { Err(refused()) };
    }
    let Some(place) = given.strip_prefix(OBJECTS) else { return resolve(given, roots).map(Source::File) };
    let place = place.trim_end_matches('/');
    let strange = |c: char| c.is_control() || "?#%\\@".contains(c);
    if place.split('/').any(|part| matches!(part, "" | "." | "..")) || place.contains(strange) {
        return Err(refused());
    }
    let below = |root: &PathBuf| {
        let root = root.to_str().and_then(|r| r.strip_prefix(OBJECTS)).map(|r| r.trim_end_matches('/'));
        root.and_then(|r| place.strip_prefix(r)).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
    };
    if roots.iter().any(below) { Ok(Source::Objects(format!("{OBJECTS}{place}"))) } else { Err(refused()) }
}

/// Why a source is refused.
#[derive(Debug, PartialEq, Eq)]
pub enum SourceError {
    /// It is not there, or lies outside what the service may read. One message for both: a caller must not learn which
    /// files the machine has.
    NotAllowed(String),
}

impl std::fmt::Display for SourceError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotAllowed(given) => write!(
                f,
                "source {given:?} is not a file or folder under a source root of this service: put the mesh there, \
                 upload it, or start the service with --source-root FOLDER or s3://BUCKET/PREFIX"
            ),
        }
    }
}

/// The absolute path, without links, of a source that lies in one of the roots. A relative path is looked for in each root.
///
/// # Errors
/// If it is not there or outside of the roots, also by `..` or a link.
pub fn resolve(given: &str, roots: &[PathBuf]) -> Result<PathBuf, SourceError> {
    let refused = || SourceError::NotAllowed(given.to_owned());
    let path = Path::new(given);
    let found = roots.iter().filter_map(|root| root.join(path).canonicalize().ok().filter(|p| p.starts_with(root)));
    found.into_iter().next().ok_or_else(refused)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_lies_in_a_root_is_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let base = folder.path().canonicalize().expect("absolute");
        let (root, other) = (base.join("root"), base.join("root2"));
        for dir in [&root, &other] {
            std::fs::create_dir(dir).expect("made");
            std::fs::write(dir.join("mesh.obj"), "").expect("written");
        }
        std::os::unix::fs::symlink(other.join("mesh.obj"), root.join("link.obj")).expect("linked");
        let roots = [root.clone()];
        assert_eq!(resolve("mesh.obj", &roots), Ok(root.join("mesh.obj")));
        let absolute = root.join("mesh.obj");
        assert_eq!(resolve(&absolute.to_string_lossy(), &roots), Ok(absolute));
        let outside = other.join("mesh.obj").to_string_lossy().into_owned();
        for bad in ["../root2/mesh.obj", "link.obj", "none.obj", "/etc/passwd", &outside, "mesh.obj\0"] {
            assert_eq!(resolve(bad, &roots), Err(SourceError::NotAllowed(bad.to_owned())), "{bad}");
        }
        assert_eq!(resolve("../root2/mesh.obj", &[root, other.clone()]), Ok(other.join("mesh.obj")), "it is in a root");
    }

    #[test]
    fn only_what_lies_in_a_bucket_that_is_a_root_is_read() {
        let roots = ["s3://meshes/delft/", "s3://open", "/"].map(PathBuf::from);
        for (given, place) in [
            ("s3://meshes/delft", "s3://meshes/delft"),
            ("s3://meshes/delft/2026/", "s3://meshes/delft/2026"),
            ("s3://open/any/thing.ply", "s3://open/any/thing.ply"),
        ] {
            assert_eq!(locate(given, &roots), Ok(Source::Objects(place.to_owned())));
        }
        for bad in [
            "s3://meshes",
            "s3://meshes/delft2",
            "s3://meshes/delft/../leiden",
            "s3://meshes/delft//x",
            "s3://open2",
            "s3://",
            "s3://open@evil/x",
            "s3://open/a?versionId=1",
            "s3://open/%2e%2e/x",
            "http://open/x",
            "s3:/open/x",
            "gs://open/x",
        ] {
            assert_eq!(locate(bad, &roots), Err(SourceError::NotAllowed(bad.to_owned())), "{bad}");
        }
        let (id, none) = ("0197-ab", &roots[..0]);
        assert_eq!(locate(&format!("upload:{id}"), none), Ok(Source::Upload(id.to_owned())));
        for bad in ["upload:", "upload:../x", "upload:a/b"] {
            assert_eq!(locate(bad, none), Err(SourceError::NotAllowed(bad.to_owned())), "{bad}");
        }
    }
}
