//! Generations of cities, results that are taken over, and what is removed; each part on an empty database.

use crate::suite::{claim, finish, job, nothing_to_do, state, submit, task};
use gable_job_store::{
    Artifact, BlobId, Blobs, BuildingFilter, Change, ChangeKind, CityBuilding, EventKind, Finished, JobState,
    JobStoreError, NewTask, Publication, Retry, Store, TaskState,
};
use std::time::Duration;

const LONG: Duration = Duration::from_secs(3600);

pub(crate) fn artifact(path: &str, content: &str) -> Artifact {
    Artifact { path: path.to_owned(), blob: BlobId::of(content.as_bytes()), bytes: content.len() as u64 }
}

pub(crate) fn building(id: &str, hash: &str, x: f64) -> CityBuilding {
    CityBuilding {
        id: id.to_owned(),
        hash: hash.to_owned(),
        tile: "0_0".to_owned(),
        bbox: [x, 0.0, x + 10.0, 10.0],
        lod: "lod2".to_owned(),
        roof_type: (id != "b").then(|| "hipped".to_owned()),
        height: x,
        area: 100.0,
        attributes: r#"{"roof_type":"hipped"}"#.to_owned(),
    }
}

fn city(buildings: &[CityBuilding]) -> Option<Publication> {
    Some(Publication { crs: "EPSG:7415".to_owned(), buildings: buildings.to_vec() })
}

/// A job whose only task publishes.
pub(crate) async fn published(store: &Store, files: &[Artifact], buildings: &[CityBuilding]) -> String {
    let id = submit(store, &job("delft", vec![task(0, "city")])).await;
    let held = claim(store, "w").await;
    let result = Finished { artifacts: files.to_vec(), publication: city(buildings), ..Finished::default() };
    store.finish(&held, &result).await.expect("finishes");
    id
}

pub(crate) async fn generations_hold_what_was_published(store: &Store) {
    assert_eq!(store.city("delft").await.expect("asks"), None);
    let (a, b, c) = (building("a", "1", 0.0), building("b", "1", 100.0), building("c", "1", 200.0));
    let files =
        [artifact("result/index.json", "one"), artifact("result/tiles/0_0.gml", "same"), artifact("seen/0", "x")];
    let first = published(store, &files, &[a.clone(), b.clone()]).await;
    let files = [artifact("result/index.json", "two"), artifact("result/tiles/0_0.gml", "same")];
    let b2 = building("b", "2", 100.0);
    let _second = published(store, &files, &[b2.clone(), c.clone()]).await;

    let delft = store.city("delft").await.expect("asks").expect("there");
    assert_eq!(delft.generation, Some(2));
    assert_eq!(store.cities(None, None, 10).await.expect("lists"), [delft]);
    assert!(store.cities(None, Some("delft"), 10).await.expect("lists").is_empty());
    let generations = store.generations("delft", None, 10).await.expect("lists");
    let counts: Vec<_> = generations.iter().map(|g| (g.number, g.buildings, g.added, g.removed, g.changed)).collect();
    assert_eq!(counts, [(2, 2, 1, 1, 1), (1, 2, 2, 0, 0)]);
    assert_eq!((&generations[1].job, generations[1].partial, &*generations[1].crs), (&first, false, "EPSG:7415"));
    assert_eq!(store.generation("delft", 1).await.expect("asks").as_ref(), Some(&generations[1]));
    assert_eq!(store.generation("delft", 3).await.expect("asks"), None);

    let all = BuildingFilter::default();
    assert_eq!(store.buildings("delft", 1, &all, 10).await.expect("lists"), [a, b]);
    assert_eq!(store.buildings("delft", 2, &all, 10).await.expect("lists"), [b2.clone(), c.clone()]);
    let change = |id: &str, kind| Change { id: id.to_owned(), kind };
    let forward = [change("a", ChangeKind::Removed), change("b", ChangeKind::Changed), change("c", ChangeKind::Added)];
    assert_eq!(store.changes("delft", 1, 2, None, 10).await.expect("compares"), forward);
    assert_eq!(store.changes("delft", 1, 2, Some("a"), 1).await.expect("compares"), forward[1..2]);
    assert_eq!(store.changes("delft", 2, 1, None, 1).await.expect("compares"), [change("a", ChangeKind::Added)]);
    assert!(store.changes("delft", 2, 2, None, 10).await.expect("compares").is_empty());

    let found = |filter: BuildingFilter| async move {
        let found = store.buildings("delft", 2, &filter, 10).await.expect("finds");
        found.into_iter().map(|b| b.id).collect::<Vec<_>>()
    };
    assert_eq!(found(BuildingFilter { bbox: Some([110.0, 5.0, 120.0, 6.0]), ..all.clone() }).await, ["b"]);
    assert_eq!(found(BuildingFilter { bbox: Some([0.0, 50.0, 900.0, 60.0]), ..all.clone() }).await, [""; 0]);
    assert_eq!(found(BuildingFilter { roof_type: Some("hipped".to_owned()), ..all.clone() }).await, ["c"]);
    assert_eq!(found(BuildingFilter { min_height: Some(150.0), max_area: Some(100.0), ..all.clone() }).await, ["c"]);
    let last = BuildingFilter { lod: Some("lod2".to_owned()), after: Some("b".to_owned()), ..all.clone() };
    assert_eq!(found(last).await, ["c"]);
    assert_eq!(store.buildings("delft", 2, &all, 1).await.expect("lists"), [b2]);

    let index = |content| vec![artifact("index.json", content)];
    assert_eq!(store.city_files("delft", 1, "index").await.expect("lists"), index("one"));
    assert_eq!(store.city_files("delft", 2, "index").await.expect("lists"), index("two"));
    assert_eq!(store.city_file("delft", 2, "index.json").await.expect("asks"), index("two").pop());
    assert_eq!(store.city_file("delft", 2, "index").await.expect("asks"), None);
    assert_eq!(store.city_files("delft", 2, "").await.expect("lists").len(), 2, "only results are the city's");
    let events = store.events(&first, 0, 100).await.expect("events");
    assert!(
        events.iter().any(|e| e.kind == EventKind::Published && e.message.as_deref() == Some("generation 1 of delft"))
    );
}

