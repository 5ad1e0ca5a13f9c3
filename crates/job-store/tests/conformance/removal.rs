//! What is removed by people, and by count and age; each part on an empty database.

use crate::cities::{artifact, building, published};
use crate::suite::{claim, finish, job, submit, task};
use gable_job_store::{
    BuildingFilter, EventKind, Finished, JobState, JobStoreError, NewJob, Publication, Published, Purged, Retention,
    Role, Store,
};
use std::time::Duration;

const KEEP: Retention = Retention {
    generations: 0,
    generation_age: None,
    job_age: None,
    audit_age: None,
    worker_age: Duration::from_secs(3600),
};

pub(crate) async fn an_unchanged_refresh_makes_no_generation(store: &Store) {
    let a = building("a", "1", 0.0);
    let publish = async |files: &[(&str, &str)]| {
        let id = submit(store, &job("delft", vec![task(0, "city")])).await;
        let held = claim(store, "w").await;
        let artifacts = files.iter().map(|(path, content)| artifact(path, content)).collect();
        let publication = Some(Publication { crs: "EPSG:7415".to_owned(), buildings: vec![a.clone()] });
        let followed = store.finish(&held, &Finished { artifacts, publication, ..Finished::default() }).await;
        (id, followed.expect("finishes").publication)
    };
    let first = publish(&[("result/t", "same"), ("result/report.json", "5 s")]).await;
    assert_eq!(first.1, Some(Published::Generation(1)));
    let again = publish(&[("result/t", "same"), ("result/report.json", "6 s")]).await;
    assert_eq!(again.1, Some(Published::Unchanged(1)), "only the times of the report are others");
    let events = store.events(&again.0, 0, 100).await.expect("events");
    assert!(
        events.iter().any(|e| e.kind == EventKind::Unchanged) && !events.iter().any(|e| e.kind == EventKind::Published)
    );
    assert_eq!(store.generation("delft", 1).await.expect("asks").expect("there").job, first.0);
    assert_eq!(
        publish(&[("result/t", "other"), ("result/report.json", "6 s")]).await.1,
        Some(Published::Generation(2))
    );
    assert_eq!(publish(&[("result/t", "other")]).await.1, Some(Published::Unchanged(2)), "without a report");

    // What an earlier job makes after a later one has said that nothing changed is older than that.
    let slow = submit(store, &job("delft", vec![task(0, "city")])).await;
    let late = claim(store, "w").await;
    assert_eq!(publish(&[("result/t", "other")]).await.1, Some(Published::Unchanged(2)));
    let publication = Some(Publication { crs: "EPSG:7415".to_owned(), buildings: vec![building("a", "0", 0.0)] });
    let followed = store.finish(&late, &Finished { publication, ..Finished::default() }).await.expect("finishes");
    assert!(matches!(followed.publication, Some(Published::Withheld(_))), "{slow}: {followed:?}");
}

pub(crate) async fn generations_jobs_and_cities_are_deleted(store: &Store) {
    let (a, b, c) = (building("a", "1", 0.0), building("b", "1", 1.0), building("c", "1", 2.0));
    let first = published(store, &[artifact("result/i", "one")], &[a.clone(), b.clone()]).await;
    published(store, &[artifact("result/i", "two")], &[b.clone(), c.clone()]).await;
    published(store, &[artifact("result/i", "three")], std::slice::from_ref(&b)).await;
    let all = BuildingFilter::default();
    let ids = async |generation| {
        let found = store.buildings("delft", generation, &all, 10).await.expect("lists");
        found.into_iter().map(|b| b.id).collect::<String>()
    };
    assert!(matches!(store.delete_generation("delft", 3).await, Err(JobStoreError::Current { number: 3, .. })));
    assert!(store.delete_generation("delft", 2).await.expect("deletes"));
    assert!(!store.delete_generation("delft", 2).await.expect("asks"));
    assert_eq!((ids(1).await, ids(3).await), ("ab".to_owned(), "b".to_owned()), "the others are as they were");
    let blob = |content: &str| gable_job_store::BlobId::of(content.as_bytes());

    // Of a job goes all but what it published.
    let open = submit(store, &job("delft", vec![task(0, "x")])).await;
    assert!(matches!(store.delete_job(&open).await, Err(JobStoreError::State { .. })));
    assert!(matches!(store.delete_city("delft").await, Err(JobStoreError::InUse { .. })), "a job is under way");
    store.delete_job(&first).await.expect("deletes");
    assert!(matches!(store.job(&first).await, Err(JobStoreError::NoJob(_))));
    assert_eq!((ids(1).await, store.events(&first, 0, 9).await.expect("asks").len()), ("ab".to_owned(), 0));
    assert!(store.is_referenced(blob("one")).await.expect("asks"));
    assert_eq!(store.roll_back("delft", 1).await.expect("rolls"), Some(4));
    assert_eq!(ids(4).await, "ab");

    // A city that is gone may be anybody's.
    let held = claim(store, "w").await;
    finish(store, &held).await;
    let member = store.set_member("delft", "eve", Some(Role::Viewer)).await;
    assert!(member.expect("sets") && store.delete_city("delft").await.expect("deletes"));
    assert!(!store.delete_city("delft").await.expect("asks"));
    assert_eq!(store.city("delft").await.expect("asks"), None);
    assert!(store.members("delft").await.expect("lists").is_empty() && store.job(&open).await.is_err());
    assert!(
        !store.is_referenced(blob("one")).await.expect("asks")
            && !store.is_referenced(blob("three")).await.expect("asks")
    );
    let bob =
        NewJob { owner: "bob".to_owned(), names: Some(vec!["bob".to_owned()]), ..job("delft", vec![task(0, "x")]) };
    store.submit(&bob).await.expect("it is bob's now");
}

