#![doc = include_str!("../README.md")]

mod access;
mod api;
mod auth;
mod cron;
mod extract;
mod feed;
mod listen;
mod ogc;
mod outbound;
mod pages;
mod problem;
mod scheduler;
mod shared;
mod state;
mod tile;
mod unpack;
mod webhooks;

pub use api::{FOR_THE_VIEWER, document, router};
pub use auth::{Caller, NewToken, create_first_token, create_token};
pub use feed::Feed;
pub use listen::{Patience, serve};
pub use pages::{escaped, time};
pub use problem::Problem;
pub use scheduler::tick;
pub use state::{Answers, Coordinator, Limits};
pub use webhooks::deliver;
