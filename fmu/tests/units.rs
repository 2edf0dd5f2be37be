//! Units in other hands: FMPy (Dassault Systèmes, BSD) checks their descriptions and steps them,
//! `test_units.py` beside this file.
//!
//! Without the packages that it needs this test says so and passes; in continuous integration it
//! fails.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use std::{env, fs};

use firmware::codes::DacCode;
use grey_box::rig::Rig;
use host_sim::cli::fmu::{FmuArguments, KindArgument, StandardArgument};
use host_sim::closed_loop::{
    Course, Driven, ForeignPlant, HostController, Told, control_task, run,
};
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

/// The plant's unit in the loop's own plant's place.
#[test]
fn val_the_loop_around_a_unit_is_the_loop_around_its_plant() {
    let place = tempfile::tempdir().expect("a folder");
    let rig = rig();
    let motion = Motion::mixed();
    let course = Course {
        motion: motion.clone(),
        ticks: 3_000,
    };
    let controller = || HostController::new(control_task(&rig).expect("a controller"));
    // The unit's seed is 1 unless told.
    let mut plant = Plant::new(&rig, PlantSettings::at(motion.start_m(), 1)).expect("a plant");
    let own = run(&mut plant, &mut controller(), &course).expect("a run");
    for standard in [Standard::Two, Standard::Three] {
        let path = place.path().join("axis.fmu");
        fs::write(&path, unit(standard, Kind::Plant)).expect("room");
        let told = Told {
            parameters: BTreeMap::from([("plant.start_m".to_owned(), motion.start_m())]),
            ..Told::default()
        };
        let mut plant = ForeignPlant::open(&path, &rig, &told, 1e-3).expect("a unit");
        assert_eq!(plant.assumed(), [""; 0]);
        let foreign = run(&mut plant, &mut controller(), &course).expect("a run");
        for (own, foreign) in own.rows.iter().zip(&foreign.rows) {
            assert_eq!(own.sample, foreign.sample, "{standard:?}");
            assert_eq!(own.command, foreign.command, "{standard:?}");
        }
    }
}

const SLIDE: &str = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="2.0" modelName="Slide" guid="{slide}">
  <CoSimulation modelIdentifier="slide"/>
  <ModelVariables>
    <ScalarVariable name="valve.in" valueReference="0" causality="input"><Real unit="mV"/></ScalarVariable>
    <ScalarVariable name="slide.s" valueReference="1" causality="output"><Real unit="mm"/></ScalarVariable>
    <ScalarVariable name="gauge" valueReference="2" causality="output"><Real unit="bar(g)"/></ScalarVariable>
    <ScalarVariable name="payload" valueReference="3" causality="parameter"><Real unit="kg"/></ScalarVariable>
  </ModelVariables>
</fmiModelDescription>"#;

/// A unit that a compiler of C makes.
fn slide(place: &Path) -> std::path::PathBuf {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/other_plant.c");
    let library = place.join("slide.so");
    let status = Command::new("cc")
        .args([
            "-shared", "-fPIC", "-O1", "-Wall", "-Wextra", "-Werror", "-o",
        ])
        .args([&library, &source])
        .status()
        .expect("a compiler of C");
    assert!(status.success());
    let path = place.join("slide.fmu");
    let mut archive = zip::ZipWriter::new(fs::File::create(&path).expect("room"));
    let options = zip::write::SimpleFileOptions::default();
    let library = fs::read(library).expect("it is built");
    for (name, bytes) in [
        ("modelDescription.xml", SLIDE.as_bytes()),
        ("binaries/linux64/slide.so", &library),
    ] {
        archive.start_file(name, options).expect("room");
        std::io::Write::write_all(&mut archive, bytes).expect("room");
    }
    archive.finish().expect("an archive");
    path
}

#[test]
fn val_a_unit_of_others_is_read_in_its_own_names_and_units() {
    let place = tempfile::tempdir().expect("a folder");
    let path = slide(place.path());
    let rig = rig();
    let mut told = Told::default();
    let refused = |told: &Told| {
        let refused = ForeignPlant::open(&path, &rig, told, 1e-3).map(drop);
        let fault = refused.expect_err("a variable is missing");
        format!(
            "{}: {}, expected {}",
            fault.key, fault.problem, fault.expected
        )
    };
    assert_eq!(
        refused(&told),
        "u: the unit has no real variable command_v, expected --plant-variable u=NAME, one of: valve.in"
    );
    for (signal, name) in [
        ("u", "valve.in"),
        ("x", "slide.s"),
        ("p_a", "gauge"),
        ("p_b", "payload"),
    ] {
        told.variables.insert(signal.into(), name.into());
    }
    let said = refused(&told);
    assert!(
        said.starts_with("p_b: the unit's variable payload: its unit \"kg\" is unknown"),
        "{said}"
    );
    told.variables.insert("p_b".into(), "gauge".into());
    told.parameters.insert("payload".into(), 2.0);

    let mut plant = ForeignPlant::open(&path, &rig, &told, 1e-3).expect("a unit");
    assert_eq!(plant.assumed().len(), 2, "supply and velocity");
    let start = plant.truth();
    assert!((start.pressure_a_pa - (3e5 + rig.ambient_pressure_pa())).abs() < 1e-6);
    assert!((start.supply_pressure_pa - 7e5).abs() < 1e-6);
    assert!((start.command_v - 5.0).abs() < 1e-12);
    // A volt more from the second step on: 1000 mm/s, by two kilograms.
    for _ in 0..11 {
        plant.sample();
        plant.advance(DacCode(39_312)).expect("it steps");
    }
    let command_v = plant.truth().command_v;
    let expected_m = 10.0 * 1e-3 * (command_v - 5.0) / 2.0;
    assert!(
        (plant.truth().position_m - expected_m).abs() < 1e-9,
        "{:?}",
        plant.truth()
    );
    let shown = plant.sample().measurements();
    assert!((shown.velocity_m_per_s - 0.5).abs() < 0.05, "{shown:?}");
    // And where it ends the run ends, with its word for it.
    let end = (0..100).find_map(|_| plant.advance(DacCode(32_768)).err());
    let said = end.expect("it ends").to_string();
    assert!(said.contains("fmi2DoStep gave error"), "{said}");
}
