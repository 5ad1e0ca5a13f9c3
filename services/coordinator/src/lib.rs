#![doc = include_str!("../README.md")]

mod api;
mod auth;
mod feed;
mod pages;
mod problem;
mod source;
mod state;
mod tile;

pub use api::{document, router};
pub use auth::{Caller, NewToken, create_token};
pub use feed::Feed;
pub use pages::{escaped, time};
pub use problem::Problem;
pub use source::{SourceError, resolve};
pub use state::{Coordinator, Limits};
