//! `pneuma simulate` from its files to its recording: the paper's rig, a
//! practice rig, round trips, bad files, seeds, effects.

#![allow(
    clippy::unwrap_used,
    reason = "the helpers of a test fail by panicking, as the tests do"
)]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use host_sim::effects::EFFECTS;
use host_sim::model::Values;
use host_sim::recording::Recording;
use host_sim::rig::Rig;
use host_sim::scenario::Scenario;
use host_sim::simulate::{Ending, Simulation, integration_error, recorded, simulate};
use model_core::paper;

/// Twelve digits are written.
const WRITTEN_RELATIVE: f64 = 1e-11;

fn folder() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("simulate")
        .join(name);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn pneuma(scenario: &Path, out: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pneuma"))
        .arg("simulate")
        .arg(scenario)
        .arg("--out")
        .arg(out)
        .output()
        .unwrap()
}

fn paper_rig() -> Rig {
    Rig::read(folder().join("rigs/paper.toml")).unwrap()
}

fn values(rig: &Rig) -> Values<'_, f64> {
    Values {
        rig,
        keys: &[],
        replaced: &[],
    }
}

fn parse(text: &str) -> Scenario {
    Scenario::parse(text, "scenario.toml", folder()).unwrap()
}

fn shipped(name: &str) -> Simulation {
    let path = folder().join("scenarios").join(name);
    simulate(&Scenario::read(path).unwrap()).unwrap()
}

fn close(left: f64, right: f64, relative: f64) -> bool {
    (left - right).abs() <= relative * left.abs().max(right.abs())
}

const STEP: &str = "format = \"scenario/1\"\n\
                    rig = \"rigs/paper.toml\"\n\
                    duration_s = 0.4\n\
                    [command]\n\
                    kind = \"step\"\n\
                    at_s = 0.05\n\
                    from_V = 5.0\n\
                    to_V = 4.0\n";

// the paper

#[test]
fn val_the_paper_rig_is_the_paper_module() {
    let rig = paper_rig();
    assert_eq!(values(&rig).axis(1e-3).unwrap(), paper::axis::<f64>());
    for (key, constant) in [
        ("supply.pressure_Pa", paper::SUPPLY_PRESSURE_PA),
        ("cylinder.stroke_m", paper::STROKE_M),
        ("chambers.expansion_index", paper::EXPANSION_INDEX),
        ("chambers.compression_index", paper::COMPRESSION_INDEX),
    ] {
        let value = rig.value(key).unwrap();
        assert_eq!(value.to_bits(), constant.to_bits(), "{key} is {value}");
    }
}

#[test]
fn val_a_null_valve_rests_at_three_quarters_of_the_supply() {
    // 0.755 of the supply for equal leaks and b = 0.29, by the flow law.
    let text = STEP.replace("to_V = 4.0", "to_V = 5.0");
    let simulation = simulate(&parse(&text)).unwrap();
    let (first, last) = (simulation.samples[0], simulation.samples.last().unwrap());
    let ratio = first.pressure_a_pa / first.supply_pressure_pa;
    assert!((ratio - 0.755).abs() < 0.002, "{ratio}");
    assert!((last.pressure_a_pa - first.pressure_a_pa).abs() < 1.0);
    assert!(last.position_m.abs() < 1e-9);
}

#[test]
fn regress_the_step_of_figure_14_from_the_middle_of_the_stroke() {
    let simulation = shipped("paper-fig14.toml");
    assert_eq!(simulation.ending, Ending::Complete);
    assert!(simulation.samples[0].position_m.abs() < 1e-12);
    let figures = simulation.key_figures();
    assert!((0.20..0.25).contains(&figures.travel_m), "{figures:?}");
    assert!(
        (0.75..0.85).contains(&figures.peak_speed_m_s.0),
        "{figures:?}"
    );
    assert!((275.0..279.0).contains(&figures.lowest_temperature_k.0));
}

