//! Splitting scenes: what reaches which block, in which order, whatever the grid and the threads.

mod defects;
mod outliers;
mod properties;
mod real;
mod scenes;
