//! What users are told of the files of this machine: names inside of the source root or the task's folder, and no absolute path.
//!
//! The log of the service tells operators the paths as they are. Reasons, events, phases and what a task says are seen by tenants.

use std::path::Path;

/// Folders of this machine, and what stands for them in what users are told.
#[derive(Debug)]
pub(crate) struct Places {
    /// Longest first, so that a folder in another one is found.
    folders: Vec<(String, Shown)>,
}

/// What stands for a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shown {
    /// Nothing: what lies in it is named as users know it.
    SourceRoot,
    /// Nothing, nor for the folder of a task in it.
    Tasks,
    /// What the service keeps for itself.
    Own,
}

impl Places {
    /// Places of a worker: its source roots, the folder in which tasks have theirs, and what the service keeps for itself.
    pub(crate) fn new<'a>(
        roots: impl IntoIterator<Item = &'a Path>,
        tasks: &'a Path,
        own: impl IntoIterator<Item = &'a Path>,
    ) -> Self {
        let roots = roots.into_iter().map(|root| (root, Shown::SourceRoot));
        let own = own.into_iter().map(|own| (own, Shown::Own));
        let all = roots.chain(own).chain([(tasks, Shown::Tasks)]);
        let known = |path: &Path| path.is_absolute() && path.parent().is_some();
        let mut folders: Vec<(String, Shown)> =
            all.filter(|(path, _)| known(path)).map(|(path, shown)| (path.display().to_string(), shown)).collect();
        folders.sort_by(|a, b| b.0.len().cmp(&a.0.len()).then(a.0.cmp(&b.0)));
        Self { folders }
    }

    /// A text without the paths of this machine.
    pub(crate) fn hide(&self, text: &str) -> String {
        let mut shown = String::with_capacity(text.len());
        let mut rest = text;
        while let Some(next) = rest.chars().next() {
            let begins = !shown.ends_with(is_of_a_path);
            let found = self.folders.iter().filter(|_| begins && next == '/').find_map(|(folder, what)| {
                let after = rest.strip_prefix(folder.as_str())?;
                (after.starts_with('/') || !after.starts_with(is_of_a_path)).then_some((after, *what))
            });
            match found {
                Some((after, what)) => {
                    let (name, after) = inside(after, what);
                    shown += name;
                    rest = after;
                }
                None => {
                    shown.push(next);
                    rest = &rest[next.len_utf8()..];
                }
            }
        }
        shown
    }
}

/// What stands for a folder, and the rest of the text.
fn inside(after: &str, what: Shown) -> (&'static str, &str) {
    let below = after.strip_prefix('/').filter(|below| below.starts_with(is_of_a_path));
    match (what, below) {
        (Shown::SourceRoot, Some(below)) => ("", below),
        (Shown::SourceRoot, None) => ("the source root", after),
        (Shown::Own, _) => ("the service's folder", after),
        (Shown::Tasks, None) => ("the folder of tasks", after),
        (Shown::Tasks, Some(below)) => {
            // The folder of the task, whose name is drawn.
            let end = below.find(|c| !is_of_a_path(c) || c == '/').unwrap_or(below.len());
            let file = below[end..].strip_prefix('/').filter(|file| file.starts_with(is_of_a_path));
            file.map_or(("the task's folder", &below[end..]), |file| ("", file))
        }
    }
}

/// Whether a character may stand in a path so that what follows belongs to it.
fn is_of_a_path(c: char) -> bool {
    c.is_alphanumeric() || matches!(c, '/' | '.' | '_' | '-' | '~' | '+' | '@' | '%')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_of_the_machine_are_not_told() {
        let path = Path::new;
        let places = Places::new(
            [path("/meshes"), path("/srv/old meshes"), path("s3://bucket/prefix"), path("/")],
            path("/var/lib/gable/work/tasks-7"),
            [path("/var/lib/gable"), path("/meshes/gable-data")],
        );
        for (told, shown) in [
            ("/meshes/delft/mesh.obj: line 3: no faces", "delft/mesh.obj: line 3: no faces"),
            ("texture \"/meshes/delft/a b.png\": gone", "texture \"delft/a b.png\": gone"),
            ("(/srv/old meshes/x.obj)", "(x.obj)"),
            ("folder /meshes: is empty", "folder the source root: is empty"),
            ("/meshes/", "the source root/"),
            ("/var/lib/gable/work/tasks-7/.tmpAb12/upload/x.zip: bad", "upload/x.zip: bad"),
            ("/var/lib/gable/work/tasks-7/.tmpAb12: no space left", "the task's folder: no space left"),
            ("/var/lib/gable/store/ab/cd: no space left", "the service's folder/store/ab/cd: no space left"),
            ("/meshes/gable-data/jobs.db", "the service's folder/jobs.db"),
            (
                "s3://bucket/meshes/x and /meshes2/y and /meshes-old",
                "s3://bucket/meshes/x and /meshes2/y and /meshes-old",
            ),
            ("mtllib /dev/zero", "mtllib /dev/zero"),
            ("über /meshes/ü.obj", "über ü.obj"),
        ] {
            assert_eq!(places.hide(told), shown);
        }
    }
}
