//! Packages of Debian's, as root or with a sudo that asks nothing.

use crate::shell::{self, command};
use std::process::Command;

/// What somebody would type to install packages.
pub fn install_line(packages: &[&str]) -> String {
    format!(
        "apt-get install --no-install-recommends {}",
        packages.join(" ")
    )
}

/// Installs packages; says why not.
pub fn install(packages: &[&str], options: &[&str]) -> bool {
    println!("setup: installing {}", packages.join(", "));
    let mut install = vec!["install", "--yes", "--no-install-recommends"];
    install.extend(options);
    install.extend(packages);
    apt(&install) || (apt(&["update"]) && apt(&install))
}

fn apt(arguments: &[&str]) -> bool {
    let quietness = if shell::is_watched() {
        "--quiet=0"
    } else {
        "-qq"
    };
    let mut words = vec!["apt-get", quietness];
    words.extend(arguments);
    let mut apt = if is_root() {
        command("env", &words)
    } else {
        sudo(&words)
    };
    let outcome = shell::run(apt.env("DEBIAN_FRONTEND", "noninteractive"));
    if let Err(failure) = &outcome {
        println!("setup: {failure}");
    }
    outcome.is_ok()
}

fn is_root() -> bool {
    shell::output_of(&mut command("id", &["-u"])).as_deref() == Some("0")
}

/// Never asks for a password: a task in CI would wait for ever.
fn sudo(words: &[&str]) -> Command {
    let mut sudo = command("sudo", &["--non-interactive"]);
    sudo.args(words);
    sudo
}