/// The estimate against a run at a fiftieth of the step.
#[test]
fn val_the_stated_error_is_that_of_the_step() {
    let mut scenario = parse(STEP);
    let coarse = simulate(&scenario).unwrap();
    let stated = integration_error(&scenario, &coarse).unwrap();
    scenario.steps_per_sample = 50;
    let fine = simulate(&scenario).unwrap();
    let pairs = || coarse.samples.iter().zip(&fine.samples);
    let true_m = pairs().fold(0.0_f64, |most, (a, b)| {
        most.max((a.position_m - b.position_m).abs())
    });
    let true_pa = pairs().fold(0.0_f64, |most, (a, b)| {
        let a_pa = (a.pressure_a_pa - b.pressure_a_pa).abs();
        most.max(a_pa)
            .max((a.pressure_b_pa - b.pressure_b_pa).abs())
    });
    println!("{stated:?}, {true_m} m, {true_pa} Pa");
    assert!(close(stated.position_m, true_m, 0.3), "{stated:?} {true_m}");
    assert!(
        close(stated.pressure_pa, true_pa, 0.3),
        "{stated:?} {true_pa}"
    );
    assert!(stated.position_m < 1e-5);
}

/// The reduced model takes the reference pressure of the rig, and the supply's without.
#[test]
fn val_the_reference_pressure_is_the_rigs() {
    let mut rig = paper_rig();
    let chambers = rig.chambers.as_mut().unwrap();
    chambers.model = host_sim::rig::ChamberModel::Polytropic;
    let risen_pa = |rig: &Rig| {
        let mut scenario = parse(&STEP.replace("to_V = 4.0", "to_V = 5.0"));
        scenario.initial.pressure_a_pa = Some(5.2e5);
        scenario.initial.pressure_b_pa = Some(5.2e5);
        let mut sealed = rig.clone();
        let valve = sealed.valve.as_mut().unwrap();
        valve.supply_area_m2[..2].fill(0.0);
        valve.exhaust_area_m2[..2].fill(0.0);
        scenario.rig = sealed;
        simulate(&scenario)
            .unwrap()
            .samples
            .last()
            .unwrap()
            .pressure_a_pa
            - 5.2e5
    };
    assert!(
        risen_pa(&rig) > 1e3,
        "the supply's pressure is no equilibrium"
    );
    rig.set_value("chambers.reference_pressure_Pa", 5.2e5)
        .unwrap();
    let drift_pa = risen_pa(&rig);
    assert!(drift_pa.abs() < 1e-6, "{drift_pa} Pa");
    let again = Rig::parse(&rig.to_toml(), "again.toml").unwrap();
    assert_eq!(again, rig);
}

/// Two silencers of the rig file act, and are not one.
#[test]
fn val_the_exhausts_of_the_rig_are_one_or_two() {
    let text = paper_rig().to_toml()
        + "
[effects.exhaust-back-pressure]
silencer_area_m2 = 4e-6
";
    let end_pa = |exhausts: &str| {
        let text = text.replace(
            "[valve]\n",
            &format!("[valve]\nexhausts = \"{exhausts}\"\n"),
        );
        let rig = Rig::parse(&text, "rig.toml").unwrap();
        assert_eq!(Rig::parse(&rig.to_toml(), "again.toml").unwrap(), rig);
        let mut scenario = parse(STEP);
        scenario.rig = rig;
        let simulation = simulate(&scenario).unwrap();
        simulation.samples.last().unwrap().pressure_a_pa
    };
    assert!((end_pa("one") - end_pa("two")).abs() > 100.0);
    let wrong = text.replace("[valve]\n", "[valve]\nexhausts = \"three\"\n");
    let error = Rig::parse(&wrong, "rig.toml").unwrap_err().to_string();
    assert!(
        error.contains("exhausts") && error.contains("two"),
        "{error}"
    );
}

