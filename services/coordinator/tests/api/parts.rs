//! Uploads: whole, and in parts.

use crate::{Answer, Service, start, start_with};
use gable_coordinator::{Limits, NewToken, create_token};
use gable_job_store::Scope;
use serde_json::{Value, json};
use sha2::{Digest as _, Sha256};
use std::time::Duration;

fn hex(content: &str) -> String {
    Sha256::digest(content.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A header that tells the hash of a part, in base64.
fn told(content: &str) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::new();
    for three in Sha256::digest(content.as_bytes()).chunks(3) {
        let bits = three.iter().chain([0, 0].iter()).take(3).fold(0_u32, |all, byte| all << 8 | u32::from(*byte));
        for place in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * place) & 63) as usize];
            out.push(if place <= three.len() { char::from(letter) } else { '=' });
        }
    }
    format!("sha-256=:{out}:")
}

impl Service {
    async fn begin(&self, name: &str, headers: &[(&str, &str)]) -> Answer {
        let all = [&[("content-type", "application/json")], headers].concat();
        self.ask("POST", "/api/v1/open-uploads", &all, Some(json!({ "name": name }).to_string())).await
    }

    async fn part(&self, place: &str, number: u32, content: &str) -> Answer {
        let digest = told(content);
        let headers = [("content-digest", digest.as_str())];
        self.ask("PUT", &format!("{place}/parts/{number}"), &headers, Some(content.to_owned())).await
    }