pub(crate) async fn readers_never_get_less_than_they_had(store: &Store) {
    let older = submit(store, &job("delft", vec![task(0, "city")])).await;
    let late = claim(store, "w").await;
    let _newer = published(store, &[], &[building("a", "1", 0.0)]).await;
    let result = Finished { publication: city(&[building("a", "0", 0.0)]), ..Finished::default() };
    store.finish(&late, &result).await.expect("finishes");
    assert_eq!(state(store, &older).await, JobState::Successful);
    let withheld = |events: Vec<gable_job_store::Event>| {
        events.into_iter().find(|e| e.kind == EventKind::Withheld).and_then(|e| e.message).expect("held back")
    };
    let reason = withheld(store.events(&older, 0, 100).await.expect("events"));
    assert_eq!(reason, "generation 1 of delft is of a later job");

    // A city with holes does not take the place of a whole one, until they are mended.
    let partial = submit(store, &job("delft", vec![task(0, "0_0"), task(1, "city")])).await;
    let bad = claim(store, "w").await;
    store.fail(&bad, "no memory", Retry::Never).await.expect("fails");
    let result = Finished { publication: city(&[]), ..Finished::default() };
    store.finish(&claim(store, "w").await, &result).await.expect("finishes");
    assert_eq!(state(store, &partial).await, JobState::Partial);
    assert!(withheld(store.events(&partial, 0, 100).await.expect("events")).contains("lacks blocks"));
    assert_eq!(store.generations("delft", None, 10).await.expect("lists").len(), 1);
    store.retry_failed(&partial).await.expect("retries");
    finish(store, &claim(store, "w").await).await;
    store.finish(&claim(store, "w").await, &result).await.expect("finishes");
    let last = store.generation("delft", 2).await.expect("asks").expect("published");
    assert_eq!((last.job, last.removed, last.partial), (partial, 1, false));

    // Where there is nothing yet, a city with holes is better.
    let id = submit(store, &job("ghent", vec![task(0, "0_0"), task(1, "city")])).await;
    store.fail(&claim(store, "w").await, "no memory", Retry::Never).await.expect("fails");
    store.finish(&claim(store, "w").await, &result).await.expect("finishes");
    let only = store.generation("ghent", 1).await.expect("asks").expect("published");
    assert_eq!((only.job, only.partial), (id, true));
}

pub(crate) async fn outcomes_are_taken_over(store: &Store) {
    let first = submit(store, &job("delft", vec![task(0, "split")])).await;
    let held = claim(store, "w").await;
    assert_eq!(store.outcome(&held, "k").await.expect("asks"), None);
    let made = Finished {
        artifacts: vec![artifact("a", "a"), artifact("b", "b")],
        tasks: vec![task(1, "x"), NewTask { required: true, ..task(2, "city") }],
        key: Some("k".to_owned()),
        ..Finished::default()
    };
    store.finish(&held, &made).await.expect("finishes");
    store.cancel(&first).await.expect("cancels");

    let other = submit(store, &job("ghent", vec![task(0, "split")])).await;
    let held = claim(store, "w").await;
    assert_eq!(store.outcome(&held, "k").await.expect("asks"), None, "of another city");
    store.fail(&held, "enough", Retry::Never).await.expect("fails");
    assert!(state(store, &other).await.is_over());

    let second = submit(store, &job("delft", vec![task(0, "split")])).await;
    let held = claim(store, "w").await;
    assert_eq!(store.outcome(&held, "l").await.expect("asks"), None);
    let known = store.outcome(&held, "k").await.expect("asks").expect("known");
    assert_eq!(known, Finished { reused: true, ..made });
    store.finish(&held, &known).await.expect("finishes");
    let tasks = store.tasks(&second).await.expect("tasks");
    let states: Vec<_> = tasks.iter().map(|t| (t.unit.as_str(), t.state)).collect();
    assert_eq!(states, [("split", TaskState::Reused), ("x", TaskState::Ready), ("city", TaskState::Ready)]);
    assert_eq!(store.artifacts(&second, "").await.expect("artefacts"), known.artifacts);

    // Forgotten between the look and the end: the task is still held, and can be done.
    store.cancel(&second).await.expect("cancels");
    submit(store, &job("delft", vec![task(0, "split")])).await;
    let held = claim(store, "w").await;
    tokio::time::sleep(Duration::from_millis(5)).await;
    assert_eq!(store.forget_outcomes(Duration::ZERO).await.expect("forgets"), 1);
    assert!(matches!(store.finish(&held, &known).await, Err(JobStoreError::NoOutcome { .. })));
    store.finish(&held, &Finished { reused: false, ..known }).await.expect("finishes");
}

