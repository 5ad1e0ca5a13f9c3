//! Files that a mesh names, found where they really lie: in another letter case, beside the mesh, or in a folder of textures.
//!
//! Meshes are made on one machine and read on another: names in them are absolute paths of the first, or differ in letter case, and
//! folders were packed flat or sorted since. Whatever is found is opened by [`Reach`], inside of its roots only.

use crate::budget;
use gable_files::Reach;
use std::collections::{BTreeMap, HashMap};
use std::path::{Component, Path, PathBuf};

/// Entries of a folder that are looked at.
const LISTED: usize = 20_000;
/// Folders below the one of a mesh in which a file is looked for by its mere name.
const DEPTH: usize = 2;
/// Names of folders beside the one of a mesh in which textures lie.
const BESIDE: [&str; 9] = ["textures", "texture", "tex", "images", "image", "maps", "materials", "material", "jpg"];

/// Where a file is that a mesh names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    /// Its path; where it was not found, the path as it is named.
    pub path: PathBuf,
    /// Whether it is there, and may be opened.
    pub is_there: bool,
    /// Whether it lies in another place than the named one; the letter case is no matter.
    pub elsewhere: bool,
}

/// Looks for files, and remembers what is in the folders that it has seen.
#[derive(Debug)]
pub struct Lookup<'a> {
    reach: &'a Reach,
    /// Entries by their small letters; looked up only, never iterated.
    folders: HashMap<PathBuf, BTreeMap<String, PathBuf>>,
    /// Names of files below a folder, none where several bear it; looked up only, never iterated.
    below: HashMap<PathBuf, HashMap<String, Option<PathBuf>>>,
    /// How many more entries are looked at.
    left: usize,
}

impl<'a> Lookup<'a> {
    /// Looks within `reach`.
    #[must_use]
    pub fn new(reach: &'a Reach) -> Self {
        Self { reach, folders: HashMap::new(), below: HashMap::new(), left: budget::ENTRIES }
    }

    /// What may be opened.
    pub(crate) fn reach(&self) -> &'a Reach {
        self.reach
    }

    /// Finds a file by the name that a file in the first of `folders` has for it, with slashes of either kind. The order:
    ///
    /// 1. as it is named, seen from the first folder;
    /// 2. the same in any letter case, from each folder;
    /// 3. by the end of its path, the longest first, from each folder;
    /// 4. by its mere name, if one file alone bears it two folders deep;
    /// 5. by its mere name in a folder `textures`, `images`, … beside.
    pub fn find(&mut self, folders: &[&Path], name: &[u8]) -> Found {
        let name = String::from_utf8_lossy(name.trim_ascii()).into_owned();
        let name = name.trim_matches('"');
        let slashed = name.replace('\\', "/");
        let first = folders.first().copied().unwrap_or(Path::new(""));
        let found = |path: PathBuf, elsewhere| Found { path, is_there: true, elsewhere };
        for plain in [first.join(name), first.join(&slashed)] {
            if self.reach.is_file(&plain) {
                return found(plain, false);
            }
        }
        let missing = Found { path: first.join(&slashed), is_there: false, elsewhere: false };
        let is_absolute = slashed.starts_with('/') || slashed.as_bytes().get(1) == Some(&b':');
        let parts: Vec<Component<'_>> = Path::new(&slashed).components().collect();
        if !is_absolute {
            for (at, folder) in folders.iter().enumerate() {
                if let Some(path) = self.in_any_case(folder, &parts) {
                    return found(path, at > 0);
                }
            }
        }
        let is_name =
            |part: &Component<'_>| matches!(part, Component::Normal(name) if !name.to_string_lossy().ends_with(':'));
        let normal: Vec<Component<'_>> = parts.into_iter().filter(is_name).collect();
        let Some(Component::Normal(last)) = normal.last().copied() else { return missing };
        for start in 0..normal.len() {
            for folder in folders {
                if let Some(path) = self.in_any_case(folder, &normal[start..]) {
                    return found(path, true);
                }
            }
        }
        let last = last.to_string_lossy().to_lowercase();
        for folder in folders {
            if let Some(path) = self.below(folder).get(&last).cloned().flatten() {
                return found(path, true);
            }
        }
        for folder in folders {
            let Some(parent) = parent(folder) else { continue };
            for name in BESIDE {
                let Some(beside) = self.entries(&parent).get(name).cloned() else { continue };
                if let Some(path) = self.entries(&beside).get(&last).cloned().filter(|path| self.reach.is_file(path)) {
                    return found(path, true);
                }
            }
        }
        missing
    }

    /// The file at the end of a path from a folder, whatever the letter case of its parts.
    fn in_any_case(&mut self, folder: &Path, parts: &[Component<'_>]) -> Option<PathBuf> {
        let mut place = folder.to_owned();
        for part in parts {
            place = match part {
                Component::Normal(name) => self.entries(&place).get(&name.to_string_lossy().to_lowercase())?.clone(),
                Component::ParentDir => parent(&place)?,
                Component::CurDir => place,
                Component::RootDir | Component::Prefix(_) => return None,
            };
        }
        self.reach.is_file(&place).then_some(place)
    }

    /// What is in a folder, by small letters; of names that differ in letter case only, the first.
    fn entries(&mut self, folder: &Path) -> &BTreeMap<String, PathBuf> {
        if !self.folders.contains_key(folder) {
            let place = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
            let listed = self.reach.list(place, LISTED.min(self.left)).unwrap_or_default();
            self.left -= listed.len();
            let mut entries = BTreeMap::new();
            for path in listed {
                if let Some(name) = path.file_name() {
                    entries.entry(name.to_string_lossy().to_lowercase()).or_insert(path);
                }
            }
            self.folders.insert(folder.to_owned(), entries);
        }
        &self.folders[folder]
    }

    /// The files below a folder.
    fn below(&mut self, folder: &Path) -> &HashMap<String, Option<PathBuf>> {
        if !self.below.contains_key(folder) {
            let mut all: HashMap<String, Option<PathBuf>> = HashMap::new();
            let mut open = vec![(folder.to_owned(), DEPTH)];
            while let Some((place, depth)) = open.pop() {
                let entries: Vec<(String, PathBuf)> =
                    self.entries(&place).iter().map(|(name, path)| (name.clone(), path.clone())).collect();
                for (name, path) in entries {
                    if self.reach.is_file(&path) {
                        // Several of one name: none of them is known to be meant.
                        all.entry(name).and_modify(|known| *known = None).or_insert(Some(path));
                    } else if depth > 0 && self.reach.is_folder(&path) {
                        open.push((path, depth - 1));
                    }
                }
            }
            self.below.insert(folder.to_owned(), all);
        }
        &self.below[folder]
    }
}

