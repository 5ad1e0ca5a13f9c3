//! Content under its own hash, in a folder or an object store.

use crate::JobStoreError;
use bytes::Bytes;
use futures_util::TryStreamExt;
use object_store::path::Path;
use object_store::{ObjectStore, ObjectStoreExt, PutMode, PutOptions, PutPayload};
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

/// Hash of a content: BLAKE3, 32 bytes, written as 64 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BlobId([u8; 32]);

impl BlobId {
    /// The name of a content.
    #[must_use]
    pub fn of(content: &[u8]) -> Self {
        Self(*blake3::hash(content).as_bytes())
    }
}

impl fmt::Display for BlobId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", blake3::Hash::from_bytes(self.0).to_hex())
    }
}

impl FromStr for BlobId {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        blake3::Hash::from_hex(text).map(|hash| Self(*hash.as_bytes())).map_err(|_| ())
    }
}

/// Contents by hash. Nothing is ever overwritten: the same name is the same content.
#[derive(Clone, Debug)]
pub struct Blobs {
    objects: Arc<dyn ObjectStore>,
}

impl Blobs {
    /// Blobs in an object store.
    #[must_use]
    pub fn new(objects: Arc<dyn ObjectStore>) -> Self {
        Self { objects }
    }

    /// Blobs in a folder, which is made if it is not there.
    ///
    /// # Errors
    /// If the folder cannot be made.
    pub fn in_folder(folder: &std::path::Path) -> Result<Self, JobStoreError> {
        let wrong = |source| JobStoreError::File { path: folder.to_owned(), source };
        std::fs::create_dir_all(folder).map_err(wrong)?;
        let objects = object_store::local::LocalFileSystem::new_with_prefix(folder)?.with_fsync(true);
        Ok(Self::new(Arc::new(objects)))
    }

    /// Keeps a content. Two writers of the same content do not disturb each other.
    ///
    /// # Errors
    /// If the object store does not answer.
    pub async fn put(&self, content: impl Into<Bytes>) -> Result<BlobId, JobStoreError> {
        let content = content.into();
        let id = BlobId::of(&content);
        let options = PutOptions { mode: PutMode::Create, ..PutOptions::default() };
        match self.objects.put_opts(&place(id), PutPayload::from_bytes(content), options).await {
            Ok(_) | Err(object_store::Error::AlreadyExists { .. }) => Ok(id),
            Err(e) => Err(e.into()),
        }
    }

    /// A content, checked against its name.
    ///
    /// # Errors
    /// If it is not there, is damaged, or the object store does not answer.
    pub async fn get(&self, id: BlobId) -> Result<Bytes, JobStoreError> {
        let content = self.objects.get(&place(id)).await?.bytes().await?;
        if BlobId::of(&content) == id { Ok(content) } else { Err(JobStoreError::DamagedBlob(id.to_string())) }
    }

    /// Whether a content is there.
    ///
    /// # Errors
    /// If the object store does not answer.
    pub async fn contains(&self, id: BlobId) -> Result<bool, JobStoreError> {
        match self.objects.head(&place(id)).await {
            Ok(_) => Ok(true),
            Err(object_store::Error::NotFound { .. }) => Ok(false),
            Err(e) => Err(e.into()),
        }
    }

    /// Removes a content, if it is there.
    ///
    /// # Errors
    /// If the object store does not answer.
    pub async fn remove(&self, id: BlobId) -> Result<(), JobStoreError> {
        match self.objects.delete(&place(id)).await {
            Ok(()) | Err(object_store::Error::NotFound { .. }) => Ok(()),
            Err(e) => Err(e.into()),
        }
    }

    /// All contents that have been there for at least `age`: younger ones may belong to a task that is about to finish.
    ///
    /// # Errors
    /// If the object store does not answer.
    pub async fn older_than(&self, age: std::time::Duration) -> Result<Vec<BlobId>, JobStoreError> {
        let now = std::time::SystemTime::now();
        let mut found: Vec<BlobId> = self
            .objects
            .list(None)
            .try_filter_map(|object| async move {
                let written: std::time::SystemTime = object.last_modified.into();
                let old = now.duration_since(written).is_ok_and(|passed| passed >= age);
                let id = object.location.filename().and_then(|name| name.parse::<BlobId>().ok());
                Ok(id.filter(|_| old))
            })
            .try_collect()
            .await?;
        found.sort_unstable();
        Ok(found)
    }
}

/// Two levels, so that no folder gets millions of entries.
fn place(id: BlobId) -> Path {
    let name = id.to_string();
    Path::from_iter(["blobs", &name[..2], &name])
}