pub(crate) async fn a_retry_begins_with_what_failed(store: &Store) {
    let id = submit(store, &job("delft", vec![task(0, "split")])).await;
    let split = Finished {
        artifacts: vec![artifact("blocks", "blocks")],
        tasks: vec![task(1, "x"), task(1, "y"), task(2, "city")],
        ..Finished::default()
    };
    store.finish(&claim(store, "w").await, &split).await.expect("finishes");
    let x = Finished { artifacts: vec![artifact("x", "x")], ..Finished::default() };
    store.finish(&claim(store, "w").await, &x).await.expect("finishes");
    store.fail(&claim(store, "w").await, "no memory", Retry::Never).await.expect("fails");
    let without_y = Finished {
        artifacts: vec![artifact("city", "without y")],
        tasks: vec![NewTask { input: "old".to_owned(), ..task(3, "tile") }, task(3, "only before")],
        ..Finished::default()
    };
    store.finish(&claim(store, "w").await, &without_y).await.expect("finishes");
    finish(store, &claim(store, "w").await).await;
    finish(store, &claim(store, "w").await).await;
    assert_eq!(state(store, &id).await, JobState::Partial);

    store.retry_failed(&id).await.expect("retries");
    let paths = |found: Vec<Artifact>| found.into_iter().map(|a| a.path).collect::<Vec<_>>();
    assert_eq!(paths(store.artifacts(&id, "").await.expect("artefacts")), ["blocks", "x"]);
    let y = claim(store, "w").await;
    assert_eq!(y.unit, "y");
    finish(store, &y).await;
    let whole = Finished { tasks: vec![NewTask { input: "new".to_owned(), ..task(3, "tile") }], ..Finished::default() };
    store.finish(&claim(store, "w").await, &whole).await.expect("finishes");
    let tile = claim(store, "w").await;
    assert_eq!((&*tile.unit, &*tile.input), ("tile", "new"));
    finish(store, &tile).await;
    assert!(nothing_to_do(store).await);
    assert_eq!(state(store, &id).await, JobState::Successful);
    assert_eq!(store.tasks(&id).await.expect("tasks").len(), 5);
}

pub(crate) async fn only_what_nothing_refers_to_is_removed(store: &Store) {
    let folder = tempfile::tempdir().expect("a folder");
    let blobs = Blobs::in_folder(folder.path()).expect("opens");
    let put = |content: &'static str| {
        let blobs = blobs.clone();
        async move { blobs.put(content.as_bytes().to_vec()).await.expect("put") }
    };
    let (result, inner, kept) = (put("result").await, put("inner").await, put("kept").await);
    let (lost, held) = (put("lost").await, put("held").await);
    published(store, &[artifact("result/index.json", "result"), artifact("seen/0_0", "inner")], &[]).await;
    submit(store, &job("delft", vec![task(0, "x")])).await;
    let outcome = Finished { artifacts: vec![artifact("a", "kept")], key: Some("k".to_owned()), ..Finished::default() };
    store.finish(&claim(store, "w").await, &outcome).await.expect("finishes");
    assert!(store.hold(&[held, held], LONG).await.expect("holds"));
    tokio::time::sleep(Duration::from_millis(20)).await;

    assert_eq!(store.collect(&blobs, LONG, LONG, LONG).await.expect("collects").blobs, 0, "too young");
    let collected = store.collect(&blobs, Duration::ZERO, LONG, LONG).await.expect("collects");
    assert_eq!((collected.blobs, collected.artifacts, collected.outcomes), (1, 0, 0));
    for (blob, there) in [(result, true), (inner, true), (kept, true), (held, true), (lost, false)] {
        assert_eq!(blobs.contains(blob).await.expect("asks"), there);
    }
    assert!(store.hold(&[lost], Duration::ZERO).await.expect("holds"), "what is gone can come again");

    // Old jobs keep their results, and a city its files; what only they were made of goes.
    let collected = store.collect(&blobs, Duration::ZERO, Duration::ZERO, Duration::ZERO).await.expect("collects");
    assert_eq!((collected.artifacts, collected.outcomes), (2, 1));
    for (blob, there) in [(result, true), (inner, false), (kept, false), (held, true)] {
        assert_eq!(blobs.contains(blob).await.expect("asks"), there);
    }
}