    async fn complete(&self, place: &str, parts: &[&str]) -> Answer {
        let named = parts.iter().enumerate().map(|(i, p)| json!({ "number": i + 1, "sha256": hex(p) }));
        let body = json!({ "parts": named.collect::<Vec<_>>() }).to_string();
        let headers = [("content-type", "application/json")];
        self.ask("POST", &format!("{place}/complete"), &headers, Some(body)).await
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn parts_become_an_upload_however_they_come() {
    let service = start().await;
    let begun = service.begin("delft.off", &[]).await;
    assert_eq!((begun.status, &begun.json()["state"]), (201, &json!("open")), "{}", begun.json());
    let place = begun.header("location").to_owned();
    // The second before the first, which is sent again; and one of an attempt that was longer.
    assert_eq!(service.part(&place, 2, "0 0 0\n").await.status, 200);
    assert_eq!(service.part(&place, 1, "OFX\n").await.status, 200);
    assert_eq!(service.part(&place, 1, "OFF\n").await.json()["sha256"], hex("OFF\n"));
    assert_eq!(service.part(&place, 3, "left over").await.status, 200);
    let shown = service.get(&place).await.json();
    let parts: Vec<_> = shown["parts"].as_array().unwrap().iter().map(|p| (&p["number"], &p["bytes"])).collect();
    assert_eq!(parts, [(&json!(1), &json!(4)), (&json!(2), &json!(6)), (&json!(3), &json!(9))]);
    let listed = service.get("/api/v1/open-uploads").await.json();
    assert_eq!((&listed[0]["id"], listed[0]["parts"].as_array().unwrap().len()), (&shown["id"], 0));

    // What does not fit is refused, and can be mended.
    let missing = service.complete(&place, &["OFF\n", "0 0 0\n", "left over", "more"]).await.problem(409, "parts");
    assert!(missing.contains("part 4 has not come"), "{missing}");
    let other = service.complete(&place, &["OFF\n", "1 1 1\n"]).await.problem(409, "parts");
    assert!(other.contains("part 2 is another"), "{other}");
    let digest = told("what was sent");
    let damaged = [("content-digest", digest.as_str())];
    let path = format!("{place}/parts/1");
    service.ask("PUT", &path, &damaged, Some("what came".to_owned())).await.problem(422, "digest");
    for (number, content) in [("0", "x"), ("10001", "x"), ("1", "")] {
        let path = format!("{place}/parts/{number}");
        service.ask("PUT", &path, &[], Some(content.to_owned())).await.problem(422, "invalid");
    }

    let done = service.complete(&place, &["OFF\n", "0 0 0\n"]).await;
    assert_eq!((done.status, &done.json()["name"], &done.json()["bytes"]), (201, &json!("delft.off"), &json!(10)));
    let again = service.complete(&place, &["OFF\n", "0 0 0\n"]).await;
    assert_eq!(again.json()["id"], done.json()["id"], "an answer that was lost is given again");
    assert_eq!(service.get(&place).await.json()["state"], "done");
    service.part(&place, 1, "late").await.problem(409, "state");
    let id = done.json()["id"].as_str().unwrap().to_owned();
    let files = service.parts.store.upload_files(&id).await.expect("files");
    assert_eq!(service.parts.blobs.get(files[0].blob).await.expect("there"), &b"OFF\n0 0 0\n"[..]);
    let job = service.submit(&json!({ "source": done.json()["source"], "city": "delft" }), &[]).await;
    assert_eq!(job.status, 201, "{}", job.json());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_no_mesh_fails_for_good_and_can_be_given_up() {
    let service = start().await;
    service.begin("delft.exe", &[]).await.problem(422, "invalid");
    let place = service.begin("delft.zip", &[]).await.header("location").to_owned();
    service.part(&place, 1, "no archive").await;
    for _ in 0..2 {
        let told = service.complete(&place, &["no archive"]).await.problem(422, "invalid");
        assert!(told.contains("archive cannot be read"), "{told}");
    }
    assert_eq!(service.get(&place).await.json()["state"], "failed");
    assert_eq!(service.ask("DELETE", &place, &[], None).await.status, 204);
    service.get(&place).await.problem(404, "not-found");
    service.part(&place, 1, "x").await.problem(404, "not-found");
}

/// Coordinators that are asked to complete at the same time make one upload.
#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn an_upload_is_completed_once() {
    let service = start().await;
    let place = service.begin("delft.off", &[]).await.header("location").to_owned();
    service.part(&place, 1, "OFF\n").await;
    let asked: Vec<Answer> = futures_util::future::join_all((0..6).map(|_| service.complete(&place, &["OFF\n"]))).await;
    assert!(
        asked.iter().all(|a| matches!(a.status, 201 | 202)),
        "{:?}",
        asked.iter().map(|a| a.status).collect::<Vec<_>>()
    );
    let uploads = service.get("/api/v1/uploads").await.json();
    assert_eq!(uploads.as_array().map(Vec::len), Some(1), "{uploads}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn quotas_hold_for_parts_as_for_whole_uploads() {
    let limits = Limits { uploads: 100, open_uploads: 2, time: Duration::from_secs(20), ..Limits::default() };
    let service = start_with(limits).await;
    let token = async |name: &str| {
        let new = NewToken {
            name: name.to_owned(),
            scope: Scope::Submitter,
            groups: Vec::new(),
            max_jobs: None,
            expires: None,
        };
        format!("Bearer {}", create_token(&service.parts.store, &new).await.expect("made").expect("the name is free"))
    };
    let (ann, bob) = (token("ann").await, token("bob").await);
    let ask = async |token: &str, method: &str, path: &str, body: String| {
        let headers = [("authorization", token), ("content-type", "application/json")];
        service.ask(method, &format!("/api/v1{path}"), &headers, Some(body)).await
    };
    let open = async |token: &str| ask(token, "POST", "/open-uploads", json!({ "name": "a.off" }).to_string()).await;
    let id = |answer: &Answer| -> String { answer.json()["id"].as_str().unwrap().to_owned() };
    let first = id(&open(&ann).await);
    let second = id(&open(&ann).await);
    let third = open(&ann).await.problem(429, "quota");
    assert!(third.contains("2 uploads under way"), "{third}");
    assert_eq!(open(&bob).await.status, 201, "each token has its own");
    // Others neither see nor steer it.
    ask(&bob, "GET", &format!("/open-uploads/{first}"), String::new()).await.problem(404, "not-found");
    ask(&bob, "PUT", &format!("/open-uploads/{first}/parts/1"), "x".to_owned()).await.problem(404, "not-found");

    let put = async |id: &str, number: u32, bytes: usize| {
        ask(&ann, "PUT", &format!("/open-uploads/{id}/parts/{number}"), "x".repeat(bytes)).await
    };
    assert_eq!(put(&first, 1, 60).await.status, 200);
    put(&second, 1, 60).await.problem(413, "quota");
    assert_eq!(put(&second, 1, 40).await.status, 200);
    put(&first, 2, 1).await.problem(413, "quota");
    ask(&ann, "PUT", "/uploads?name=b.off", "OFF".to_owned()).await.problem(413, "quota");
    assert_eq!(ask(&ann, "DELETE", &format!("/open-uploads/{second}"), String::new()).await.status, 204);
    // By PUT as curl -T sends, and by POST; what would be too much is cut off.
    let whole = ask(&ann, "PUT", "/uploads?name=b.off", "OFF".to_owned()).await;
    assert_eq!(whole.status, 201, "{}", whole.json());
    ask(&ann, "POST", "/uploads?name=c.off", "x".repeat(38)).await.problem(413, "body");
    assert_eq!(ask(&ann, "POST", "/uploads?name=c.off", "x".repeat(37)).await.status, 201);
    let kept: Value = ask(&ann, "GET", "/uploads", String::new()).await.json();
    assert_eq!(kept.as_array().map(Vec::len), Some(2));
    assert_eq!(ask(&bob, "POST", "/uploads?name=c.off", "x".repeat(100)).await.status, 201);
}
