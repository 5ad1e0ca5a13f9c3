//! Members of cities, roll-backs, tokens that rotate, and the audit log; each part on an empty database.

use crate::cities::{artifact, building, published};
use crate::suite::{job, task};
use gable_job_store::{
    AuditEntry, AuditFilter, BuildingFilter, JobFilter, JobStoreError, NewJob, Role, Scope, Session, Store,
    TokenRecord, Upload, UploadQuota,
};
use std::time::Duration;

fn names(list: &[&str]) -> Vec<String> {
    list.iter().map(|name| (*name).to_owned()).collect()
}

fn of(city: &str, owner: &str, groups: &[&str]) -> NewJob {
    let all = names(&[&[owner], groups].concat());
    NewJob { owner: owner.to_owned(), names: Some(all), ..job(city, vec![task(0, "city")]) }
}

pub(crate) async fn a_city_is_of_whom_it_was_first(store: &Store) {
    // Many submit its first job at once: one of them owns it, and the others may not.
    let all = (0..8).map(|n| {
        let store = store.clone();
        tokio::spawn(async move { store.submit(&of("delft", &format!("u{n}"), &[])).await })
    });
    let mut owners = 0;
    for one in all.collect::<Vec<_>>() {
        match one.await.expect("it ends") {
            Ok(_) => owners += 1,
            Err(JobStoreError::NotAnEditor { city }) => assert_eq!(city, "delft"),
            Err(e) => panic!("{e}"),
        }
    }
    assert_eq!(owners, 1);
    let members = store.members("delft").await.expect("lists");
    assert_eq!((members.len(), members[0].role), (1, Role::Owner));
    let owner = members[0].name.clone();

    // Roles, of names and of groups; the highest counts.
    let role = async |list: &[&str]| store.role("delft", &names(list)).await.expect("asks");
    let set = async |name: &str, role| store.set_member("delft", name, role).await;
    assert_eq!(role(&["eve"]).await, None);
    assert!(set("eve", Some(Role::Viewer)).await.expect("sets"));
    assert!(matches!(store.submit(&of("delft", "eve", &[])).await, Err(JobStoreError::NotAnEditor { .. })));
    assert!(set("group:town", Some(Role::Editor)).await.expect("sets"));
    assert_eq!(role(&["eve", "group:town"]).await, Some(Role::Editor));
    assert!(store.submit(&of("delft", "eve", &["group:town"])).await.is_ok());
    assert!(store.submit(&job("delft", vec![task(0, "city")])).await.is_ok(), "who is not held to names may");
    assert!(matches!(set(&owner, None).await, Err(JobStoreError::LastOwner { .. })));
    assert!(matches!(set(&owner, Some(Role::Viewer)).await, Err(JobStoreError::LastOwner { .. })));
    assert!(set("ann", Some(Role::Owner)).await.expect("sets") && set(&owner, None).await.expect("removes"));
    assert!(!set(&owner, None).await.expect("asks") && !store.set_member("x", "a", None).await.expect("asks"));

    // Lists have what members see.
    store.submit(&of("leiden", "bob", &[])).await.expect("submits");
    let seen = async |list: &[&str]| {
        let filter = JobFilter { seen_by: Some(names(list)), owner: None, ..JobFilter::default() };
        let jobs = store.jobs(&filter, 100).await.expect("lists");
        jobs.into_iter().map(|j| j.city).collect::<std::collections::BTreeSet<_>>().into_iter().collect::<Vec<_>>()
    };
    assert_eq!(seen(&["bob"]).await, ["leiden"]);
    assert_eq!(seen(&["bob", "eve"]).await, ["delft", "leiden"]);
    assert!(seen(&["mallory"]).await.is_empty() && seen(&[]).await.is_empty());
    let filter = JobFilter {
        seen_by: Some(names(&["eve"])),
        city: Some("delft".to_owned()),
        created_from: Some(0),
        ..JobFilter::default()
    };
    assert_eq!(store.jobs(&filter, 100).await.expect("lists").len(), 3);

    let quota = UploadQuota { open: 9, bytes: 1 << 20 };
    for (id, owner, city) in [("a", "ann", None), ("b", "bob", Some("delft")), ("c", "bob", None)] {
        let upload = Upload {
            id: id.to_owned(),
            owner: owner.to_owned(),
            city: city.map(str::to_owned),
            name: "m.off".to_owned(),
            bytes: 0,
            files: 0,
            created: 0,
        };
        store.add_upload(&upload, &[], quota).await.expect("adds");
    }
    let uploads = async |list: &[&str]| {
        let all = store.uploads(Some(&names(list)), 10).await.expect("lists");
        all.into_iter().map(|u| u.id).collect::<Vec<_>>()
    };
    assert_eq!((uploads(&["ann"]).await, uploads(&["bob"]).await), (names(&["b", "a"]), names(&["c", "b"])));
    assert_eq!(store.uploads(None, 10).await.expect("lists").len(), 3);
}

