//! The parts of an upload: cut, hashed, and sent unless the service has them already.

use crate::progress::Progress;
use crate::remote::{Remote, RemoteError};
use anyhow::anyhow;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use gable_coordinator::escaped;
use serde_json::{Value, json};
use sha2::{Digest as _, Sha256};
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::time::{Duration, Instant};

/// Most parts that an upload may have.
const PARTS: u64 = 10_000;

/// How long a service that does not answer is waited for.
const OUTAGE: Duration = Duration::from_secs(300);

/// The pause before it is asked again.
const PAUSE: Duration = Duration::from_secs(2);

/// What the progress calls the work.
const LABEL: &str = "sending";

/// Takes the bytes of a file, and sends them in parts.
pub(super) struct PartSender<'a> {
    remote: &'a Remote,
    id: String,
    /// Bytes of a part.
    size: usize,
    /// What the service has: hashes by number.
    known: BTreeMap<u64, String>,
    /// Hashes of the parts so far.
    done: Vec<String>,
    part: Vec<u8>,
    /// How many of the parts were there already.
    there: usize,
    /// Why a part could not be sent: an error of writing could not tell it.
    failure: Option<anyhow::Error>,
    progress: Progress,
}

impl<'a> PartSender<'a> {
    /// Begins an upload, or goes on with one of the same name that was cut off.
    pub(super) fn open(remote: &'a Remote, name: &str, city: &str, bytes: u64, quiet: bool) -> anyhow::Result<Self> {
        let before = patiently(|| remote.get("/open-uploads"))?;
        let same = before
            .as_array()
            .into_iter()
            .flatten()
            .find(|u| u["name"] == name && u["city"] == city && u["state"] == "open");
        let open = match same {
            Some(before) => patiently(|| remote.get(&place(before["id"].as_str().unwrap_or_default())))?,
            None => patiently(|| remote.post("/open-uploads", &[], Some(&json!({ "name": name, "city": city }))))?,
        };
        let number = |member: &str| {
            open[member].as_u64().filter(|n| *n > 0).ok_or_else(|| anyhow!("the service does not say its {member}"))
        };
        // An archive may be somewhat larger than the files in it.
        let wanted = number("part_bytes")?.max((bytes + bytes / 10).div_ceil(PARTS));
        let size = wanted.min(number("largest_part_bytes")?);
        let listed = open["parts"].as_array().into_iter().flatten();
        let known = listed.filter_map(|p| Some((p["number"].as_u64()?, p["sha256"].as_str()?.to_owned()))).collect();
        let id =
            open["id"].as_str().ok_or_else(|| anyhow!("the service does not say the id of the upload"))?.to_owned();
        let progress = Progress::new(quiet);
        progress.begin(LABEL, usize::try_from(bytes.div_ceil(size)).unwrap_or(usize::MAX).max(1));
        let (size, part) = (usize::try_from(size)?, Vec::new());
        Ok(Self { remote, id, size, known, done: Vec::new(), part, there: 0, failure: None, progress })
    }

    /// Sends the part that is complete.
    fn send(&mut self) -> anyhow::Result<()> {
        let hash = Sha256::digest(&self.part);
        let hex: String = hash.iter().map(|byte| format!("{byte:02x}")).collect();
        let number = self.done.len() as u64 + 1;
        if self.known.get(&number) == Some(&hex) {
            self.there += 1;
        } else {
            let digest = format!("sha-256=:{}:", STANDARD.encode(hash));
            let path = format!("{}/parts/{number}", place(&self.id));
            patiently(|| self.remote.put_bytes(&path, &[("content-digest", &digest)], &self.part))?;
        }
        self.done.push(hex);
        self.part.clear();
        self.progress.step(LABEL, "");
        Ok(())
    }

    /// The error behind one of writing.
    pub(super) fn explain(&mut self, error: anyhow::Error) -> anyhow::Error {
        self.failure.take().unwrap_or(error)
    }

    /// Sends what is left, and has the parts put together; gives what a job names as its source.
    pub(super) fn complete(mut self) -> anyhow::Result<String> {
        if !self.part.is_empty() {
            self.send()?;
        }
        self.progress.finish();
        if self.there > 0 {
            tracing::info!(parts = self.there, "were there from an earlier attempt");
        }
        let named: Vec<Value> =
            self.done.iter().enumerate().map(|(i, hash)| json!({ "number": i + 1, "sha256": hash })).collect();
        let list = json!({ "parts": named });
        let path = format!("{}/complete", place(&self.id));
        loop {
            let answer = patiently(|| self.remote.post(&path, &[], Some(&list)))?;
            if let Some(source) = answer["source"].as_str() {
                return Ok(source.to_owned());
            }
            std::thread::sleep(PAUSE);
        }
    }
}

/// The address of an upload in parts.
fn place(id: &str) -> String {
    format!("/open-uploads/{}", escaped(id))
}

/// Asks again while the service does not answer, for as long as that is worth while.
fn patiently(ask: impl Fn() -> Result<Value, RemoteError>) -> Result<Value, RemoteError> {
    let begin = Instant::now();
    loop {
        match ask() {
            Err(e) if e.is_transient() && begin.elapsed() < OUTAGE => {
                tracing::warn!("{e}");
                std::thread::sleep(PAUSE);
            }
            result => return result,
        }
    }
}

impl Write for PartSender<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.part.len() == self.size {
            self.send().map_err(|e| {
                self.failure = Some(e);
                io::Error::other("a part cannot be sent")
            })?;
        }
        let taken = bytes.len().min(self.size - self.part.len());
        self.part.extend_from_slice(&bytes[..taken]);
        Ok(taken)
    }

    /// Nothing: a part is sent when it is full, or is the last one.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
