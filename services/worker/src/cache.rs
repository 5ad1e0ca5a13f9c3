//! Contents of artefacts on the local disk.

use crate::WorkerError;
use gable_job_store::{BlobId, Blobs, JobStoreError};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::SystemTime;

/// Looking through the folder takes as long as there are files in it, so it waits until this part of what may stay was added:
/// the workers that share a folder may together exceed the limit by as much each.
const UNSEEN: u64 = 64;

/// Blobs that were fetched or made here. Files in it are complete, named by their hash, and never changed.
#[derive(Debug)]
pub(crate) struct Cache {
    folder: PathBuf,
    /// Bytes that may stay.
    most: u64,
    /// Bytes that were added since the folder was last looked through.
    added: AtomicU64,
}

impl Cache {
    pub(crate) fn open(folder: &Path, most: u64) -> Result<Self, WorkerError> {
        std::fs::create_dir_all(folder).map_err(|source| WorkerError::Folder { path: folder.to_owned(), source })?;
        // What is there already is looked through with the first that is added.
        Ok(Self { folder: folder.to_owned(), most, added: AtomicU64::new(most) })
    }

    fn place(&self, id: BlobId) -> PathBuf {
        self.folder.join(id.to_string())
    }

    /// Puts a content where a task wants it: linked, so that it costs no disk.
    pub(crate) async fn lay(&self, blobs: &Blobs, id: BlobId, place: &Path) -> Result<(), JobStoreError> {
        let kept = self.place(id);
        let wrong = |source| JobStoreError::File { path: place.to_owned(), source };
        if let Some(parent) = place.parent() {
            tokio::fs::create_dir_all(parent).await.map_err(wrong)?;
        }
        // Another task may evict it between the two steps, hence the second try.
        for _ in 0..2 {
            match tokio::fs::hard_link(&kept, place).await {
                Ok(()) => {
                    touch(&kept);
                    return Ok(());
                }
                Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
                    let file = tempfile::NamedTempFile::new_in(&self.folder).map_err(wrong)?;
                    blobs.fetch(id, file.path()).await?;
                    self.add(read_only(file.path()).map_err(wrong)?);
                    file.persist(&kept).map_err(|e| wrong(e.error))?;
                }
                Err(e) => return Err(wrong(e)),
            }
        }
        blobs.fetch(id, place).await
    }

    /// Keeps a file that a task made, whose content will not change any more: linked, so that it costs no disk.
    pub(crate) async fn keep(&self, id: BlobId, file: &Path) -> Result<(), JobStoreError> {
        let wrong = |source| JobStoreError::File { path: file.to_owned(), source };
        let bytes = read_only(file).map_err(wrong)?;
        match tokio::fs::hard_link(file, self.place(id)).await {
            Ok(()) => {
                self.add(bytes);
                Ok(())
            }
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => Ok(()),
            Err(e) => Err(wrong(e)),
        }
    }

    fn add(&self, bytes: u64) {
        self.added.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Removes what was not used for longest until the rest is within the limit, if enough was added since the last time.
    pub(crate) fn tidy(&self) {
        if self.added.load(Ordering::Relaxed) <= self.most / UNSEEN {
            return;
        }
        self.added.store(0, Ordering::Relaxed);
        let Ok(entries) = std::fs::read_dir(&self.folder) else { return };
        let mut files: Vec<(SystemTime, PathBuf, u64)> = entries
            .flatten()
            .filter_map(|e| {
                let about = e.metadata().ok()?;
                Some((about.modified().ok()?, e.path(), about.len()))
            })
            .collect();
        let mut total: u64 = files.iter().map(|f| f.2).sum();
        files.sort();
        for (_, path, bytes) in files {
            if total <= self.most {
                return;
            }
            if std::fs::remove_file(&path).is_ok() {
                total -= bytes;
            }
        }
    }
}

/// Makes a file read-only; gives its size.
fn read_only(file: &Path) -> Result<u64, std::io::Error> {
    let about = std::fs::metadata(file)?;
    let mut permissions = about.permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(file, permissions)?;
    Ok(about.len())
}

/// Notes that a file was used. Failing is harmless: it may leave the cache earlier.
fn touch(path: &Path) {
    if let Ok(file) = std::fs::File::open(path) {
        let _ = file.set_modified(SystemTime::now());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn the_folder_is_looked_through_when_enough_was_added() {
        let folder = tempfile::tempdir().expect("a folder");
        let blobs = Blobs::in_folder(&folder.path().join("store")).expect("opens");
        let open = |most: u64| Cache::open(&folder.path().join("cache"), most).expect("opens");
        let cache = open(6400);
        // Ten of 1000 bytes: looked through after the first, and then after each, for each is more than a hundred bytes.
        let fill = async |cache: &Cache, bytes: usize, numbers: std::ops::Range<u8>| {
            for n in numbers {
                let id = blobs.put(vec![n; bytes]).await.expect("put");
                cache.lay(&blobs, id, &folder.path().join(format!("task/{bytes}/{n}"))).await.expect("laid");
                cache.tidy();
            }
            std::fs::read_dir(folder.path().join("cache")).expect("there").count()
        };
        assert_eq!(fill(&cache, 1000, 0..10).await, 6);
        // Of 40 bytes, every third is too much.
        assert_eq!(fill(&cache, 40, 0..2).await, 8, "no look yet");
        assert_eq!(fill(&cache, 40, 2..11).await, 6 + 11, "6,440 bytes are not looked at");
        assert_eq!(fill(&cache, 40, 11..12).await, 5 + 12);
        assert_eq!(fill(&open(10), 1, 0..1).await, 1, "a new worker looks with the first");
    }

    #[tokio::test]
    async fn contents_are_fetched_once_and_the_oldest_leave() {
        let folder = tempfile::tempdir().expect("a folder");
        let blobs = Blobs::in_folder(&folder.path().join("store")).expect("opens");
        let cache = Cache::open(&folder.path().join("cache"), 25).expect("opens");
        let mut ids = Vec::new();
        for n in 0..3_u8 {
            ids.push(blobs.put(vec![n; 10]).await.expect("put"));
        }
        let place = |n: usize| folder.path().join(format!("task/deep/{n}"));
        cache.lay(&blobs, ids[0], &place(0)).await.expect("laid");
        blobs.remove(ids[0]).await.expect("removed");
        cache.lay(&blobs, ids[0], &place(9)).await.expect("still in the cache");
        assert_eq!(std::fs::read(place(9)).expect("read"), [0; 10]);
        cache.lay(&blobs, ids[1], &place(1)).await.expect("laid");
        cache.lay(&blobs, ids[2], &place(2)).await.expect("laid");
        let old = std::time::UNIX_EPOCH;
        std::fs::File::open(cache.place(ids[1])).expect("there").set_modified(old).expect("dated");
        cache.tidy();
        assert!(!cache.place(ids[1]).exists() && cache.place(ids[2]).exists());
        assert_eq!(std::fs::read(place(1)).expect("read"), [1; 10], "a task keeps what it was given");
        let made = place(4);
        std::fs::write(&made, [4; 10]).expect("written");
        cache.keep(BlobId::of(&[4; 10]), &made).await.expect("kept");
        cache.keep(BlobId::of(&[4; 10]), &made).await.expect("kept already");
        cache.lay(&blobs, BlobId::of(&[4; 10]), &place(5)).await.expect("what was made here is not fetched");
        assert!(matches!(cache.lay(&blobs, BlobId::of(b"none"), &place(3)).await, Err(JobStoreError::Objects(_))));
    }
}
