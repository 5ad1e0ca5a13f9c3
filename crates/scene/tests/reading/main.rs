//! Reading scenes, from files to triangles.

mod budgets;
mod damage;
mod files;
mod formats;
mod messages;
mod odd_text;
mod oracle;
mod places;
mod robustness;
mod textures;
mod tiles;
mod town;
