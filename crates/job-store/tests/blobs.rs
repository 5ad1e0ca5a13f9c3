//! Contents by hash, in a folder.

use gable_job_store::{BlobId, Blobs, JobStoreError};
use std::time::Duration;

#[tokio::test]
async fn what_is_put_is_found_and_removed() {
    let folder = tempfile::tempdir().expect("a folder");
    let blobs = Blobs::in_folder(&folder.path().join("new/store")).expect("opens");
    let id = blobs.put(&b"roof"[..]).await.expect("put");
    assert_eq!(id, blobs.put(&b"roof"[..]).await.expect("put again"));
    assert_eq!(id, BlobId::of(b"roof"));
    assert_eq!(id, id.to_string().parse().expect("a name"));
    assert_eq!(&blobs.get(id).await.expect("get")[..], b"roof");
    assert!(blobs.contains(id).await.expect("asks"));
    assert_eq!(blobs.older_than(Duration::ZERO).await.expect("lists"), [id]);
    assert!(blobs.older_than(Duration::from_secs(60)).await.expect("lists").is_empty());
    blobs.remove(id).await.expect("removes");
    blobs.remove(id).await.expect("is gone already");
    assert!(!blobs.contains(id).await.expect("asks"));
    assert!(matches!(blobs.get(id).await, Err(JobStoreError::Objects(object_store::Error::NotFound { .. }))));
}

#[tokio::test]
async fn a_damaged_content_is_not_handed_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let blobs = Blobs::in_folder(folder.path()).expect("opens");
    let id = blobs.put(&b"roof"[..]).await.expect("put");
    let name = id.to_string();
    std::fs::write(folder.path().join("blobs").join(&name[..2]).join(&name), b"rof").expect("damages");
    assert!(matches!(blobs.get(id).await, Err(JobStoreError::DamagedBlob(n)) if n == name));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn many_writers_of_one_content_do_not_disturb_each_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let blobs = Blobs::in_folder(folder.path()).expect("opens");
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
