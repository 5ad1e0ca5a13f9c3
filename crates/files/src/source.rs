//! Where a job's mesh may come from, and what it may name.

use crate::{FileError, Reach};
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

impl Source {
    /// The id of the upload that a source names, if it names one.
    #[must_use]
    pub fn upload(given: &str) -> Option<&str> {
        given.strip_prefix(UPLOAD)
    }

    /// The place in an object store that a source names, if it names one. Whether it may be read is not asked.
    #[must_use]
    pub fn objects(given: &str) -> Option<&str> {
        given.starts_with(OBJECTS).then(|| given.trim_end_matches('/'))
    }
}

/// Why a source is refused: it is not there, or lies outside what the service may read. One message for both: a caller must not
/// learn which files the machine has.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "source {0:?} is not a file or folder under a source root of this service: put the mesh there, upload it, or start the \
     service with --source-root FOLDER or s3://BUCKET/PREFIX"
)]
pub struct SourceError(pub String);

/// What may be sources of jobs: folders, and places such as `s3://BUCKET/PREFIX`.
#[derive(Clone, Debug, Default)]
pub struct SourceRoots {
    /// Absolute, without links.
    folders: Vec<PathBuf>,
    objects: Vec<String>,
    /// What a service keeps for itself: no source, also where it lies in a root.
    own: Vec<PathBuf>,
}

impl SourceRoots {
    /// Roots as a user names them. What is in `own`, or below it, is no source.
    ///
    /// # Errors
    /// If a folder is not there.
    pub fn new(
        roots: impl IntoIterator<Item = PathBuf>,
        own: impl IntoIterator<Item = PathBuf>,
    ) -> Result<Self, FileError> {
        let mut found = Self { own: own.into_iter().collect(), ..Self::default() };
        for root in roots {
            match root.to_str().filter(|root| root.starts_with(OBJECTS)) {
                Some(place) => found.objects.push(place.trim_end_matches('/').to_owned()),
                None => found.folders.push(root.canonicalize().map_err(|e| FileError::of(&root, e))?),
            }
        }
        Ok(found)
    }

