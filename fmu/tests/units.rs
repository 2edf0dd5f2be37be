//! Units in other hands: FMPy (Dassault Systèmes, BSD) checks their descriptions and steps them,
//! `test_units.py` beside this file.
//!
//! Without the packages that it needs this test says so and passes; in continuous integration it
//! fails.

use std::path::Path;
use std::process::Command;
use std::{env, fs};

use grey_box::rig::Rig;
use host_sim::cli::fmu::{FmuArguments, KindArgument, StandardArgument};
use host_sim::closed_loop::{Course, HostController, control_task, run};
use host_sim::fmu::{Kind, Standard, pack};
use host_sim::motion::Motion;
use host_sim::plant::{Plant, PlantSettings, seen};
use xtask::packages::PYTHON;

const RIG: &str = include_str!("../../host-sim/rigs/paper.toml");

fn rig() -> Rig {
    Rig::parse(RIG, "paper.toml").expect("the paper's rig")
}

/// Where Cargo put this test and the library beside it.
fn library() -> Vec<u8> {
    let (before, after) = (env::consts::DLL_PREFIX, env::consts::DLL_SUFFIX);
    let test = env::current_exe().expect("this test");
    let path = test.with_file_name(format!("{before}pneuma_fmu{after}"));
    fs::read(path).expect("the library is built")
}

fn unit(standard: Standard, kind: Kind) -> Vec<u8> {
    pack(standard, kind, &rig(), &library()).expect("a unit")
}

/// Every tick of the host's own loop, as lines of numbers that read back to the bit: the
/// reference, what the converters show, the voltage that answers, the true position.
fn loop_of_the_host() -> String {
    let rig = rig();
    let motion = Motion::mixed();
    let settings = PlantSettings::at(motion.start_m(), 7);
    let mut plant = Plant::new(&rig, settings).expect("a plant");
    let mut controller = HostController::new(control_task(&rig).expect("a controller"));
    let course = Course {
        motion,
        ticks: 6_000,
    };
    let ran = run(&mut plant, &mut controller, &course).expect("a run");
    let mut text = String::new();
    for row in &ran.rows {
        let wish = row.sample.reference;
        let shown = seen(&row.sample.codes);
        let numbers = [
            f64::from(wish.position_m),
            f64::from(wish.velocity_m_per_s),
            f64::from(wish.acceleration_m_per_s2),
            shown.position_m,
            shown.pressure_a_pa,
            shown.pressure_b_pa,
            shown.supply_pressure_pa,
            shown.velocity_m_s,
            row.commanded_v(),
            row.truth.position_m,
        ];
        let words: Vec<String> = numbers.iter().map(|number| format!("{number:?}")).collect();
        text += &(words.join(" ") + "\n");
    }
    text
}

#[test]
fn val_units_are_valid_and_give_the_bytes_of_the_loop() {
    if let Err(failure) = PYTHON.need() {
        assert!(env::var_os("CI").is_none(), "{failure}");
        println!("SKIPPED: units in FMPy: {failure}");
        return;
    }
    let place = tempfile::tempdir().expect("a folder");
    for (version, standard) in [("2", Standard::Two), ("3", Standard::Three)] {
        for (name, kind) in Kind::ALL {
            let path = place.path().join(format!("{name}-{version}.fmu"));
            fs::write(path, unit(standard, kind)).expect("room");
        }
    }
    fs::write(place.path().join("loop.txt"), loop_of_the_host()).expect("room");
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let output = Command::new(PYTHON.python())
        .args(["-m", "unittest", "discover", "-s"])
        .arg(tests)
        .current_dir(place.path())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .output()
        .expect("Python runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    println!("{said}");
}

#[test]
fn prop_the_same_rig_gives_the_same_archive() {
    let [one, other] = [(); 2].map(|()| unit(Standard::Two, Kind::Plant));
    assert!(one == other);
}

#[test]
fn prop_what_is_no_library_is_refused() {
    let refused = pack(Standard::Two, Kind::Plant, &rig(), b"#!/bin/sh\n");
    let said = refused.expect_err("no library").to_string();
    assert!(said.contains("expected the library"), "{said}");
}

#[test]
fn prop_the_command_says_where_the_library_comes_from() {
    let place = tempfile::tempdir().expect("a folder");
    let rig = place.path().join("rig.toml");
    fs::write(&rig, RIG).expect("room");
    let mut arguments = FmuArguments {
        rig,
        kind: KindArgument::Observer,
        out: place.path().join("axis.fmu"),
        fmi: StandardArgument::Two,
        library: Some(place.path().join("libpneuma_fmu.so")),
    };
    let mut said = Vec::new();
    let refused = host_sim::cli::fmu::run(&arguments, &mut said).expect_err("no library");
    let line = refused.to_string();
    assert!(line.contains("cargo build --release -p fmu"), "{line}");

    fs::write(place.path().join("libpneuma_fmu.so"), library()).expect("room");
    host_sim::cli::fmu::run(&arguments, &mut said).expect("a unit");
    let said = String::from_utf8_lossy(&said);
    assert!(said.contains("axis.fmu: observer with "), "{said}");

    arguments.out = place.path().join("axis.zip");
    let refused = host_sim::cli::fmu::run(&arguments, &mut Vec::new());
    let line = refused.expect_err("another ending").to_string();
    assert!(line.contains("ends in .fmu"), "{line}");
}
