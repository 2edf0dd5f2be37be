//! Tells the linker the chosen board's memory layout, and nothing where no board
//! is chosen.

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if env::var_os("CARGO_FEATURE_CHIP").is_none() {
        return;
    }
    let root = env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    let script = if env::var_os("CARGO_FEATURE_MPS2").is_some() {
        let script = format!("{root}/src/board/mps2/link.x");
        println!("cargo::rerun-if-changed={script}");
        script
    } else {
        // The start-up code's script, which includes `memory.x` from the root of
        // the workspace: cargo runs the linker there.
        println!("cargo::rerun-if-changed=../memory.x");
        "link.x".to_owned()
    };
    println!("cargo::rustc-link-arg-bins=-T{script}");
    if env::var_os("CARGO_FEATURE_STM32F405").is_some() {
        // The log's strings, which stay in the file.
        println!("cargo::rustc-link-arg-bins=-Tdefmt.x");
    }
    // Else the sections are aligned to pages, at the cost of flash.
    println!("cargo::rustc-link-arg-bins=--nmagic");
}
