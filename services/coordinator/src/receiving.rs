//! Bodies that are being received: how many of an owner at a time, how many bytes, and how slowly they may come.

use crate::api::{no_room, too_large};
use crate::{Limits, Problem};
use axum::body::Body;
use axum::http::StatusCode;
use futures_util::StreamExt as _;
use gable_job_store::JobStoreError;
use std::collections::HashMap;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::io::AsyncWriteExt as _;
use tokio::time::Instant;

/// What is being received just now, by owner. Clones share it.
#[derive(Clone, Debug, Default)]
pub struct Receiving(Arc<Mutex<HashMap<String, UnderWay>>>);

#[derive(Clone, Copy, Debug, Default)]
struct UnderWay {
    bodies: i64,
    bytes: u64,
}

/// A body of an owner, counted until this is dropped: with what was made of it on the local disk.
#[derive(Debug)]
pub(crate) struct Incoming {
    all: Receiving,
    owner: String,
    bytes: u64,
}

impl Receiving {
    fn owners(&self) -> MutexGuard<'_, HashMap<String, UnderWay>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins to receive a body, if its owner sends not as many already as they may.
    pub(crate) fn begin(&self, owner: &str, most: i64) -> Result<Incoming, JobStoreError> {
        let mut owners = self.owners();
        let under_way = owners.entry(owner.to_owned()).or_default();
        if under_way.bodies >= most {
            return Err(JobStoreError::OpenUploads { owner: owner.to_owned(), most });
        }
        under_way.bodies += 1;
        Ok(Incoming { all: self.clone(), owner: owner.to_owned(), bytes: 0 })
    }
}

impl Incoming {
    /// Counts bytes that have come; gives all that the owner is sending.
    fn count(&mut self, bytes: u64) -> u64 {
        self.bytes += bytes;
        let mut owners = self.all.owners();
        let under_way = owners.entry(self.owner.clone()).or_default();
        under_way.bytes += bytes;
        under_way.bytes
    }
}

impl Drop for Incoming {
    fn drop(&mut self) {
        let mut owners = self.all.owners();
        if let Some(under_way) = owners.get_mut(&self.owner) {
            under_way.bodies -= 1;
            under_way.bytes -= self.bytes;
            if under_way.bodies == 0 {
                owners.remove(&self.owner);
            }
        }
    }
}

/// What a body may take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Allowed<'a> {
    pub(crate) limits: &'a Limits,
    /// Most bytes of the body.
    pub(crate) bytes: u64,
    /// What its owner may send besides what is here already: all bodies under way together.
    pub(crate) left: u64,
    /// What the body is.
    pub(crate) what: &'a str,
}

/// Writes a body to a file as it comes, as long as it comes, fast enough, and is not too large.
pub(crate) async fn store_body(
    body: Body,
    file: &Path,
    incoming: &mut Incoming,
    allowed: Allowed<'_>,
) -> Result<(), Problem> {
    let Allowed { limits, bytes: most, left: quota, what } = allowed;
    let mut out = tokio::fs::File::create(file).await.map_err(|e| no_room(&e))?;
    let mut pieces = body.into_data_stream();
    let end = Instant::now() + limits.upload_time;
    let (mut left, mut pace) = (most, Pace::new(limits));
    loop {
        let begun = Instant::now();
        let next = tokio::time::timeout_at((begun + pace.patience()).min(end), pieces.next()).await;
        if Instant::now() >= end {
            let detail = format!("a body may take {} s: send large files in parts", limits.upload_time.as_secs());
            return Err(Problem::new(StatusCode::REQUEST_TIMEOUT, "timeout", "The request took too long", detail));
        }
        // The time in which the service writes is not the client's.
        let came = next.as_ref().ok().and_then(Option::as_ref).and_then(|piece| piece.as_ref().ok());
        pace.note(begun.elapsed(), came.map_or(0, |piece| piece.len() as u64))?;
        let Ok(next) = next else { continue };
        let Some(piece) = next else { break };
        let piece = piece.map_err(|_| {
            Problem::new(StatusCode::BAD_REQUEST, "body", "The body cannot be read", "it was cut off: send it again")
        })?;
        let bytes = piece.len() as u64;
        left = left.checked_sub(bytes).ok_or_else(|| too_large(what, most))?;
        if incoming.count(bytes) > quota {
            return Err(JobStoreError::UploadBytes { owner: incoming.owner.clone(), most: limits.uploads }.into());
        }
        out.write_all(&piece).await.map_err(|e| no_room(&e))?;
    }
    out.flush().await.map_err(|e| no_room(&e))
}

/// How fast a body comes.
#[derive(Debug)]
struct Pace {
    window: Duration,
    least: u64,
    /// How long the service has waited in this window.
    waited: Duration,
    came: u64,
}

impl Pace {
    fn new(limits: &Limits) -> Self {
        Self { window: limits.upload_window, least: limits.upload_least, waited: Duration::ZERO, came: 0 }
    }

    /// How long may be waited until the window is over.
    fn patience(&self) -> Duration {
        self.window.saturating_sub(self.waited)
    }

    /// Notes what came after a time; an error if too little came within the window that ends with it.
    fn note(&mut self, waited: Duration, bytes: u64) -> Result<(), Problem> {
        self.waited += waited;
        self.came += bytes;
        if self.waited < self.window {
            return Ok(());
        }
        if self.came < self.least {
            let (came, seconds, least) = (self.came, self.window.as_secs_f64(), self.least);
            let detail = format!(
                "{came} bytes came within {seconds} s, and {least} have to: send it in smaller parts, over a faster line"
            );
            return Err(Problem::new(StatusCode::REQUEST_TIMEOUT, "timeout", "The request took too long", detail));
        }
        (self.waited, self.came) = (Duration::ZERO, 0);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_too_slowly_is_ended() {
        let limits = Limits { upload_window: Duration::from_secs(30), upload_least: 100, ..Limits::default() };
        let second = Duration::from_secs(1);
        let mut pace = Pace::new(&limits);
        for _ in 0..29 {
            pace.note(second, 10).expect("fast enough");
        }
        assert_eq!(pace.patience(), second);
        pace.note(second, 0).expect("the window had enough");
        for _ in 0..29 {
            pace.note(second, 1).expect("it is not over yet");
        }
        assert_eq!(pace.note(second, 1).expect_err("30 bytes in 30 s").status, 408);
    }

    #[test]
    fn an_owner_sends_so_much_at_a_time() {
        let all = Receiving::default();
        let mut first = all.begin("ann", 2).expect("the first");
        let mut second = all.begin("ann", 2).expect("the second");
        assert!(matches!(all.begin("ann", 2), Err(JobStoreError::OpenUploads { most: 2, .. })));
        all.begin("bob", 2).expect("of another");
        assert_eq!((first.count(10), second.count(5), first.count(1)), (10, 15, 16));
        drop(first);
        assert_eq!(second.count(1), 6);
        drop(second);
        assert!(all.owners().is_empty());
    }
}