pub(crate) async fn a_city_rolls_back_to_any_generation(store: &Store) {
    let (a, b, c) = (building("a", "1", 0.0), building("b", "1", 100.0), building("c", "1", 200.0));
    let b2 = building("b", "2", 100.0);
    published(store, &[artifact("result/i", "one"), artifact("result/t", "same")], &[a.clone(), b.clone()]).await;
    published(store, &[artifact("result/i", "two"), artifact("result/t", "same")], &[b2.clone(), c.clone()]).await;
    published(store, &[artifact("result/i", "three"), artifact("result/n", "new")], std::slice::from_ref(&c)).await;
    assert_eq!(store.roll_back("delft", 7).await.expect("asks"), None);
    assert_eq!(store.roll_back("berlin", 1).await.expect("asks"), None);
    assert_eq!(store.roll_back("delft", 3).await.expect("asks"), Some(3), "readers see it already");
    assert_eq!(store.roll_back("delft", 1).await.expect("rolls"), Some(4));
    let all = BuildingFilter::default();
    let state = async |generation| {
        let buildings = store.buildings("delft", generation, &all, 10).await.expect("lists");
        (buildings, store.city_files("delft", generation, "").await.expect("lists"))
    };
    assert_eq!(state(4).await, state(1).await);
    assert_eq!(state(4).await.0, [a.clone(), b.clone()]);
    assert_eq!(state(3).await.0, std::slice::from_ref(&c), "what was stays as it was");
    let generation = store.generation("delft", 4).await.expect("asks").expect("there");
    let counts = (generation.added, generation.removed, generation.changed);
    assert_eq!((counts, generation.restored, generation.buildings), ((2, 1, 0), Some(1), 2));
    assert_eq!(store.roll_back("delft", 2).await.expect("rolls"), Some(5));
    assert_eq!(state(5).await, state(2).await);
    let generation = store.generation("delft", 5).await.expect("asks").expect("there");
    assert_eq!((generation.added, generation.removed, generation.changed), (1, 1, 1));
    assert_eq!(store.city("delft").await.expect("asks").expect("there").generation, Some(5));
    // Jobs go on from there.
    published(store, &[artifact("result/i", "four")], &[a.clone(), b2]).await;
    let newest = store.generation("delft", 6).await.expect("asks").expect("there");
    assert_eq!((newest.added, newest.removed, newest.changed, newest.restored), (1, 1, 0, None));
}

pub(crate) async fn tokens_rotate_by_name(store: &Store) {
    let token = TokenRecord {
        hash: "h1".to_owned(),
        name: "ann".to_owned(),
        scope: Scope::Submitter,
        groups: names(&["north", "south"]),
        max_jobs: Some(2),
        expires: None,
        created: 0,
    };
    assert!(store.add_token(&token).await.expect("adds"));
    let opens = async |hash: &str| store.token(hash).await.expect("asks").map(|t| (t.name, t.groups, t.max_jobs));
    let ann = Some(("ann".to_owned(), names(&["north", "south"]), Some(2)));
    assert_eq!(opens("h1").await, ann);
    assert!(store.rotate_token("ann", "h2", Duration::from_millis(300)).await.expect("rotates"));
    assert_eq!((opens("h2").await, opens("h1").await), (ann.clone(), ann.clone()), "both for a while");
    tokio::time::sleep(Duration::from_millis(400)).await;
    assert_eq!((opens("h2").await, opens("h1").await), (ann.clone(), None));
    assert!(store.rotate_token("ann", "h3", Duration::ZERO).await.expect("rotates"));
    assert_eq!((opens("h3").await, opens("h2").await), (ann, None));
    assert!(!store.rotate_token("bob", "h4", Duration::ZERO).await.expect("asks"));
}

