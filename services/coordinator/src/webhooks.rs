//! Sends what is waiting in the outbox to its receivers, signed as Standard Webhooks has it
//! (<https://www.standardwebhooks.com>): `webhook-id`, `webhook-timestamp`, and `webhook-signature` with `v1,` and the HMAC-SHA256 of
//! id, timestamp and body, joined by dots, in base64. Callbacks of jobs are in the outbox as well; they have the form of OGC API –
//! Processes, and nobody to sign for.

use crate::pages::time;
use crate::{ogc, outbound};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use gable_job_store::{JobStoreError, Sent, Store, Webhook, WebhookMessage};
use hmac::{Hmac, KeyInit as _, Mac as _};
use reqwest::StatusCode;
use std::time::{Duration, SystemTime};
use tokio::sync::watch;
use tokio::task::JoinSet;

/// What stands before the key in a secret.
const PREFIX: &str = "whsec_";

/// How often the outbox is looked at.
const PACE: Duration = Duration::from_millis(500);

/// Messages on their way at a time, so that a slow receiver does not keep others waiting.
const AT_ONCE: usize = 32;

/// Longest time from taking a message to saying what became of it; longer than a request can take.
const LEASE: Duration = Duration::from_secs(60);

/// Pauses after attempts that came to nothing, seconds: two days in all.
const PAUSES: [u64; 9] = [5, 30, 120, 600, 1800, 3600, 3 * 3600, 12 * 3600, 24 * 3600];

/// How long messages are remembered after they were delivered or given up.
const REMEMBER: Duration = Duration::from_secs(30 * 24 * 3600);

/// A new secret.
pub(crate) fn new_secret() -> Result<String, getrandom::Error> {
    let mut key = [0_u8; 32];
    getrandom::fill(&mut key)?;
    Ok(format!("{PREFIX}{}", BASE64.encode(key)))
}

/// The key of a secret; none if it is no secret of 24 to 64 bytes.
pub(crate) fn key(secret: &str) -> Option<Vec<u8>> {
    let key = BASE64.decode(secret.strip_prefix(PREFIX)?).ok()?;
    (24..=64).contains(&key.len()).then_some(key)
}

fn signature(key: &[u8], id: &str, timestamp: u64, body: &str) -> Option<String> {
    let mut mac = Hmac::<sha2::Sha256>::new_from_slice(key).ok()?;
    mac.update(format!("{id}.{timestamp}.{body}").as_bytes());
    Some(format!("v1,{}", BASE64.encode(mac.finalize().into_bytes())))
}

/// Sends what is waiting, until `stop` becomes true. `private`: also to addresses that are not public.
///
/// # Errors
/// If no request can be made at all: the system has no certificates.
pub async fn deliver(store: &Store, private: bool, mut stop: watch::Receiver<bool>) -> Result<(), reqwest::Error> {
    let client = outbound::client(private)?;
    let mut sending = JoinSet::new();
    let mut tidy = tokio::time::interval(Duration::from_secs(3600));
    loop {
        tokio::select! {
            () = tokio::time::sleep(PACE) => {}
            _ = tidy.tick() => {
                if let Err(e) = store.forget_messages(REMEMBER).await {
                    tracing::warn!("old messages cannot be forgotten: {e}");
                }
            }
            _ = stop.wait_for(|&s| s) => break,
        }
        while sending.try_join_next().is_some() {}
        while sending.len() < AT_ONCE {
            match store.take_message(LEASE).await {
                Ok(Some((webhook, message))) => {
                    let (store, client) = (store.clone(), client.clone());
                    sending.spawn(async move {
                        let sent = send(&store, &client, private, &webhook, &message).await;
                        if let Err(e) = note(&store, &webhook, &message, &sent).await {
                            tracing::warn!(message = message.id, "what became of a message is not noted: {e}");
                        }
                    });
                }
                Ok(None) => break,
                Err(e) => {
                    tracing::warn!("messages cannot be had: {e}");
                    break;
                }
            }
        }
    }
    // What is on its way has a time limit.
    while sending.join_next().await.is_some() {}
    Ok(())
}