#[test]
fn val_closed_chambers_are_the_adiabatic_air_spring() {
    let simulation = shipped("closed-chambers.toml");
    let samples = &simulation.samples;
    let rising: Vec<f64> = samples
        .windows(2)
        .skip(10)
        .filter(|pair| pair[0].position_m < 0.0 && pair[1].position_m >= 0.0)
        .map(|pair| pair[0].time_s)
        .collect();
    let periods = (rising.len() - 1) as f64;
    let measured_hz = periods / (rising[rising.len() - 1] - rising[0]);
    let volume_m3 = paper::DEAD_VOLUME_M3 + 0.5 * paper::STROKE_M * paper::PISTON_AREA_M2;
    let stiffness = 2.0 * 1.4 * 5.25e5 * paper::PISTON_AREA_M2.powi(2) / volume_m3;
    let expected_hz = (stiffness / paper::MOVING_MASS_KG).sqrt() / std::f64::consts::TAU;
    assert!(
        close(measured_hz, expected_hz, 2e-3),
        "{measured_hz} for {expected_hz}"
    );
}

#[test]
fn prop_half_the_step_is_a_quarter_of_the_error() {
    let end = |step_s: &str| {
        let text = STEP.replace("[command]", &format!("step_s = {step_s}\n[command]"));
        simulate(&parse(&text))
            .unwrap()
            .samples
            .last()
            .unwrap()
            .position_m
    };
    let reference = end("0.00001");
    let (coarse, fine) = (end("0.001") - reference, end("0.0005") - reference);
    assert!((3.3..5.0).contains(&(coarse / fine)), "{coarse} and {fine}");
    assert!(coarse.abs() < 6e-6, "{coarse}");
}

// recordings

