//! The task `dist`: archives of the program for people who do not compile it.
//!
//! An archive holds the program, the library of its units, licences and documents; beside all of
//! them lies `SHA256SUMS`. The same commit and toolchain give the same bytes of the archive.

use crate::apt;
use crate::shell::{self, Outcome, cargo, command, output_of};
use std::fs;
use std::path::{Path, PathBuf};

/// A machine that archives are made for.
struct Machine {
    target: &'static str,
    /// The compiler of C that links for it, and Debian's package of it; none for this machine.
    linker: Option<(&'static str, &'static str)>,
}

const MACHINES: [Machine; 2] = [
    Machine {
        target: "x86_64-unknown-linux-gnu",
        linker: None,
    },
    Machine {
        target: "aarch64-unknown-linux-gnu",
        linker: Some((
            "aarch64-linux-gnu-gcc",
            "gcc-aarch64-linux-gnu libc6-dev-arm64-cross",
        )),
    },
];
/// What lies beside the program.
const BESIDE: [&str; 6] = [
    "README.md",
    "CHANGELOG.md",
    "LICENSE-APACHE",
    "LICENSE-MIT",
    "NOTICE",
    "docs",
];
/// What is built.
const BUILT: [&str; 2] = ["pneuma", "libpneuma_fmu.so"];

/// The task: all machines, or those named.
pub fn run(targets: &[String]) -> Outcome {
    let known: Vec<&str> = MACHINES.iter().map(|machine| machine.target).collect();
    if let Some(unknown) = targets.iter().find(|one| !known.contains(&one.as_str())) {
        let known = known.join(", ");
        return Err(format!("dist: unknown target {unknown}, expected some of {known}").into());
    }
    let place = shell::root().join("out/dist");
    fs::create_dir_all(&place).map_err(|error| format!("{}: {error}", place.display()))?;
    let is_asked =
        |machine: &&Machine| targets.is_empty() || targets.iter().any(|one| one == machine.target);
    let mut archives = Vec::new();
    for machine in MACHINES.iter().filter(is_asked) {
        archives.push(archive(machine, &place)?);
    }
    let mut sums = command("sha256sum", &[]);
    sums.args(&archives).current_dir(&place);
    let sums = output_of(&mut sums).ok_or("dist: sha256sum failed")?;
    fs::write(place.join("SHA256SUMS"), sums.clone() + "\n").map_err(|error| error.to_string())?;
    println!("{sums}\ndist: {}", place.display());
    Ok(())
}

/// Builds for a machine and packs; the name of the archive.
fn archive(machine: &Machine, place: &Path) -> Outcome<String> {
    let target = machine.target;
    prepare(machine)?;
    let mut build = cargo(&[
        "build",
        "--release",
        "--locked",
        "-p",
        "host-sim",
        "-p",
        "fmu",
    ]);
    build.args(["--target", target]);
    if let Some((linker, _)) = machine.linker {
        let upper = target.to_uppercase().replace('-', "_");
        let lower = target.replace('-', "_");
        build.env(format!("CARGO_TARGET_{upper}_LINKER"), linker);
        build.env(format!("CC_{lower}"), linker);
    }
    // What runs elsewhere needs no lines of the source.
    build.env("CARGO_PROFILE_RELEASE_DEBUG", "0");
    build.env("CARGO_PROFILE_RELEASE_STRIP", "symbols");
    shell::run(&mut build)?;

    let name = format!("pneuma-{}-{target}", env!("CARGO_PKG_VERSION"));
    let folder = place.join(&name);
    if folder.exists() {
        fs::remove_dir_all(&folder).map_err(|error| error.to_string())?;
    }
    fs::create_dir(&folder).map_err(|error| error.to_string())?;
    let release = shell::target_directory().join(target).join("release");
    let built = BUILT.iter().map(|file| release.join(file));
    let beside = BESIDE.iter().map(|file| shell::root().join(file));
    let files: Vec<PathBuf> = built.chain(beside).collect();
    shell::run(
        command("cp", &["--recursive", "--target-directory"])
            .arg(&folder)
            .args(&files),
    )?;
    let packed = format!("{name}.tar.gz");
    let mut tar = command(
        "tar",
        &["--sort=name", "--mtime=@0", "--owner=0", "--group=0"],
    );
    tar.args(["--numeric-owner", "--create", "--file"])
        .arg(&packed);
    tar.args(["--use-compress-program", "gzip --no-name", &name]);
    shell::run(tar.current_dir(place))?;
    Ok(packed)
}

/// The standard library for a machine, and what links for it.
fn prepare(machine: &Machine) -> Outcome {
    let Some((linker, packages)) = machine.linker else {
        return Ok(());
    };
    if !shell::succeeds(&mut command(linker, &["--version"])) {
        let packages: Vec<&str> = packages.split(' ').collect();
        if !apt::install(&packages, &[]) {
            return Err(format!(
                "dist: {linker} is missing: {}",
                apt::install_line(&packages)
            )
            .into());
        }
    }
    shell::run(&mut command("rustup", &["target", "add", machine.target]))
}
