//! Content under its own hash, in a folder or an object store.

use crate::{JobStoreError, s3};
use bytes::{Bytes, BytesMut};
use futures_util::stream::{self, BoxStream};
use futures_util::{StreamExt, TryStreamExt};
use object_store::path::Path;
use object_store::{ObjectStore, ObjectStoreExt, PutMode, PutOptions, PutPayload, WriteMultipart};
use std::fmt;
use std::ops::Range;
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

    /// The name of a file's content, and its size. The file is never in memory as a whole.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub async fn of_file(path: &std::path::Path) -> Result<(Self, u64), JobStoreError> {
        let wrong = |source| JobStoreError::File { path: path.to_owned(), source };
        let owned = path.to_owned();
        let hashed = tokio::task::spawn_blocking(move || {
            let mut hasher = blake3::Hasher::new();
            hasher.update_reader(std::fs::File::open(owned)?)?;
            Ok((Self(*hasher.finalize().as_bytes()), hasher.count()))
        });
        hashed.await.map_err(|e| wrong(e.into()))?.map_err(wrong)
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

/// A content as it comes, piece by piece.
pub type BlobStream = BoxStream<'static, Result<Bytes, JobStoreError>>;

/// Contents above this size go to the object store in parts of it. S3 takes parts from 5 MiB, and 10,000 of them.
const PART: usize = 8 << 20;

/// Parts that are on their way at a time.
const PARTS: usize = 4;

/// Contents by hash. Nothing is ever overwritten: the same name is the same content.
#[derive(Clone, Debug)]
pub struct Blobs {
    objects: Arc<dyn ObjectStore>,
}

impl Blobs {
    /// Blobs at a place: a folder, which is made if it is not there, or `s3://BUCKET/PREFIX`. Endpoint, region and keys of S3 are
    /// among the variables, commonly those of the environment: `AWS_ENDPOINT_URL`, `AWS_REGION`, `AWS_ACCESS_KEY_ID`,
    /// `AWS_SECRET_ACCESS_KEY`, and what else S3 programs know.
    ///
    /// # Errors
    /// If it is neither, or the folder cannot be made. Whether an object store answers is for [`Blobs::ping`] to find out.
    pub fn open(place: &str, variables: impl IntoIterator<Item = (String, String)>) -> Result<Self, JobStoreError> {
        if place.contains("://") {
            return Ok(Self { objects: s3::open(place, variables)? });
        }
        Self::in_folder(std::path::Path::new(place))
    }

    /// Blobs in a folder, which is made if it is not there.
    ///
    /// # Errors
    /// If the folder cannot be made.
    pub fn in_folder(folder: &std::path::Path) -> Result<Self, JobStoreError> {
        let wrong = |source| JobStoreError::File { path: folder.to_owned(), source };
        std::fs::create_dir_all(folder).map_err(wrong)?;
        let objects = object_store::local::LocalFileSystem::new_with_prefix(folder)?.with_fsync(true);
        Ok(Self { objects: Arc::new(objects) })
    }