pub(crate) async fn what_is_kept_no_longer_goes(store: &Store) {
    for n in 0..5 {
        published(store, &[artifact("result/i", &n.to_string())], &[building("a", &n.to_string(), 0.0)]).await;
    }
    let numbers = async || {
        let all = store.generations("delft", None, 10).await.expect("lists");
        all.into_iter().map(|g| g.number).collect::<Vec<_>>()
    };
    assert_eq!(store.purge(&KEEP).await.expect("purges"), Purged::default());
    let purged = store.purge(&Retention { generations: 3, ..KEEP }).await.expect("purges");
    assert_eq!((purged.generations, numbers().await), (2, vec![5, 4, 3]));
    tokio::time::sleep(Duration::from_millis(5)).await;
    let old = Retention { generation_age: Some(Duration::ZERO), ..KEEP };
    assert_eq!(
        (store.purge(&old).await.expect("purges").generations, numbers().await),
        (2, vec![5]),
        "readers see one"
    );
    let open = submit(store, &job("delft", vec![task(0, "x")])).await;
    let jobs = store.purge(&Retention { job_age: Some(Duration::ZERO), ..KEEP }).await.expect("purges").jobs;
    assert_eq!((jobs, numbers().await), (5, vec![5]));
    assert_eq!(store.job(&open).await.expect("there").state, JobState::Accepted);
    let rows = store.buildings("delft", 5, &BuildingFilter::default(), 10).await.expect("lists");
    assert_eq!(rows.len(), 1);
}

pub(crate) async fn what_failed_keeps_its_blobs_for_a_while(store: &Store) {
    let folder = tempfile::tempdir().expect("a folder");
    let blobs = gable_job_store::Blobs::in_folder(folder.path()).expect("opens");
    let id = submit(store, &job("delft", vec![task(0, "split")])).await;
    let held = claim(store, "w").await;
    let tasks = vec![task(1, "x")];
    let made = blobs.put(b"block".to_vec()).await.expect("put");
    let artifacts = vec![artifact("blocks/x", "block")];
    store.finish(&held, &Finished { artifacts, tasks, ..Finished::default() }).await.expect("finishes");
    let held = claim(store, "w").await;
    store.fail(&held, "no", gable_job_store::Retry::Never).await.expect("fails");
    let (long, now) = (Duration::from_secs(3600), Duration::ZERO);
    store.collect(&blobs, now, long, long).await.expect("collects");
    assert!(blobs.contains(made).await.expect("asks"), "it may be retried");
    tokio::time::sleep(Duration::from_millis(5)).await;
    let collected = store.collect(&blobs, now, long, now).await.expect("collects");
    assert_eq!((collected.artifacts, blobs.contains(made).await.expect("asks")), (1, false));
    let refused = store.retry_failed(&id).await.expect_err("what it needs is gone").to_string();
    assert!(refused.contains("submit it again"), "{refused}");
}