fn practice_scenario(folder: &Path, seed: u64) -> PathBuf {
    let rig = self::folder().join("tests/data/practice-p01.toml");
    fs::copy(rig, folder.join("rig.toml")).unwrap();
    let text = format!(
        "format = \"scenario/1\"\nrig = \"rig.toml\"\nduration_s = 1.0\n\
         [[command]]\nkind = \"multisine\"\namplitude_V = 0.2\n\
         frequencies_Hz = [1.0, 2.0, 3.0, 5.0, 8.0]\nduration_s = 0.5\n\
         [[command]]\nkind = \"chirp\"\namplitude_V = 0.5\nfrom_Hz = 1.0\nto_Hz = 20.0\n\
         [noise]\nseed = {seed}\n"
    );
    let path = folder.join(format!("seed-{seed}.toml"));
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn regress_a_practice_rig_simulates_and_reads_back() {
    let folder = scratch("practice");
    let out = folder.join("recording.csv");
    let output = pneuma(&practice_scenario(&folder, 1), &out);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let rig = Rig::read(folder.join("rig.toml")).unwrap();
    let recording = Recording::read(&out, &rig.signals).unwrap();
    assert_eq!(recording.len(), 1001);
    assert!(recording.unused_columns.is_empty());
    for pressure_pa in recording.signal("p_a").unwrap() {
        let quanta = pressure_pa / 244.0;
        assert!((quanta - quanta.round()).abs() < 1e-6, "{pressure_pa}");
    }
}

#[test]
fn prop_the_same_seed_gives_the_same_bytes() {
    let folder = scratch("seeds");
    let bytes = |seed: u64, name: &str| {
        let out = folder.join(name);
        let output = pneuma(&practice_scenario(&folder, seed), &out);
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        fs::read(out).unwrap()
    };
    let first = bytes(7, "first.csv");
    assert!(first == bytes(7, "second.csv"), "one seed, two recordings");
    assert!(first != bytes(8, "third.csv"), "two seeds, one recording");
}

/// Reads back through the rig what the table says, and compares with the run.
fn assert_reads_back(scenario: &Scenario) {
    let simulation = simulate(scenario).unwrap();
    let mut text = Vec::new();
    recorded(scenario, &simulation)
        .unwrap()
        .write(&mut text)
        .unwrap();
    let signals = &scenario.rig.signals;
    let recording = Recording::read_from(text.as_slice(), "table", None, signals).unwrap();
    assert_eq!(recording.len(), simulation.samples.len());
    for (row, sample) in simulation.samples.iter().enumerate() {
        for (name, value, size) in [
            ("t", sample.time_s, 1.0),
            ("u", sample.command_v, 1.0),
            ("p_a", sample.pressure_a_pa, 1e6),
            ("p_s", sample.supply_pressure_pa, 1e6),
            ("x", sample.position_m, 1.0),
            ("v", sample.velocity_m_s, 1.0),
        ] {
            let read = recording.signal(name).unwrap()[row];
            assert!(
                (read - value).abs() <= WRITTEN_RELATIVE * size,
                "{name}: {read} for {value}"
            );
        }
    }
}

#[test]
fn prop_an_exact_recording_reads_back() {
    assert_reads_back(&parse(STEP));
}

#[test]
fn prop_units_gauge_scale_and_column_numbers_read_back() {
    let mut scenario = parse(STEP);
    let odd = Rig::parse(
        "format = \"rig/1\"\n[signals]\n\
         t = { column = 3, unit = \"ms\" }\n\
         u = { column = \"valve, command\", unit = \"%\", scale = 10.0 }\n\
         p_a = { column = 0, unit = \"bar(g)\" }\n\
         p_s = { column = \"supply\", unit = \"V\", scale = 1e5, offset = 2e4 }\n\
         x = { column = \"x\", unit = \"mm\", offset = 0.25 }\n\
         v = { column = 1, unit = \"in/s\" }\n",
        "odd.toml",
    );
    scenario.rig.signals = odd.unwrap().signals;
    assert_reads_back(&scenario);
}

#[test]
fn regress_states_are_recorded_on_demand() {
    let scenario = parse(&format!("{STEP}[record]\nstates = true\n"));
    let table = recorded(&scenario, &simulate(&scenario).unwrap()).unwrap();
    let expected = "t_s,u_V,p_a_Pa,p_b_Pa,p_s_Pa,x_m,v_m_s,T_a_K,T_b_K,friction_N";
    assert_eq!(table.names.join(","), expected);
}

#[test]
fn val_a_recorded_command_gives_the_recorded_motion() {
    // A controller's rows: u holds to the next row, so that the recording's own
    // command, as a table, must repeat the simulation.
    let folder = scratch("table");
    let scenario = Scenario::read(self::folder().join("scenarios/paper-fig14.toml")).unwrap();
    let simulation = simulate(&scenario).unwrap();
    let rows = simulation.samples.iter();
    let lines: String = rows
        .map(|sample| format!("{},{}\n", sample.time_s, sample.command_v))
        .collect();
    fs::write(folder.join("u.csv"), format!("t,u\n{lines}")).unwrap();
    let mut again = scenario.clone();
    let text = "format = \"scenario/1\"\nrig = \"rig.toml\"\nduration_s = 1\n\
                [command]\nkind = \"table\"\nfile = \"u.csv\"\n";
    fs::write(folder.join("rig.toml"), scenario.rig.to_toml()).unwrap();
    again.command = Scenario::parse(text, "table.toml", &folder)
        .unwrap()
        .command;
    assert_eq!(simulate(&again).unwrap(), simulation);
}

// the end of the stroke

#[test]
fn regress_the_end_of_the_stroke_ends_the_simulation_with_a_note() {
    let folder = scratch("stop");
    let path = folder.join("stop.toml");
    let rig = fs::read_to_string(self::folder().join("rigs/paper.toml")).unwrap();
    fs::write(folder.join("paper.toml"), rig).unwrap();
    let text = STEP
        .replace("rigs/paper.toml", "paper.toml")
        .replace("0.4", "2.0");
    fs::write(&path, &text).unwrap();
    let out = folder.join("stop.csv");
    let output = pneuma(&path, &out);
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(
        said.contains("note: stopped at 0.") && said.contains("end stops"),
        "{said}"
    );
    let recording = Recording::read(&out, &paper_rig().signals).unwrap();
    let x = recording.signal("x").unwrap();
    assert!(x.iter().all(|x| x.abs() <= 0.25) && x[x.len() - 1] < -0.249);
    let simulation = simulate(&Scenario::read(&path).unwrap()).unwrap();
    assert!(matches!(simulation.ending, Ending::EndStop { .. }));
}

// bad files

/// What is changed in the good scenario, and what the line must say.
const BAD: &[(&str, &str, &str)] = &[
    (
        "scenario/1",
        "scenario/9",
        ":1: format: is the text \"scenario/9\", expected format = ",
    ),
    (
        "duration_s = 0.4",
        "duration = 0.4",
        ":3: duration: unknown key, expected ... (did you mean \"duration_s\"?)",
    ),
    (
        "duration_s = 0.4",
        "duration_s = -1",
        ":3: duration_s: is -1, expected seconds",
    ),
    (
        "duration_s = 0.4",
        "duration_s = nan",
        ":3: duration_s: is nan, expected seconds",
    ),
    (
        "duration_s = 0.4",
        "duration_s = 1e6",
        ":3: duration_s: 1000000001 rows",
    ),
    (
        "duration_s = 0.4\n",
        "",
        ": duration_s: missing, expected seconds",
    ),
    (
        "duration_s = 0.4",
        "duration_s = 0.4\nstep_s = 3e-4",
        ":4: step_s: is 3e-4, expected sample_s",
    ),
    ("paper.toml", "papr.toml", ":2: rig: there is no file"),
    (
        "[command]",
        "[comand]",
        ":4: comand: unknown key, expected ... (did you mean \"command\"?)",
    ),
    (
        "\"step\"",
        "\"stepp\"",
        ":5: command.kind: is the text \"stepp\", expected ... (did you mean \"step\"?)",
    ),
    ("at_s", "from_Hz", ":6: command.from_Hz: unknown key"),
    (
        "to_V = 4.0",
        "",
        ":4: command.to_V: missing, expected volts",
    ),
    (
        "to_V = 4.0",
        "to_V = \"4\"",
        ":8: command.to_V: is the text \"4\", expected volts",
    ),
    (
        "[command]",
        "[initial]\nposition_m = 0.3\n[command]",
        ":5: initial.position_m: is 0.3, expected metres within the stroke",
    ),
    (
        "[command]",
        "[noise]\nseed = 1.5\n[command]",
        ":5: noise.seed: is 1.5, expected a whole number",
    ),
    (
        "[command]",
        "[record]\nstates = 1\n[command]",
        ":5: record.states: is 1, expected true or false",
    ),
    (
        "[command]",
        "[[command]]\nkind = \"constant\"\nvalue_V = 5.0\n[[command]]",
        ":4: command[0].duration_s: missing",
    ),
    ("[command]", "command", ":4: not valid TOML"),
];

#[test]
fn regress_a_bad_scenario_gets_one_clear_line_and_status_2() {
    let folder = scratch("bad");
    fs::copy(
        self::folder().join("rigs/paper.toml"),
        folder.join("paper.toml"),
    )
    .unwrap();
    let good = STEP.replace("rigs/", "");
    for (from, to, expected) in BAD {
        let path = folder.join("bad.toml");
        assert!(good.contains(from), "{from}");
        fs::write(&path, good.replacen(from, to, 1)).unwrap();
        assert_one_line(&pneuma(&path, &folder.join("none.csv")), expected);
    }
    let absent = pneuma(&folder.join("absent.toml"), &folder.join("none.csv"));
    assert_one_line(&absent, "absent.toml: cannot be read");
}

/// Three dots in `expected` stand for any text.
fn assert_one_line(output: &Output, expected: &str) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    for part in expected.split(" ... ") {
        assert!(said.contains(part), "{said} has no {part}");
    }
}