async fn note(store: &Store, webhook: &Webhook, message: &WebhookMessage, sent: &Sent) -> Result<(), JobStoreError> {
    let (id, attempt) = (&message.id, message.attempts);
    match sent {
        Sent::Delivered(_) => tracing::debug!(webhook = webhook.id, message = id, attempt, "delivered"),
        Sent::Again(answer, pause) => {
            tracing::info!(webhook = webhook.id, message = id, attempt, "not delivered, again in {pause:?}: {answer}");
        }
        Sent::GivenUp(answer) | Sent::Gone(answer) => {
            tracing::warn!(webhook = webhook.id, message = id, attempt, "given up: {answer}");
        }
    }
    store.message_sent(webhook, message, sent).await
}

async fn send(
    store: &Store,
    client: &reqwest::Client,
    private: bool,
    webhook: &Webhook,
    message: &WebhookMessage,
) -> Sent {
    let again = |answer: String| match usize::try_from(message.attempts - 1).ok().and_then(|n| PAUSES.get(n)) {
        Some(pause) => Sent::Again(answer, Duration::from_secs(*pause)),
        None => Sent::GivenUp(answer),
    };
    let url = match outbound::checked(&webhook.url, private) {
        Ok(url) => url,
        Err(e) => return Sent::GivenUp(e.to_string()),
    };
    let mut request = client.post(url).header("content-type", "application/json").header("webhook-id", &message.id);
    let body = match &webhook.callback {
        Some(about) => match ogc::callback(store, about, message.event).await {
            Ok(Some(body)) => body.to_string(),
            Ok(None) => return Sent::GivenUp("the job was over before".to_owned()),
            Err(e) => {
                tracing::warn!(message = message.id, "what a subscriber is to be told cannot be had: {e}");
                return again("the database does not answer".to_owned());
            }
        },
        None => {
            let (event, at) = (serde_json::Value::from(message.event.name()), time(message.created));
            let body = format!(r#"{{"type":{event},"timestamp":"{at}","data":{}}}"#, message.data);
            let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_secs();
            let Some(signature) = key(&webhook.secret).and_then(|k| signature(&k, &message.id, now, &body)) else {
                return Sent::GivenUp("its secret cannot be read".to_owned());
            };
            request = request.header("webhook-timestamp", now).header("webhook-signature", signature);
            body
        }
    };
    let request = request.body(body);
    match request.send().await {
        Ok(answer) if answer.status().is_success() => Sent::Delivered(answer.status().to_string()),
        Ok(answer) if answer.status() == StatusCode::GONE => Sent::Gone(answer.status().to_string()),
        Ok(answer) => again(answer.status().to_string()),
        // Without the address, which may hold a key of the receiver.
        Err(e) => again(causes(&e.without_url())),
    }
}

/// An error with what is behind it.
fn causes(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut next = error.source();
    while let Some(cause) = next {
        text += &format!(": {cause}");
        next = cause.source();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_signed_as_the_standard_says() {
        // The example of the standard's own libraries.
        let key = key("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw").expect("a secret");
        let signed = signature(&key, "msg_p5jXN8AQM9LWM0D4loKWxJek", 1_614_265_330, r#"{"test": 2432232314}"#);
        assert_eq!(signed.as_deref(), Some("v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE="));
    }

    #[test]
    fn secrets_are_long_enough() {
        let made = new_secret().expect("random bytes");
        assert_eq!(super::key(&made).map(|k| k.len()), Some(32));
        assert_ne!(made, new_secret().expect("random bytes"));
        for wrong in ["", "whsec_", "whsec_c2hvcnQ=", "MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw", "whsec_!"] {
            assert_eq!(super::key(wrong), None, "{wrong}");
        }
    }
}
