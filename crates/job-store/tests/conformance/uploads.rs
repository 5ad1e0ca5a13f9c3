//! Uploads in parts.

use gable_job_store::{Artifact, BlobId, JobStoreError, Scope, Store, TokenRecord, Upload, UploadPart, UploadQuota};
use std::time::Duration;

const QUOTA: UploadQuota = UploadQuota { open: 2, bytes: 100 };

fn part(number: i64, content: &[u8], bytes: u64) -> UploadPart {
    UploadPart { number, blob: BlobId::of(content), bytes, sha256: "00".repeat(32) }
}

async fn owner(store: &Store) {
    let (hash, name, scope) = ("h".to_owned(), "ann".to_owned(), Scope::Submitter);
    let token = TokenRecord { hash, name, scope, groups: Vec::new(), max_jobs: None, expires: None, created: 0 };
    assert!(store.add_token(&token).await.expect("adds"));
}

pub(crate) async fn parts_are_kept_until_they_are_an_upload(store: &Store) {
    owner(store).await;
    store.open_upload("u1", "ann", "a.off", None, QUOTA).await.expect("opens");
    let open = store.find_open_upload("u1").await.expect("asks").expect("there");
    assert!(!open.held && open.upload.is_none() && open.expires > open.created);
    let blob = BlobId::of(b"one");
    assert!(store.add_part(&open, &part(2, b"two", 20), QUOTA).await.expect("adds"));
    assert!(store.add_part(&open, &part(1, b"other", 30), QUOTA).await.expect("adds"));
    assert!(store.add_part(&open, &part(1, b"one", 40), QUOTA).await.expect("replaces"));
    assert!(
        store.is_referenced(blob).await.expect("asks")
            && !store.is_referenced(BlobId::of(b"other")).await.expect("asks")
    );
    assert_eq!(store.upload_parts("u1").await.expect("lists"), [part(1, b"one", 40), part(2, b"two", 20)]);
    assert_eq!(store.sent_bytes("ann").await.expect("counts"), 60);
    assert_eq!(store.stored_bytes().await.expect("counts"), 60);

    // One at a time puts it together, for as long as it says so.
    let hold = async |longer| store.hold_open_upload("u1", longer, Duration::from_secs(20)).await.expect("asks");
    assert!(hold(false).await && !hold(false).await && hold(true).await);
    assert!(!store.add_part(&open, &part(3, b"late", 1), QUOTA).await.expect("asks"), "it is held");
    store.let_go_of_open_upload("u1", None).await.expect("lets go");
    assert!(hold(false).await);
    let upload = Upload {
        id: "v1".to_owned(),
        owner: "ann".to_owned(),
        city: None,
        name: "a.off".to_owned(),
        bytes: 60,
        files: 1,
        created: 0,
    };
    let files = [Artifact { path: "a.off".to_owned(), blob, bytes: 60 }];
    assert!(store.complete_upload("u1", &upload, &files, QUOTA).await.expect("completes"));
    let second = Upload { id: "v2".to_owned(), ..upload };
    assert!(!store.complete_upload("u1", &second, &files, QUOTA).await.expect("asks"), "it is an upload already");
    assert_eq!(store.find_open_upload("u1").await.expect("asks").expect("there").upload.as_deref(), Some("v1"));
    assert!(
        store.upload_parts("u1").await.expect("lists").is_empty() && store.upload("v2").await.expect("asks").is_none()
    );
    assert_eq!(store.upload_files("v1").await.expect("files"), files);
    assert_eq!(store.sent_bytes("ann").await.expect("counts"), 60);
    assert!(store.abort_upload("u1").await.expect("removes") && !store.abort_upload("u1").await.expect("asks"));
}

/// However many parts come at once, those that are taken fit.
pub(crate) async fn quotas_of_uploads_hold_under_a_rush(store: &Store) {
    owner(store).await;
    let opened = (0..6).map(|n| {
        let store = store.clone();
        tokio::spawn(async move { store.open_upload(&format!("u{n}"), "ann", "a.off", None, QUOTA).await })
    });
    let mut refused = 0;
    for one in opened.collect::<Vec<_>>() {
        match one.await.expect("it ends") {
            Ok(()) => {}
            Err(JobStoreError::OpenUploads { most: 2, .. }) => refused += 1,
            Err(e) => panic!("{e}"),
        }
    }
    assert_eq!(refused, 4);
    let open = store.open_uploads("ann", 10).await.expect("lists").remove(0);
    let sent = (1..=8).map(|number| {
        let (store, open) = (store.clone(), open.clone());
        tokio::spawn(async move { store.add_part(&open, &part(number, &number.to_le_bytes(), 30), QUOTA).await })
    });
    for one in sent.collect::<Vec<_>>() {
        match one.await.expect("it ends") {
            Ok(taken) => assert!(taken),
            Err(JobStoreError::UploadBytes { most: 100, .. }) => {}
            Err(e) => panic!("{e}"),
        }
    }
    assert_eq!(store.sent_bytes("ann").await.expect("counts"), 90);
}
