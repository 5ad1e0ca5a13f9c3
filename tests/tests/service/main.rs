//! The service of real processes, on both databases. In one program, so that the servers that it stands on are started once.
#![cfg(unix)]

mod client;
mod failures;
mod front;
mod hostile;
mod jobs;
mod nodes;
mod readme;
mod refresh;
mod secrets;
mod sending;
mod sources;
mod standards;
mod telling;
mod tokens;
mod traces;
mod upgrade;