pub(crate) async fn the_audit_log_is_kept_and_purged(store: &Store) {
    let entry = |who: &str, city: Option<&str>, target: String| AuditEntry {
        who: who.to_owned(),
        action: "POST /x".to_owned(),
        target,
        status: 200,
        city: city.map(str::to_owned),
        times: 3,
        ..AuditEntry::default()
    };
    let many: Vec<AuditEntry> = (0..250).map(|n| entry("ann", Some("delft"), format!("/{n}"))).collect();
    store.add_audit(&many).await.expect("adds");
    store.add_audit(&[entry("bob", None, "/last".to_owned())]).await.expect("adds");
    let found = async |who: Option<&str>, city: Option<&str>, before: Option<String>| {
        let filter = AuditFilter { who: who.map(str::to_owned), city: city.map(str::to_owned), before };
        store.audit(&filter, 200).await.expect("lists")
    };
    let first = found(None, None, None).await;
    assert_eq!((first.len(), &*first[0].target, first[0].times), (200, "/last", 3));
    assert!(first[0].at > 1_700_000_000_000 && first[0].id > first[1].id);
    let rest = found(None, None, Some(first[199].id.clone())).await;
    assert_eq!((rest.len(), &*rest[50].target), (51, "/0"));
    assert_eq!(found(Some("bob"), None, None).await.len(), 1);
    assert!(found(Some("bob"), Some("delft"), None).await.is_empty());
    assert_eq!(store.purge_audit(Duration::from_secs(3600)).await.expect("purges"), 0);
    tokio::time::sleep(Duration::from_millis(5)).await;
    assert_eq!(store.purge_audit(Duration::ZERO).await.expect("purges"), 251);
}

pub(crate) async fn sessions_hold_for_their_time(store: &Store) {
    let session = |hash: &str, name: &str| Session {
        hash: hash.to_owned(),
        name: name.to_owned(),
        scope: Scope::Submitter,
        groups: names(&["south", "north"]),
        expires: 0,
    };
    let hour = Duration::from_secs(3600);
    store.add_session(&session("a", "user:ann"), Duration::from_millis(300)).await.expect("adds");
    store.add_session(&session("b", "user:ann"), hour).await.expect("adds");
    store.add_session(&session("c", "user:bob"), hour).await.expect("adds");
    assert!(store.add_session(&session("c", "user:eve"), hour).await.is_err(), "two of one hash");
    let found = store.session("b").await.expect("asks").expect("there");
    assert_eq!(Session { expires: 0, ..found.clone() }, session("b", "user:ann"));
    assert_eq!(store.session_of("user:ann").await.expect("asks"), Some(found), "the one that ends last");
    assert!(store.session("a").await.expect("asks").is_some());
    tokio::time::sleep(Duration::from_millis(500)).await;
    assert_eq!(store.session("a").await.expect("asks"), None, "it has ended");
    assert_eq!(store.session("d").await.expect("asks"), None);
    // What has ended is forgotten when another begins.
    store.add_session(&session("d", "user:dan"), hour).await.expect("adds");
    assert!(!store.remove_session("a").await.expect("asks"));
    assert!(store.remove_session("b").await.expect("removes"));
    assert_eq!(store.session_of("user:ann").await.expect("asks"), None);
    assert_eq!(store.remove_sessions_of("user:bob").await.expect("removes"), 1);
    assert_eq!(store.remove_sessions_of("user:bob").await.expect("asks"), 0);
}
