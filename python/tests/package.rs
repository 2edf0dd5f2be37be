//! The Python package, tested by Python: `test_pneuma.py` beside this file.
//!
//! Without the packages that it needs this test says so and passes; in continuous integration it
//! fails.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use xtask::packages::PYTHON;

/// Where Cargo put this test and the extension module beside it; above it the program.
fn built() -> PathBuf {
    let test = env::current_exe().expect("this test");
    test.parent().expect("its folder").to_path_buf()
}

#[test]
fn val_python_does_what_the_program_does() {
    if let Err(failure) = PYTHON.need() {
        assert!(env::var_os("CI").is_none(), "{failure}");
        println!("SKIPPED: the Python package: {failure}");
        return;
    }
    let source = Path::new(env!("CARGO_MANIFEST_DIR"));
    let place = tempfile::tempdir().expect("a folder");
    let package = place.path().join("pneuma");
    fs::create_dir(&package).expect("room");
    fs::copy(
        source.join("pneuma/__init__.py"),
        package.join("__init__.py"),
    )
    .expect("room");
    let module = format!(
        "{}_pneuma{}",
        env::consts::DLL_PREFIX,
        env::consts::DLL_SUFFIX
    );
    fs::copy(built().join(module), package.join("_pneuma.abi3.so")).expect("the module is built");
    let program = built().join(format!("../pneuma{}", env::consts::EXE_SUFFIX));
    assert!(program.is_file(), "build it: cargo build -p host-sim");
    let output = Command::new(PYTHON.python())
        .args(["-m", "unittest", "discover", "-s"])
        .arg(source.join("tests"))
        .current_dir(place.path())
        .env("PYTHONPATH", place.path())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("PNEUMA_PROGRAM", program)
        .output()
        .expect("Python runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    println!("{said}");
}
