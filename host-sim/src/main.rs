//! The `pneuma` program.

fn main() {}
