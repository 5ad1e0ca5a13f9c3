//! Which files may be opened, and the opening.

use crate::{FileError, Refusal};
use std::fs::{File, Metadata};
use std::io::Read as _;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// Which files may be opened.
#[derive(Clone, Debug, Default)]
pub struct Reach {
    /// Absolute, without links; none where everything may be read that the system lets read.
    roots: Option<Arc<[PathBuf]>>,
    /// What may not be opened although it lies in a root; absolute, without links.
    hidden: Arc<[PathBuf]>,
}

impl Reach {
    /// All that the system lets this process read: for files of a person's own machine.
    #[must_use]
    pub fn everything() -> Self {
        Self::default()
    }

    /// What lies in one of some folders, or is one of some files.
    ///
    /// # Errors
    /// If one is not there.
    pub fn within(roots: impl IntoIterator<Item = impl AsRef<Path>>) -> Result<Self, FileError> {
        let resolved = roots.into_iter().map(|root| {
            let root = root.as_ref();
            root.canonicalize().map_err(|e| FileError::of(root, e))
        });
        Ok(Self::of_resolved(resolved.collect::<Result<_, _>>()?))
    }

    /// What lies in folders whose paths are absolute and without links.
    pub(crate) fn of_resolved(roots: Arc<[PathBuf]>) -> Self {
        Self { roots: Some(roots), hidden: Arc::default() }
    }

    /// The same without some files and folders, whether they are there yet or not. It has no meaning where everything may be read.
    #[must_use]
    pub fn except(self, hidden: &[PathBuf]) -> Self {
        let resolved = |path: &PathBuf| {
            let missing = || Some(path.parent()?.canonicalize().ok()?.join(path.file_name()?));
            path.canonicalize().ok().or_else(missing).unwrap_or_else(|| path.clone())
        };
        Self { hidden: hidden.iter().map(resolved).collect(), ..self }
    }

    /// The folders and files in which everything has to lie: absolute, without links; none where everything may be read.
    #[must_use]
    pub fn roots(&self) -> Option<&[PathBuf]> {
        self.roots.as_deref()
    }

    /// Where a path leads: absolute, without links, where there are roots; as it is given where there are none.
    ///
    /// # Errors
    /// If it leads out of the roots, or nothing is there.
    pub fn resolve(&self, path: &Path) -> Result<PathBuf, FileError> {
        let Some(roots) = &self.roots else {
            return match std::fs::metadata(path) {
                Ok(_) => Ok(path.to_owned()),
                Err(e) => Err(FileError::of(path, e)),
            };
        };
        let inside = |place: &Path| {
            let starts = |root: &PathBuf| place.starts_with(root);
            roots.iter().any(starts) && !self.hidden.iter().any(starts)
        };
        let outside = || Refusal::Outside.at(path);
        match path.canonicalize() {
            Ok(place) if inside(&place) => Ok(place),
            Ok(_) => Err(outside()),
            // Whether something is missing is told only of places that are inside as they are written.
            Err(e) => {
                let written =
                    std::path::absolute(path).ok().filter(|p| !p.components().any(|c| c == Component::ParentDir));
                if written.is_some_and(|place| inside(&place)) { Err(FileError::of(path, e)) } else { Err(outside()) }
            }
        }
    }

    /// Opens a regular file.
    ///
    /// # Errors
    /// If it is not there, not regular, or leads out of the roots.
    pub fn open(&self, path: &Path) -> Result<File, FileError> {
        self.open_resolved(path).map(|(file, _)| file)
    }

    /// The length of a regular file, bytes.
    ///
    /// # Errors
    /// As [`Reach::open`].
    pub fn length(&self, path: &Path) -> Result<u64, FileError> {
        self.open_resolved(path).map(|(_, status)| status.len())
    }