#[test]
fn regress_a_rig_that_is_no_axis_says_what_it_lacks() {
    let folder = scratch("lacking");
    let rig = fs::read_to_string(self::folder().join("rigs/paper.toml")).unwrap();
    let scenario = folder.join("scenario.toml");
    fs::write(&scenario, STEP.replace("rigs/paper.toml", "rig.toml")).unwrap();
    for (from, to, expected) in [
        ("mass_kg = 2.0 ", "#", ": carriage.mass_kg: missing"),
        (
            "dead_volume_b_m3",
            "#",
            "rig.toml: cylinder.dead_volume_b_m3: missing, expected a value, as a whole axis",
        ),
        (
            "opening_V = [0.0,",
            "opening_V = [0.1,",
            ": valve.opening_V: point 0 is 0.1, expected 0",
        ),
        (
            "= [1e-7, 1e-7, 16.7e-6]",
            "= [1e-7, 0.0, 16.7e-6]",
            "areas that never fall",
        ),
        (
            "[friction]",
            "[effects.tube-lin]\nlength_m = 1\n[friction]",
            "effects.tube-lin: unknown effect, expected ... (did you mean \"tube-line\"?)",
        ),
        (
            "[friction]",
            "[effects.tube-line]\nlenght_m = 1\n[friction]",
            "effects.tube-line.lenght_m: unknown parameter, expected ... (did you mean \"length_m\"?)",
        ),
        (
            "[friction]",
            "[effects.tube-line]\nlength_m = -1\n[friction]",
            "effects.tube-line.length_m: -1 is out of range",
        ),
        (
            "[friction]",
            "[effects.valve-delay]\ndelay_s = 0.1\n[friction]",
            "effects.valve-delay.delay_s: 0.1 s is more than 0.062 s",
        ),
    ] {
        assert!(rig.contains(from), "{from}");
        fs::write(folder.join("rig.toml"), rig.replacen(from, to, 1)).unwrap();
        assert_one_line(&pneuma(&scenario, &folder.join("none.csv")), expected);
    }
}

