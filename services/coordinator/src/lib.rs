#![doc = include_str!("../README.md")]

mod access;
mod api;
mod audit;
mod auth;
mod cron;
mod extract;
mod feed;
mod listen;
mod ogc;
mod outbound;
mod pages;
mod problem;
mod rights;
mod scheduler;
mod shared;
mod state;
mod tile;
mod unpack;
mod webhooks;

pub use api::{FOR_THE_VIEWER, document, router};
pub use audit::{Gathered, keep_audit};
pub use auth::{Caller, NewToken, create_first_token, create_token, rotate_token};
pub use feed::Feed;
pub use listen::{Patience, serve};
pub use pages::{escaped, time};
pub use problem::Problem;
pub use scheduler::tick;
pub use state::{Answers, Coordinator, Limits};
pub use webhooks::deliver;
