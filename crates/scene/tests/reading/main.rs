//! Reading scenes, from files to triangles.

mod formats;
mod messages;
mod oracle;
mod robustness;
mod town;