    /// Whether the object store answers.
    ///
    /// # Errors
    /// If it does not, or refuses: no such bucket, wrong keys.
    pub async fn ping(&self) -> Result<(), JobStoreError> {
        // Any name will do: that it is not there is an answer. A bucket that is not there looks the same, so it is listed too.
        self.contains(BlobId::of(b"")).await?;
        self.objects.list(None).next().await.transpose()?;
        Ok(())
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

    /// Keeps the content of a file, whose name is known from [`BlobId::of_file`]. At most some parts of it are in memory.
    ///
    /// # Errors
    /// If the file cannot be read or has changed since it was named, or the object store does not answer.
    pub async fn put_file(&self, id: BlobId, file: &std::path::Path) -> Result<(), JobStoreError> {
        let wrong = |source| JobStoreError::File { path: file.to_owned(), source };
        let changed = || wrong(std::io::Error::other("it has changed while it was kept"));
        let mut content = tokio::fs::File::open(file).await.map_err(wrong)?;
        if content.metadata().await.map_err(wrong)?.len() <= PART as u64 {
            let content = tokio::fs::read(file).await.map_err(wrong)?;
            return if BlobId::of(&content) == id { self.put(content).await.map(drop) } else { Err(changed()) };
        }
        if self.contains(id).await? {
            return Ok(());
        }
        // It is there whole or not at all: a store shows what came in parts when it is complete.
        let mut upload = WriteMultipart::new_with_chunk_size(self.objects.put_multipart(&place(id)).await?, PART);
        let mut hasher = blake3::Hasher::new();
        let sent = async {
            loop {
                let part = next_part(&mut content).await.map_err(wrong)?;
                if part.is_empty() {
                    return Ok(());
                }
                hasher.update(&part);
                upload.wait_for_capacity(PARTS).await?;
                upload.put(part);
            }
        };
        let sent: Result<(), JobStoreError> = sent.await;
        let whole =
            sent.and_then(|()| if BlobId(*hasher.finalize().as_bytes()) == id { Ok(()) } else { Err(changed()) });
        if let Err(e) = whole {
            if let Err(left) = upload.abort().await {
                tracing::warn!("parts of blob {id} may be left in the object store: {left}");
            }
            return Err(e);
        }
        upload.finish().await?;
        Ok(())
    }

    /// A content, checked against its name.
    ///
    /// # Errors
    /// If it is not there, is damaged, or the object store does not answer.
    pub async fn get(&self, id: BlobId) -> Result<Bytes, JobStoreError> {
        let content = self.objects.get(&place(id)).await?.bytes().await?;
        if BlobId::of(&content) == id { Ok(content) } else { Err(JobStoreError::DamagedBlob(id.to_string())) }
    }

    /// A content as it comes. That it is damaged is known only at its end: then the last piece is an error.
    ///
    /// # Errors
    /// If it is not there, or the object store does not answer; also later, in the stream.
    pub async fn stream(&self, id: BlobId) -> Result<BlobStream, JobStoreError> {
        let pieces = self.objects.get(&place(id)).await?.into_stream().map_err(JobStoreError::from).boxed();
        let checked = stream::try_unfold((pieces, blake3::Hasher::new()), move |(mut pieces, mut hasher)| async move {
            if let Some(piece) = pieces.try_next().await? {
                hasher.update(&piece);
                return Ok(Some((piece, (pieces, hasher))));
            }
            let same = BlobId(*hasher.finalize().as_bytes()) == id;
            if same { Ok(None) } else { Err(JobStoreError::DamagedBlob(id.to_string())) }
        });
        Ok(checked.boxed())
    }

    /// A part of a content as it comes. A part cannot be checked against the name of the whole.
    ///
    /// # Errors
    /// If the content is not there, has no such part, or the object store does not answer; also later, in the stream.
    pub async fn part(&self, id: BlobId, bytes: Range<u64>) -> Result<BlobStream, JobStoreError> {
        let options = object_store::GetOptions { range: Some(bytes.into()), ..Default::default() };
        let part = self.objects.get_opts(&place(id), options).await?;
        Ok(part.into_stream().map_err(JobStoreError::from).boxed())
    }

    /// Writes a content to a file, checked against its name. It is never in memory as a whole.
    ///
    /// # Errors
    /// If the content is not there or damaged, the file cannot be written, or the object store does not answer; what was written
    /// until then is left.
    pub async fn fetch(&self, id: BlobId, file: &std::path::Path) -> Result<(), JobStoreError> {
        use tokio::io::AsyncWriteExt;
        let wrong = |source| JobStoreError::File { path: file.to_owned(), source };
        let mut pieces = self.stream(id).await?;
        let mut out = tokio::fs::File::create(file).await.map_err(wrong)?;
        while let Some(piece) = pieces.try_next().await? {
            out.write_all(&piece).await.map_err(wrong)?;
        }
        out.flush().await.map_err(wrong)
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

/// The next bytes of a file, as many as a part has; fewer at its end, none after it.
async fn next_part(file: &mut tokio::fs::File) -> Result<Bytes, std::io::Error> {
    use tokio::io::AsyncReadExt;
    let mut part = BytesMut::with_capacity(PART);
    while part.len() < PART && file.take((PART - part.len()) as u64).read_buf(&mut part).await? > 0 {}
    Ok(part.freeze())
}