    /// All bytes of a regular file, at most `most` of them.
    ///
    /// # Errors
    /// As [`Reach::open`], and if it is longer.
    pub fn read(&self, path: &Path, most: u64) -> Result<Vec<u8>, FileError> {
        let (file, status) = self.open_resolved(path)?;
        let too_long = || Refusal::TooLong { most }.at(path);
        if status.len() > most {
            return Err(too_long());
        }
        let mut bytes = Vec::with_capacity(usize::try_from(status.len()).unwrap_or(0));
        // A file may grow, and some systems' files have no length.
        file.take(most.saturating_add(1)).read_to_end(&mut bytes).map_err(|e| FileError::of(path, e))?;
        if bytes.len() as u64 > most { Err(too_long()) } else { Ok(bytes) }
    }

    /// The text of a regular file in UTF-8, at most `most` bytes of it.
    ///
    /// # Errors
    /// As [`Reach::read`], and if it is no text.
    pub fn read_text(&self, path: &Path, most: u64) -> Result<String, FileError> {
        let bytes = self.read(path, most)?;
        String::from_utf8(bytes).map_err(|e| Refusal::NotText { at: e.utf8_error().valid_up_to() }.at(path))
    }

    /// Whether a regular file is there that may be opened.
    #[must_use]
    pub fn is_file(&self, path: &Path) -> bool {
        self.resolve(path).is_ok_and(|place| place.is_file())
    }

    /// Whether a folder is there that may be looked into.
    #[must_use]
    pub fn is_folder(&self, path: &Path) -> bool {
        self.resolve(path).is_ok_and(|place| place.is_dir())
    }

    /// The paths of what is in a folder, in the order of their names. What leads out of the roots is among them: it
    /// cannot be opened.
    ///
    /// # Errors
    /// If it is no folder, leads out of the roots, or has more than `most` entries.
    pub fn list(&self, folder: &Path, most: usize) -> Result<Vec<PathBuf>, FileError> {
        let wrong = |e| FileError::of(folder, e);
        let place = self.resolve(folder)?;
        let mut found = Vec::new();
        for entry in std::fs::read_dir(place).map_err(wrong)? {
            found.push(folder.join(entry.map_err(wrong)?.file_name()));
            if found.len() > most {
                return Err(Refusal::TooMany { most }.at(folder));
            }
        }
        found.sort();
        Ok(found)
    }

