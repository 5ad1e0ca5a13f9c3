//! Benchmarks of the line segment detector.

fn main() {}
