//! Packages of Python that tests need, each set in a folder of its own below `target`.

use crate::shell::{self, Failure, Outcome, command};
use std::path::PathBuf;

/// A set of packages.
pub struct Packages {
    /// What they are called, and their folder below `target`.
    pub name: &'static str,
    /// Their list, below the root of the project.
    pub requirements: &'static str,
    /// What has to be importable.
    pub imports: &'static str,
    /// Who does without them, and what they are.
    pub advice: &'static str,
}

/// The emulator's.
pub const EMULATOR: Packages = Packages {
    name: "emulator",
    requirements: "tests/emulator/requirements.txt",
    imports: "unicorn",
    advice: "the emulator, which runs the board's image for `cargo xtask emulate` and its tests, \
             needs python3 with venv (Debian: python3-venv) and, with a network, the package \
             `unicorn` from PyPI. Everything else works without it.",
};

/// Those that the tests of the Python package and of the units work with.
pub const PYTHON: Packages = Packages {
    name: "python",
    requirements: "python/tests/requirements.txt",
    imports: "fmpy, numpy, pandas",
    advice: "the tests of the Python package and of the units need python3 with venv (Debian: python3-venv) and, with a \
             network, `fmpy`, `numpy` and `pandas` from PyPI. Everything else works without them.",
};

impl Packages {
    fn folder(&self) -> PathBuf {
        shell::target_directory().join(self.name)
    }

    /// The Python that has them.
    pub fn python(&self) -> PathBuf {
        self.folder().join("bin/python")
    }

    /// Whether they can be imported.
    pub fn are_there(&self) -> bool {
        let import = format!("import {}", self.imports);
        shell::succeeds(&mut command(self.python(), &["-c", &import]))
    }

    /// They are there, or are installed.
    ///
    /// # Errors
    /// Where Python or a package is missing and cannot be had.
    pub fn need(&self) -> Outcome {
        if self.are_there() {
            return Ok(());
        }
        self.install()
            .map_err(|failure| Failure::from(format!("{failure}\n{}", self.advice)))
    }

    fn install(&self) -> Outcome {
        let place = self.folder();
        println!("setup: {}: packages into {}", self.name, place.display());
        let mut venv = command("python3", &["-m", "venv"]);
        shell::run(venv.arg(&place))?;
        let mut packages = command(self.python(), &["-m", "pip", "install", "--quiet", "-r"]);
        shell::run(packages.arg(shell::root().join(self.requirements)))
    }
}
