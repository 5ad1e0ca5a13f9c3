//! What every store of artefacts must do: a folder, and S3.

use futures_util::TryStreamExt;
use gable_job_store::{BlobId, Blobs, JobStoreError};
use std::time::Duration;

/// More than goes in one part, and no multiple of it.
fn large() -> Vec<u8> {
    (0..20_000_003_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect()
}

async fn all(stream: gable_job_store::BlobStream) -> Result<Vec<u8>, JobStoreError> {
    stream
        .try_fold(Vec::new(), |mut all, piece| async move {
            all.extend_from_slice(&piece);
            Ok(all)
        })
        .await
}

fn is_missing<T: std::fmt::Debug>(result: Result<T, JobStoreError>) {
    match result {
        Err(JobStoreError::Objects(object_store::Error::NotFound { .. })) => {}
        other => panic!("{other:?}"),
    }
}

pub(crate) async fn what_is_put_is_found_and_removed(blobs: &Blobs) {
    blobs.ping().await.expect("it answers");
    let id = blobs.put(&b"roof"[..]).await.expect("put");
    assert_eq!(id, blobs.put(&b"roof"[..]).await.expect("put again"));
    assert_eq!(id, BlobId::of(b"roof"));
    assert_eq!(id, id.to_string().parse().expect("a name"));
    assert_eq!(&blobs.get(id).await.expect("get")[..], b"roof");
    assert!(blobs.contains(id).await.expect("asks"));
    let empty = blobs.put(Vec::new()).await.expect("put");
    assert!(blobs.get(empty).await.expect("get").is_empty());
    blobs.remove(empty).await.expect("removes");
    // S3 tells whole seconds.
    tokio::time::sleep(Duration::from_millis(1100)).await;
    assert_eq!(blobs.older_than(Duration::ZERO).await.expect("lists"), [id]);
    assert!(blobs.older_than(Duration::from_secs(60)).await.expect("lists").is_empty());
    blobs.remove(id).await.expect("removes");
    blobs.remove(id).await.expect("is gone already");
    assert!(!blobs.contains(id).await.expect("asks"));
    is_missing(blobs.get(id).await);
    is_missing(blobs.stream(id).await.map(drop));
    is_missing(blobs.part(id, 0..2).await.map(drop));
}

pub(crate) async fn files_go_in_and_out_as_streams(blobs: &Blobs) {
    let folder = tempfile::tempdir().expect("a folder");
    let (source, place) = (folder.path().join("source"), folder.path().join("place"));
    for content in [large(), b"small".to_vec(), Vec::new()] {
        std::fs::write(&source, &content).expect("written");
        let (id, bytes) = BlobId::of_file(&source).await.expect("named");
        assert_eq!((id, bytes), (BlobId::of(&content), content.len() as u64));
        blobs.put_file(id, &source).await.expect("put");
        blobs.put_file(id, &source).await.expect("put again");
        blobs.fetch(id, &place).await.expect("fetched");
        assert!(std::fs::read(&place).expect("read") == content);
        assert!(all(blobs.stream(id).await.expect("opens")).await.expect("read") == content);
    }
}

pub(crate) async fn parts_are_those_of_the_content(blobs: &Blobs) {
    let content = large();
    let id = blobs.put(content.clone()).await.expect("put");
    let last = content.len() as u64;
    for (first, end) in [(0, 1), (0, last), (7_999_999, 16_000_001), (last - 1, last)] {
        let part = all(blobs.part(id, first..end).await.expect("opens")).await.expect("read");
        assert!(part == content[first as usize..end as usize], "{first}..{end}");
    }
    assert!(matches!(blobs.part(id, last..last + 1).await.map(drop), Err(JobStoreError::Objects(_))));
}

pub(crate) async fn a_file_that_changes_is_not_kept_under_its_old_name(blobs: &Blobs) {
    let folder = tempfile::tempdir().expect("a folder");
    let source = folder.path().join("source");
    for mut content in [large(), b"small".to_vec()] {
        std::fs::write(&source, &content).expect("written");
        let (id, _) = BlobId::of_file(&source).await.expect("named");
        let end = content.len() - 1;
        content[end] ^= 1;
        std::fs::write(&source, &content).expect("written");
        assert!(matches!(blobs.put_file(id, &source).await, Err(JobStoreError::File { .. })));
        assert!(!blobs.contains(id).await.expect("asks"));
    }
}

pub(crate) async fn many_writers_of_one_content_do_not_disturb_each_other(blobs: &Blobs) {
    let content = vec![7_u8; 300_000];
    let writers: Vec<_> = (0..16)
        .map(|_| {
            let (blobs, content) = (blobs.clone(), content.clone());
            tokio::spawn(async move { blobs.put(content).await.expect("put") })
        })
        .collect();
    for writer in writers {
        let id = writer.await.expect("the writer ends");
        assert_eq!(blobs.get(id).await.expect("get"), content);
    }
}

#[tokio::test]
async fn a_damaged_content_is_not_handed_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let blobs = Blobs::in_folder(&folder.path().join("new/store")).expect("opens");
    let id = blobs.put(&b"roof"[..]).await.expect("put");
    let name = id.to_string();
    std::fs::write(folder.path().join("new/store/blobs").join(&name[..2]).join(&name), b"rof").expect("damages");
    let damaged = |e: JobStoreError| assert!(matches!(e, JobStoreError::DamagedBlob(n) if n == name));
    damaged(blobs.get(id).await.expect_err("it is damaged"));
    damaged(all(blobs.stream(id).await.expect("opens")).await.expect_err("it is damaged"));
    damaged(blobs.fetch(id, &folder.path().join("place")).await.expect_err("it is damaged"));
}

#[tokio::test]
async fn a_bucket_that_is_not_there_is_told() {
    let Some(bucket) = crate::s3_server::bucket("not-there") else { return };
    let variables = crate::s3_server::Bucket::variables(bucket.port);
    let blobs = Blobs::open("s3://another", variables).expect("opens");
    assert!(blobs.ping().await.is_err());
}
