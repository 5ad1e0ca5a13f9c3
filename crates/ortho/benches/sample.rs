//! Benchmarks of sampling.

fn main() {}