    /// The roots: folders, absolute and without links, then places in object stores.
    pub fn places(&self) -> impl Iterator<Item = PathBuf> + '_ {
        self.folders.iter().cloned().chain(self.objects.iter().map(PathBuf::from))
    }

    /// What is no source although it may lie in a root.
    #[must_use]
    pub fn own(&self) -> &[PathBuf] {
        &self.own
    }

    /// The place that a source names, if it lies in one of the roots. Whether objects or an upload are there is not asked.
    ///
    /// # Errors
    /// If it does not.
    pub fn locate(&self, given: &str) -> Result<Source, SourceError> {
        let refused = || SourceError(given.to_owned());
        if let Some(id) = Source::upload(given) {
            let plain = !id.is_empty() && id.len() <= 64 && id.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-');
            return if plain { Ok(Source::Upload(id.to_owned())) } else { Err(refused()) };
        }
        let Some(place) = Source::objects(given) else { return self.resolve(given).map(Source::File) };
        let inner = place.strip_prefix(OBJECTS).unwrap_or_default();
        let strange = |c: char| c.is_control() || "?#%\\@".contains(c);
        if inner.split('/').any(|part| matches!(part, "" | "." | "..")) || inner.contains(strange) {
            return Err(refused());
        }
        let below = |root: &String| {
            place.strip_prefix(root.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        };
        if self.objects.iter().any(below) { Ok(Source::Objects(place.to_owned())) } else { Err(refused()) }
    }

    /// The absolute path, without links, of a file or folder that lies in one of the roots. A relative path is looked for in
    /// each root.
    ///
    /// # Errors
    /// If it is not there or outside of the roots, also by `..` or a link.
    pub fn resolve(&self, given: &str) -> Result<PathBuf, SourceError> {
        let found = self.folders.iter().find_map(|root| self.inside(root).resolve(&root.join(Path::new(given))).ok());
        found.ok_or_else(|| SourceError(given.to_owned()))
    }

    /// What a mesh may name that lies at a path from [`SourceRoots::resolve`]: what is in the same root.
    ///
    /// # Errors
    /// If it lies in none.
    pub fn reach_of(&self, mesh: &Path) -> Result<Reach, SourceError> {
        let root = self.folders.iter().find(|root| mesh.starts_with(root));
        root.map(|root| self.inside(root)).ok_or_else(|| SourceError(mesh.display().to_string()))
    }

    fn inside(&self, root: &Path) -> Reach {
        Reach::of_resolved([root.to_owned()].into()).except(&self.own)
    }
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
        let within = |roots: &[&PathBuf]| SourceRoots::new(roots.iter().map(|r| (*r).clone()), []).expect("there");
        let roots = within(&[&root]);
        assert_eq!(roots.resolve("mesh.obj"), Ok(root.join("mesh.obj")));
        let absolute = root.join("mesh.obj");
        assert_eq!(roots.resolve(&absolute.to_string_lossy()), Ok(absolute));
        let outside = other.join("mesh.obj").to_string_lossy().into_owned();
        for bad in ["../root2/mesh.obj", "link.obj", "none.obj", "/etc/passwd", &outside, "mesh.obj\0"] {
            assert_eq!(roots.resolve(bad), Err(SourceError(bad.to_owned())), "{bad}");
        }
        let both = within(&[&root, &other]);
        assert_eq!(both.resolve("../root2/mesh.obj"), Ok(other.join("mesh.obj")), "it is in a root");
        // What a mesh names has to lie in the root of the mesh, not in another.
        let reach = both.reach_of(&root.join("mesh.obj")).expect("in a root");
        assert!(reach.is_file(&root.join("mesh.obj")) && !reach.is_file(&other.join("mesh.obj")));
        assert!(both.reach_of(Path::new("/etc/passwd")).is_err());
        assert!(SourceRoots::new([base.join("none")], []).is_err());
    }

    #[test]
    fn what_a_service_keeps_for_itself_is_no_source() {
        let folder = tempfile::tempdir().expect("a folder");
        let root = folder.path().canonicalize().expect("absolute");
        let data = root.join("gable-data");
        std::fs::create_dir(&data).expect("made");
        for name in ["jobs.db", "mesh.obj"] {
            std::fs::write(data.join(name), "secret").expect("written");
        }
        std::os::unix::fs::symlink(&data, root.join("link")).expect("linked");
        std::fs::write(root.join("mesh.obj"), "").expect("written");
        let roots = SourceRoots::new([root.clone()], [data]).expect("there");
        for bad in
            ["gable-data/mesh.obj", "gable-data/jobs.db", "gable-data", "link/mesh.obj", "./link/../gable-data/jobs.db"]
        {
            assert!(roots.resolve(bad).is_err(), "{bad}");
        }
        let reach = roots.reach_of(&roots.resolve("mesh.obj").expect("it is a source")).expect("in a root");
        assert!(
            reach.read(&root.join("gable-data/jobs.db"), 10).is_err() && !reach.is_file(&root.join("link/jobs.db"))
        );
    }

    #[test]
    fn only_what_lies_in_a_bucket_that_is_a_root_is_read() {
        let roots = SourceRoots::new(["s3://meshes/delft/", "s3://open", "/"].map(PathBuf::from), []).expect("there");
        for (given, place) in [
            ("s3://meshes/delft", "s3://meshes/delft"),
            ("s3://meshes/delft/2026/", "s3://meshes/delft/2026"),
            ("s3://open/any/thing.ply", "s3://open/any/thing.ply"),
        ] {
            assert_eq!(roots.locate(given), Ok(Source::Objects(place.to_owned())));
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
            assert_eq!(roots.locate(bad), Err(SourceError(bad.to_owned())), "{bad}");
        }
        let (id, none) = ("0197-ab", SourceRoots::default());
        assert_eq!(none.locate(&format!("upload:{id}")), Ok(Source::Upload(id.to_owned())));
        for bad in ["upload:", "upload:../x", "upload:a/b"] {
            assert_eq!(none.locate(bad), Err(SourceError(bad.to_owned())), "{bad}");
        }
    }
}