    fn open_resolved(&self, path: &Path) -> Result<(File, Metadata), FileError> {
        let place = self.resolve(path)?;
        let wrong = |e| FileError::of(path, e);
        let not_regular = || Refusal::NotRegular.at(path);
        // Opening some devices does something: so they are not opened in the first place.
        if !std::fs::metadata(&place).map_err(wrong)?.is_file() {
            return Err(not_regular());
        }
        // A pipe that was put in its place must not hang, and where there are roots no link may have been.
        let mut flags = nix::libc::O_NONBLOCK;
        if self.roots.is_some() {
            flags |= nix::libc::O_NOFOLLOW;
        }
        let file = File::options().read(true).custom_flags(flags).open(&place).map_err(wrong)?;
        let status = file.metadata().map_err(wrong)?;
        if status.is_file() { Ok((file, status)) } else { Err(not_regular()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;
    use tempfile::TempDir;

    /// A folder with a root in it, and a secret beside the root.
    fn place() -> (TempDir, PathBuf, Reach) {
        let folder = TempDir::new().unwrap();
        let root = folder.path().join("root");
        std::fs::create_dir_all(root.join("inner")).unwrap();
        std::fs::write(root.join("mesh.bin"), "bytes").unwrap();
        std::fs::write(folder.path().join("secret"), "hunter2").unwrap();
        std::fs::create_dir(folder.path().join("root2")).unwrap();
        std::fs::write(folder.path().join("root2/other"), "hunter2").unwrap();
        let reach = Reach::within([&root]).unwrap();
        (folder, root, reach)
    }

    #[test]
    fn what_lies_in_a_root_is_read() {
        let (_folder, root, reach) = place();
        symlink("../mesh.bin", root.join("inner/link")).unwrap();
        for path in ["mesh.bin", "inner/../mesh.bin", "inner/link", "./mesh.bin"] {
            assert_eq!(reach.read(&root.join(path), 5).unwrap(), b"bytes", "{path}");
            assert!(reach.is_file(&root.join(path)));
        }
        assert!(reach.is_folder(&root.join("inner")) && !reach.is_file(&root.join("inner")));
        assert!(matches!(reach.read(&root.join("none"), 5), Err(FileError { kind: Refusal::NotFound, .. })));
        assert!(matches!(reach.read(&root.join("mesh.bin/none"), 5), Err(FileError { kind: Refusal::NotFound, .. })));
        assert_eq!(reach.length(&root.join("mesh.bin")).unwrap(), 5);
        assert_eq!(reach.list(&root, 10).unwrap(), [root.join("inner"), root.join("mesh.bin")]);
        assert!(reach.list(&root, 1).is_err());
    }

    #[test]
    fn no_way_leads_out() {
        let (folder, root, reach) = place();
        symlink(folder.path().join("secret"), root.join("link")).unwrap();
        symlink(folder.path(), root.join("inner/up")).unwrap();
        symlink(root.join("link"), root.join("chain")).unwrap();
        symlink("gone/secret", root.join("dangling")).unwrap();
        let absolute = folder.path().join("secret").display().to_string();
        let outside = [
            "../secret",
            "../none",
            "inner/../../secret",
            "inner/../../none",
            "link",
            "chain",
            "inner/up/secret",
            "../root2/other",
            "/etc/passwd",
            "/etc/none-such",
            &absolute,
        ];
        for path in outside {
            let path = root.join(path);
            for error in
                [reach.read(&path, 1 << 20).map(drop), reach.open(&path).map(drop), reach.length(&path).map(drop)]
            {
                let error = error.expect_err("it is outside");
                assert!(matches!(error, FileError { kind: Refusal::Outside, .. }), "{}: {error}", path.display());
                assert!(!error.to_string().contains("hunter2"));
            }
            assert!(!reach.is_file(&path));
        }
        assert!(reach.list(&root.join("inner/up"), 10).is_err());
        assert!(reach.read(&root.join("dangling"), 10).is_err());
    }

    #[test]
    fn pipes_and_devices_are_refused_and_never_wait() {
        let (_folder, root, reach) = place();
        let made = std::process::Command::new("mkfifo").arg(root.join("pipe")).status().unwrap();
        assert!(made.success());
        symlink("/dev/zero", root.join("zero")).unwrap();
        let anywhere = Reach::everything();
        for path in [root.join("pipe"), root.join("zero"), PathBuf::from("/dev/zero"), root.join("inner")] {
            assert!(reach.read(&path, 10).is_err(), "{}", path.display());
            assert!(
                matches!(anywhere.read(&path, 10), Err(FileError { kind: Refusal::NotRegular, .. })),
                "{}",
                path.display()
            );
        }
        assert!(matches!(reach.read(&root.join("pipe"), 10), Err(FileError { kind: Refusal::NotRegular, .. })));
    }

    #[test]
    fn budgets_hold_whatever_the_length_says() {
        let (_folder, root, reach) = place();
        let error = reach.read(&root.join("mesh.bin"), 4).unwrap_err();
        assert!(error.to_string().ends_with("has more than the 4 bytes that are read of such a file"), "{error}");
        // The system says that this has no bytes.
        let error = Reach::everything().read(Path::new("/proc/self/maps"), 100).unwrap_err();
        assert!(matches!(error, FileError { kind: Refusal::TooLong { .. }, .. }), "{error}");
        std::fs::write(root.join("text"), b"ab\xff").unwrap();
        assert!(matches!(
            reach.read_text(&root.join("text"), 10),
            Err(FileError { kind: Refusal::NotText { at: 2 }, .. })
        ));
        assert_eq!(reach.read_text(&root.join("mesh.bin"), 10).unwrap(), "bytes");
    }
}