// effects

/// A value that must show for each parameter of the catalogue.
fn telling(effect: &str, key: &str) -> f64 {
    match key {
        "from" if effect == "unknown-opening" => 0.4,
        "to" if effect == "unknown-opening" => 1.1,
        key if key.starts_with("shift_") => {
            0.02 * f64::from(key.as_bytes()[key.len() - 3] - b'0') + 0.1
        }
        "from" if effect == "unknown-reading" => 4.5e5,
        "to" if effect == "unknown-reading" => 5.5e5,
        key if key.starts_with("error_") => {
            1e3 * f64::from(key.as_bytes()[key.len() - 4] - b'0') + 1e3
        }
        "length_m" => 2.0,
        "tank_volume_m3" | "volume_m3" => 1e-3,
        "feed_area_m2" | "silencer_area_m2" => 5e-6,
        "needle_area_m2" => 3e-7,
        "outlet_a_m2" | "outlet_b_m2" => 2e-6,
        "zone_share" => 0.5,
        "zone_middle_m" => 0.01,
        "zone_length_m" => 0.1,
        "laminar_kg_s_Pa2" => 1e-15,
        "orifice_m2" => 1e-7,
        "density_exponent" => 0.7,
        "flow_W_m2K" => 50.0,
        "offset_K" => 8.0,
        "heat_capacity_J_K" => 5.0,
        "outer_W_K" => 10.0,
        "offset_a_Pa" | "offset_b_Pa" => 2e3,
        "gain_error_a" | "gain_error_b" => 0.01,
        "diameter_m" => 0.003,
        "cosine" | "sine" | "asymmetry" | "viscous_asymmetry" => 0.3,
        "wavelength_m" => 0.05,
        "slope_per_m" | "curvature_per_m2" => 5.0,
        "rise_N" => 10.0,
        "load_mass_kg" => 1.0,
        "stiffness_N_m" | "buffer_stiffness_N_m" => 1e5,
        "damping_Ns_m" | "buffer_damping_Ns_m" => 50.0,
        "gap_m" => 1e-4,
        "forgetting_way_m" => 2e-5,
        "buffer_length_m" => 0.2499,
        "natural_frequency_Hz" => 40.0,
        "damping_ratio" => 0.4,
        "width" => 0.1,
        "delay_s" => 0.0045,
        "rising_per_s" | "falling_per_s" => 10.0,
        "time_constant_s" => 0.004,
        "onset_s" => 0.1,
        "gauge_before_feed" => 1.0,
        "of_velocity" => 1.0,
        "spring_N_m" => 500.0,
        "stiffening_N_m3" => 5e4,
        "rest_m" => 0.05,
        "drag_Ns2_m2" => 40.0,
        "pitch_m" => 0.03,
        "path_m" => 0.005,
        "from" => -0.1,
        "to" => 0.1,
        "memory_a" | "memory_b" => 1.0,
        "conductance_a_W_K" | "conductance_b_W_K" => 1.0,
        "volume_a_m3" | "volume_b_m3" => 1e-5,
        "bristle_stiffness_N_m" => 1e4,
        // A table whose values are all the same is the same wherever it begins.
        key if key.starts_with("force_") && key != "force_N" => {
            f64::from(key.as_bytes()[key.len() - 3] - b'0') - 4.5
        }
        key if key.starts_with("laminar_") => 1e-15,
        key if key.starts_with("orifice_") => 1e-7,
        key if key.ends_with("_N_Pa") => 2e-5,
        key if key.ends_with("_N") || key.ends_with("_Ns_m") => 5.0,
        other => panic!("no telling value for {other}"),
    }
}

