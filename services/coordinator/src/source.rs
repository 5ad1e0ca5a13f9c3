//! Where a job's mesh comes from, and whether the service may read it.

use std::path::{Path, PathBuf};

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
                 or start the service with --root FOLDER"
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
}
