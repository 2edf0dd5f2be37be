//! Building for the microcontroller, with or without rustup.
//!
//! The usual way is a toolchain that brings `core` for the target. Where rustup
//! cannot fetch it, Debian's compiler builds `core` from Debian's sources:
//! `-Zbuild-std` with `RUSTC_BOOTSTRAP=1`, because a stable compiler otherwise
//! refuses it. Checked with rustc-web 1.96.0 on Debian 12. The first such build
//! lets cargo fetch the dependencies of the standard library (a few small crates).

use crate::apt;
use crate::shell::{self, command};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Cortex-M4F with the hardware floating point calling convention.
pub const TARGET: &str = "thumbv7em-none-eabihf";
/// Debian's compiler, its cargo, and the sources of the standard library.
const DEBIAN_PACKAGES: [&str; 3] = ["rustc-web", "cargo-web", "rust-web-src"];
/// Set to `debian`, this skips the toolchain: to try the fallback.
const FORCE: &str = "PNEUMA_CHIP";

/// How `core` for the microcontroller can be had.
#[derive(Clone, Debug, PartialEq)]
pub enum CoreForChip {
    /// The toolchain brings it.
    Toolchain,
    /// Debian's compiler builds it.
    Debian {
        /// Debian's cargo.
        cargo: PathBuf,
        /// Debian's compiler.
        rustc: PathBuf,
    },
}

impl CoreForChip {
    /// A command of cargo for the target, `arguments` without `--target`.
    pub fn cargo(&self, arguments: &[&str]) -> Command {
        match self {
            Self::Toolchain => {
                let mut cargo = shell::cargo(arguments);
                cargo.args(["--target", TARGET]);
                cargo
            }
            Self::Debian { cargo, rustc } => debian_cargo(cargo, rustc, arguments),
        }
    }
}

fn debian_cargo(cargo: &Path, rustc: &Path, arguments: &[&str]) -> Command {
    let mut cargo = command(cargo, arguments);
    cargo
        .args(["--target", TARGET, "-Zbuild-std=core"])
        .env("RUSTC", rustc)
        .env("RUSTC_BOOTSTRAP", "1")
        // Set by the cargo that started us, and meant for its own compiler.
        .env_remove("LD_LIBRARY_PATH")
        .env_remove("CARGO");
    if !arguments.contains(&"--target-dir") {
        // A directory of its own: two compilers in one would rebuild each other's work.
        let directory = shell::target_directory().join("debian");
        cargo.arg("--target-dir").arg(directory);
    }
    if let Some(linker) = find_linker() {
        cargo.env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", linker);
    }
    cargo
}

/// A linker for images: Debian's compiler comes without rust-lld. Libraries need none.
fn find_linker() -> Option<PathBuf> {
    let beside_toolchain = || {
        let host_library = rustc(&["--print", "target-libdir"])?;
        let linker = Path::new(&host_library).parent()?.join("bin/rust-lld");
        linker.is_file().then_some(linker)
    };
    let of_system = || PathBuf::from("/usr/bin/ld.lld").canonicalize().ok();
    beside_toolchain().or_else(of_system)
}

fn rustc(arguments: &[&str]) -> Option<String> {
    shell::output_of(&mut command("rustc", arguments))
}

/// Whether the toolchain in use brings `core` for the target.
pub fn toolchain_has_core() -> bool {
    let directory = rustc(&["--print", "target-libdir", "--target", TARGET]);
    let holds_core = |directory: &str| {
        let Ok(mut entries) = std::fs::read_dir(directory) else {
            return false;
        };
        entries.any(|entry| {
            entry.is_ok_and(|entry| entry.file_name().to_string_lossy().starts_with("libcore-"))
        })
    };
    directory.is_some_and(|directory| holds_core(&directory))
}

/// Whether the fallback was asked for.
pub fn is_fallback_forced() -> bool {
    std::env::var_os(FORCE).is_some_and(|value| value == "debian")
}

/// What somebody would type to install the fallback.
pub fn debian_install_line() -> String {
    apt::install_line(&DEBIAN_PACKAGES)
}

/// Debian's packages, if all are installed and the compiler is new enough.
pub fn find_debian() -> Option<CoreForChip> {
    listed_file("rust-web-src", "/library/core/src/lib.rs")?;
    let cargo = listed_file("cargo-web", "/usr/bin/cargo")?;
    let rustc = listed_file("rustc-web", "/usr/bin/rustc")?;
    let version = shell::output_of(command(&rustc, &["--version"]).env_remove("LD_LIBRARY_PATH"))?;
    if is_new_enough(&version, env!("CARGO_PKG_RUST_VERSION")) {
        return Some(CoreForChip::Debian { cargo, rustc });
    }
    println!("setup: Debian's {version} is older than the workspace asks for");
    None
}

/// Compare `rustc 1.96.0 (…)` with `1.95`.
fn is_new_enough(version: &str, least: &str) -> bool {
    let number = |text: &str| {
        let mut parts = text.split('.').map(|part| part.parse::<u32>().ok());
        Some((parts.next()??, parts.next()??))
    };
    let found = version.split_whitespace().nth(1).and_then(number);
    found.is_some() && found >= number(least)
}

/// The file of an installed package whose path ends so.
fn listed_file(package: &str, ending: &str) -> Option<PathBuf> {
    let listing = shell::output_of(&mut command("dpkg", &["-L", package]))?;
    first_ending(&listing, ending).filter(|path| path.is_file())
}

fn first_ending(listing: &str, ending: &str) -> Option<PathBuf> {
    listing
        .lines()
        .find(|line| line.ends_with(ending))
        .map(PathBuf::from)
}

/// Install Debian's packages.
///
/// `--no-remove`: these packages exclude others of Debian, which are not ours to remove.
pub fn install_debian() -> Option<CoreForChip> {
    apt::install(&DEBIAN_PACKAGES, &["--no-remove"]);
    find_debian()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_in_a_package_listing() {
        let listing = "/.\n/usr/share/cargo/bin/cargo\n/usr/bin\n/usr/bin/cargo\n";
        assert_eq!(
            first_ending(listing, "/usr/bin/cargo"),
            Some("/usr/bin/cargo".into())
        );
        assert_eq!(first_ending(listing, "/usr/bin/rustc"), None);
    }

    #[test]
    fn versions_are_compared_as_numbers() {
        assert!(is_new_enough("rustc 1.96.0 (ac68faa20 2026-05-25)", "1.95"));
        assert!(is_new_enough("rustc 1.95.0", "1.95"));
        assert!(is_new_enough("rustc 1.100.1", "1.95"));
        assert!(!is_new_enough("rustc 1.85.0", "1.95"));
        assert!(!is_new_enough("no version", "1.95"));
    }

    #[test]
    fn debians_cargo_builds_core_itself() {
        let debian = CoreForChip::Debian {
            cargo: "/d/cargo".into(),
            rustc: "/d/rustc".into(),
        };
        let typed = shell::as_typed(&debian.cargo(&["build", "-p", "model-core"]));
        assert!(
            typed.contains("RUSTC=/d/rustc RUSTC_BOOTSTRAP=1"),
            "{typed}"
        );
        assert!(
            typed.contains("/d/cargo build -p model-core --target thumbv7em"),
            "{typed}"
        );
        assert!(typed.contains("-Zbuild-std=core"), "{typed}");
    }

    #[test]
    fn the_toolchain_needs_only_the_target() {
        let typed = shell::as_typed(&CoreForChip::Toolchain.cargo(&["build"]));
        assert_eq!(typed, "cargo build --target thumbv7em-none-eabihf");
    }
}