/// The folder above; none for a path that begins there.
fn parent(folder: &Path) -> Option<PathBuf> {
    match folder.components().next_back() {
        Some(Component::Normal(_)) => folder.parent().map(Path::to_owned),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree(files: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        for file in files {
            let path = folder.path().join(file);
            std::fs::create_dir_all(path.parent().expect("a parent")).expect("made");
            std::fs::write(path, "x").expect("written");
        }
        folder
    }

    #[test]
    fn files_are_found_where_they_lie() {
        let base = tree(&[
            "in/mesh/Roof.JPG",
            "in/mesh/Maps/Wall.png",
            "in/mesh/a/twice.jpg",
            "in/mesh/b/twice.jpg",
            "in/mesh/c/d/deep.jpg",
            "in/mesh/c/d/e/deeper.jpg",
            "in/Textures/beside.jpg",
            "in/other/unrelated.jpg",
            "secret.jpg",
        ]);
        let reach = Reach::within([base.path().join("in")]).expect("there");
        let mesh = base.path().join("in/mesh");
        let mut lookup = Lookup::new(&reach);
        let mut find = |name: &str| {
            let found = lookup.find(&[&mesh], name.as_bytes());
            let path = found.path.strip_prefix(base.path()).unwrap_or(&found.path).display().to_string();
            found.is_there.then_some((path, found.elsewhere))
        };
        let at = |path: &str, elsewhere| Some((format!("in/{path}"), elsewhere));
        assert_eq!(find("Roof.JPG"), at("mesh/Roof.JPG", false));
        assert_eq!(find(" \"roof.jpg\" "), at("mesh/Roof.JPG", false));
        assert_eq!(find("maps\\WALL.PNG"), at("mesh/Maps/Wall.png", false));
        assert_eq!(find("./maps/wall.png"), at("mesh/Maps/Wall.png", false));
        assert_eq!(find("../MESH/roof.jpg"), at("mesh/Roof.JPG", false));
        assert_eq!(find("C:\\Users\\me\\city\\maps\\wall.png"), at("mesh/Maps/Wall.png", true));
        assert_eq!(find("/home/me/roof.jpg"), at("mesh/Roof.JPG", true));
        assert_eq!(find("lost/roof.jpg"), at("mesh/Roof.JPG", true));
        assert_eq!(find("wall.png"), at("mesh/Maps/Wall.png", true));
        assert_eq!(find("deep.jpg"), at("mesh/c/d/deep.jpg", true));
        assert_eq!(find("beside.jpg"), at("Textures/beside.jpg", true));
        for none in ["twice.jpg", "deeper.jpg", "unrelated.jpg", "../../secret.jpg", "secret.jpg", "none.jpg", "..", ""]
        {
            assert_eq!(find(none), None, "{none}");
        }
    }

    #[test]
    fn links_lead_nowhere_outside() {
        let base = tree(&["in/mesh/a.obj", "out/roof.jpg"]);
        let mesh = base.path().join("in/mesh");
        std::os::unix::fs::symlink(base.path().join("out"), mesh.join("textures")).expect("linked");
        std::os::unix::fs::symlink(base.path().join("out/roof.jpg"), mesh.join("Wall.jpg")).expect("linked");
        let reach = Reach::within([base.path().join("in")]).expect("there");
        let mut lookup = Lookup::new(&reach);
        for name in ["roof.jpg", "textures/roof.jpg", "Textures/Roof.jpg", "wall.jpg", "Wall.jpg", "../../out/roof.jpg"]
        {
            assert!(!lookup.find(&[&mesh], name.as_bytes()).is_there, "{name}");
        }
    }
}
