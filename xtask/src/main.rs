//! `cargo xtask`: what CI does, runnable by anyone.

fn main() {}
