//! Webhooks, to a real receiver.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use gable_job_store::{MessageState, NewJob, NewTask, Store, Webhook, WebhookMessage};
use hmac::{Hmac, KeyInit as _, Mac as _};
use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpListener;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// What a receiver got.
pub(crate) struct Got {
    at: Instant,
    /// Method, path and version.
    pub(crate) line: String,
    pub(crate) headers: BTreeMap<String, String>,
    pub(crate) body: String,
}

/// A receiver that gives these answers, one after the other, and then 200.
pub(crate) fn receiver(answers: &'static [&'static str]) -> (String, Receiver<Got>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let url = format!("http://{}/hook?key=hidden", listener.local_addr().expect("its address"));
    let (told, got) = channel();
    std::thread::spawn(move || {
        let mut answers = answers.iter();
        for stream in listener.incoming().map_while(Result::ok) {
            let mut lines = BufReader::new(&stream);
            let mut line = String::new();
            let mut headers = BTreeMap::new();
            lines.read_line(&mut line).expect("a request");
            assert!(line.starts_with("POST /hook?key=hidden"), "{line}");
            loop {
                let mut field = String::new();
                lines.read_line(&mut field).expect("a header");
                let Some((name, value)) = field.trim().split_once(": ") else { break };
                headers.insert(name.to_lowercase(), value.to_owned());
            }
            let mut body = vec![0; headers["content-length"].parse().expect("a length")];
            lines.read_exact(&mut body).expect("a body");
            let answer = answers.next().unwrap_or(&"200 OK");
            let _ = write!(&stream, "HTTP/1.1 {answer}\r\ncontent-length: 0\r\n\r\n");
            let body = String::from_utf8(body).expect("UTF-8");
            if told.send(Got { at: Instant::now(), line, headers, body }).is_err() {
                return;
            }
        }
    });
    (url, got)
}

const SECRET: &str = "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw";

/// A service with one webhook and a job that was cancelled.
async fn told(url: &str) -> (tempfile::TempDir, Store) {
    let folder = tempfile::tempdir().expect("a folder");
    let store = Store::connect(&format!("sqlite:{}", folder.path().join("jobs.db").display())).await.expect("opens");
    let hook = Webhook {
        id: "hook".to_owned(),
        owner: "ann".to_owned(),
        url: url.to_owned(),
        secret: SECRET.to_owned(),
        events: Vec::new(),
        city: None,
        enabled: true,
        created: 0,
        callback: None,
    };
    store.add_webhook(&hook).await.expect("added");
    let first = NewTask { stage: 0, unit: "a".to_owned(), input: "{}".to_owned(), required: true, max_attempts: 1 };
    let job = NewJob {
        city: "delft".to_owned(),
        owner: "ann".to_owned(),
        request: "{}".to_owned(),
        tasks: vec![first],
        ..NewJob::default()
    };
    let id = store.submit(&job).await.expect("submitted").id;
    store.cancel(&id).await.expect("cancelled");
    (folder, store)
}

/// Lets two coordinators send until the message is in this state.
async fn send_until(store: &Store, private: bool, state: MessageState) -> WebhookMessage {
    let (stop, stopped) = tokio::sync::watch::channel(false);
    let wait = async {
        let begin = Instant::now();
        loop {
            let message = store.webhook_messages("hook", 1).await.expect("lists").remove(0);
            if message.state == state {
                // Whatever else would be sent.
                tokio::time::sleep(Duration::from_millis(700)).await;
                stop.send_replace(true);
                return message;
            }
            assert!(begin.elapsed() < Duration::from_secs(30), "{message:?}");
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    };
    let deliver = || gable_coordinator::deliver(store, private, stopped.clone());
    let (message, one, two) = tokio::join!(wait, deliver(), deliver());
    one.and(two).expect("requests can be made");
    message
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_message_is_signed_and_sent_again_until_it_is_taken() {
    let (url, got) = receiver(&["500 Oops"]);
    let (_folder, store) = told(&url).await;
    let message = send_until(&store, true, MessageState::Delivered).await;
    assert_eq!((message.attempts, message.answer.as_deref()), (2, Some("200 OK")));
    let all: Vec<Got> = got.try_iter().collect();
    assert_eq!(all.len(), 2, "one of the coordinators sends it");
    let pause = all[1].at - all[0].at;
    assert!(pause >= Duration::from_millis(4900), "{pause:?}");
    for one in &all {
        let header = |name: &str| one.headers[name].as_str();
        assert_eq!((header("webhook-id"), header("content-type")), (&*message.id, "application/json"));
        let key = STANDARD.decode(&SECRET[6..]).expect("base64");
        let mut mac = Hmac::<sha2::Sha256>::new_from_slice(&key).expect("a key");
        mac.update(format!("{}.{}.{}", message.id, header("webhook-timestamp"), one.body).as_bytes());
        assert_eq!(header("webhook-signature"), format!("v1,{}", STANDARD.encode(mac.finalize().into_bytes())));
        let body: serde_json::Value = serde_json::from_str(&one.body).expect("JSON");
        assert_eq!((&body["type"], &body["data"]["city"]), (&"job.cancelled".into(), &"delft".into()));
        assert!(body["timestamp"].as_str().expect("a time").ends_with('Z'));
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn redirects_are_not_followed_and_a_receiver_may_leave() {
    let (elsewhere, reached) = receiver(&[]);
    let answer: &'static str = Box::leak(format!("302 Found\r\nlocation: {elsewhere}").into_boxed_str());
    let (url, got) = receiver(Box::leak(Box::new([answer, "410 Gone"])));
    let (_folder, store) = told(&url).await;
    let message = send_until(&store, true, MessageState::Failed).await;
    assert_eq!((message.attempts, message.answer.as_deref()), (2, Some("410 Gone")));
    assert_eq!(got.try_iter().count(), 2);
    assert_eq!(reached.try_iter().count(), 0);
    assert!(!store.webhook("hook").await.expect("asks").expect("there").enabled);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn private_addresses_are_not_reached() {
    let (url, got) = receiver(&[]);
    let (_folder, store) = told(&url).await;
    let message = send_until(&store, false, MessageState::Failed).await;
    let answer = message.answer.expect("a reason");
    assert!(answer.contains("127.0.0.1 is not a public address") && !answer.contains("hidden"), "{answer}");
    // By a name: that may have another address tomorrow.
    let (_folder, store) = told(&url.replace("127.0.0.1", "localhost")).await;
    let (stop, stopped) = tokio::sync::watch::channel(false);
    let wait = async {
        let begin = Instant::now();
        loop {
            let message = store.webhook_messages("hook", 1).await.expect("lists").remove(0);
            if let Some(answer) = message.answer {
                stop.send_replace(true);
                return (message.state, answer);
            }
            assert!(begin.elapsed() < Duration::from_secs(20), "nothing was tried");
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    };
    let ((state, answer), sent) = tokio::join!(wait, gable_coordinator::deliver(&store, false, stopped));
    sent.expect("requests can be made");
    assert_eq!(state, MessageState::Waiting);
    assert!(answer.contains("localhost is not a public address") && !answer.contains("hidden"), "{answer}");
    assert_eq!(got.try_iter().count(), 0);
}