/// Both directions, so that limits in either show.
fn bare_scenario() -> Scenario {
    scenario_with(
        "kind = \"pulses\"\nfrom_V = 4.0\n\
         pulses = [{ at_s = 0.05, duration_s = 0.1, to_V = 6.0 }]\n",
    )
}

/// All openings up to 1.2 V.
fn swept_scenario() -> Scenario {
    scenario_with("kind = \"sine\"\namplitude_V = 1.2\nfrequency_Hz = 5.0\n")
}

fn scenario_with(command: &str) -> Scenario {
    let initial = "[initial]\npressure_a_Pa = 5e5\npressure_b_Pa = 5e5\n";
    let before = STEP.split("[command]").next().unwrap();
    let text = format!("{before}[command]\n{command}{initial}");
    let mut scenario = parse(&text);
    // The reduced model leaves room for the temperature's own dynamics, and has heat.
    let toml = scenario
        .rig
        .to_toml()
        .replace("model = \"energy-balance\"", "model = \"polytropic\"");
    scenario.rig = Rig::parse(&toml, "bare.toml").unwrap();
    scenario
}

fn table_with(scenario: &Scenario, effects: BTreeMap<String, BTreeMap<String, f64>>) -> String {
    let mut scenario = scenario.clone();
    scenario.rig.effects = effects;
    let table = recorded(&scenario, &simulate(&scenario).unwrap()).unwrap();
    let mut text = Vec::new();
    table.write(&mut text).unwrap();
    String::from_utf8(text).unwrap()
}

#[test]
fn prop_every_catalogued_parameter_acts_and_is_off_when_neutral() {
    for effect in EFFECTS {
        let scenario = if effect.name == "unknown-opening" {
            swept_scenario()
        } else {
            bare_scenario()
        };
        let bare = table_with(&scenario, BTreeMap::new());
        let with = |value: &dyn Fn(&str) -> Option<f64>| {
            let keys = effect.parameters.iter().map(|parameter| parameter.key);
            let parameters = keys.filter_map(|key| Some((key.to_owned(), value(key)?)));
            table_with(
                &scenario,
                BTreeMap::from([(effect.name.to_owned(), parameters.collect())]),
            )
        };
        let neutral = |key: &str| effect.parameter(key).unwrap().neutral;
        assert!(with(&neutral) == bare, "{} acts when neutral", effect.name);
        let all = with(&|key| Some(telling(effect.name, key)));
        for parameter in effect.parameters {
            let without = with(&|key| match key {
                key if key == parameter.key => parameter.neutral,
                key => Some(telling(effect.name, key)),
            });
            assert!(
                without != all,
                "{}.{} does nothing",
                effect.name,
                parameter.key
            );
        }
    }
}

#[test]
fn val_a_skewed_position_is_the_position_of_before() {
    let scenario = bare_scenario();
    let mut late = scenario.clone();
    let parameters = BTreeMap::from([("delay_s".to_owned(), 0.002)]);
    late.rig
        .effects
        .insert("position-time-skew".into(), parameters);
    let columns = |scenario: &Scenario| {
        let table = recorded(scenario, &simulate(scenario).unwrap()).unwrap();
        let place = table.names.iter().position(|name| name == "x_m").unwrap();
        table.columns[place].clone()
    };
    let (exact, shown) = (columns(&scenario), columns(&late));
    for row in 2..exact.len() {
        assert!((shown[row] - exact[row - 2]).abs() < 1e-12, "row {row}");
    }
}
