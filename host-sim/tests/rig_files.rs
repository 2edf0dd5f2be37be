//! Rig files: what is read, what is refused and how, and the way back.

mod common;

use std::collections::BTreeMap;
use std::fs;

use host_sim::rig::{ChamberModel, Column, EffectFault, PositionZero, Rig, STANDARD_PRESSURE_PA};
use proptest::prelude::*;

/// A whole rig, as in the contract.
const FULL: &str = r#"format = "rig/1"
[signals]
t = { column = "t_s", unit = "s" }
u = { column = "u_V", unit = "V" }
p_a = { column = "p_a", unit = "bar(g)", noise = 250.0, resolution = 244.0 }
x = { column = 3, unit = "mm", scale = 2.0, offset = -0.1 }
[gas]
gamma = 1.4
gas_constant_J_kgK = 287
[environment]
pressure_Pa = 100000.0
temperature_K = 293.15
[supply]
pressure_Pa = 658300.0
[valve]
feeds_a_when = "above-null"
null_V = 5.069
critical_pressure_ratio = 0.290
laminar_pressure_ratio = 0.985
opening_V = [0, 0.5, 1.0]
supply_area_m2 = [7.5e-08, 1.1e-07, 1.2e-05]
exhaust_area_m2 = [7.7e-08, 1.1e-07, 1.3e-05]
[cylinder]
stroke_m = 0.5
bore_m = 0.025
area_a_m2 = 4.909e-4
area_b_m2 = 4.909e-4
dead_volume_a_m3 = 1.93e-05
dead_volume_b_m3 = 2.94e-05
position_zero = "mid-stroke"
[chambers]
model = "energy-balance"
heat_transfer_charging_W_m2K = 55.3
heat_transfer_discharging_W_m2K = 19.2
[carriage]
mass_kg = 1.740
[friction]
viscous_Ns_m = 53.4
coulomb_N = 17.5
[uncertainty]
"supply.pressure_Pa" = 0.004
"valve.null_V" = 0.025
"valve.opening_V" = 0.03
"friction.coulomb_N" = 0.12
"effects.chamber-leakage.laminar_a_kg_s_Pa2" = 0.5
[effects.chamber-leakage]
laminar_a_kg_s_Pa2 = 2.0e-9
"#;

fn parse(text: &str) -> Rig {
    Rig::parse(text, "rig.toml").expect("a rig")
}

fn message(text: &str) -> String {
    Rig::parse(text, "rig.toml")
        .expect_err("a bad rig")
        .to_string()
}

#[test]
fn val_contract_rig_is_read_with_its_figures() {
    let rig = parse(FULL);
    let cylinder = rig.cylinder.as_ref().expect("a cylinder");
    assert_eq!(cylinder.position_zero, Some(PositionZero::MidStroke));
    assert_eq!(rig.value("gas.gas_constant_J_kgK"), Some(287.0));
    assert_eq!(rig.value("carriage.external_force_N"), Some(0.0));
    assert_eq!(rig.value("friction.static_N"), None);
    assert_eq!(
        rig.value("effects.chamber-leakage.laminar_a_kg_s_Pa2"),
        Some(2e-9)
    );
    let position = rig.signals.get("x").expect("a position");
    assert_eq!(position.column, Column::Number(3));
    assert!((position.to_si(100.0, 0.0) - 0.1).abs() < 1e-12);
    let pressure = rig.signals.get("p_a").expect("a pressure");
    let absolute_pa = pressure.to_si(6.0, rig.signals.gauge_zero_pa);
    assert!((absolute_pa - 700_000.0).abs() < 1e-6);
}

#[test]
fn val_uncertainty_is_absolute_and_tables_are_scales() {
    let rig = parse(FULL);
    let close = |key: &str, expected: f64| {
        let found = rig.uncertainty_sd(key).expect(key);
        assert!(
            (found - expected).abs() < 1e-12 * expected,
            "{key}: {found}"
        );
    };
    close("supply.pressure_Pa", 0.004 * 658_300.0);
    close("valve.null_V", 0.025);
    close("valve.opening_V", 0.03);
    close("friction.coulomb_N", 0.12 * 17.5);
    close("effects.chamber-leakage.laminar_a_kg_s_Pa2", 1e-9);
    assert_eq!(rig.value("valve.opening_V"), Some(1.0));
    assert_eq!(rig.uncertainty_sd("carriage.mass_kg"), None);
}

#[test]
fn val_replaced_values_are_stored_and_scales_multiplied_in() {
    let values = BTreeMap::from([
        ("valve.supply_area_m2".to_owned(), 2.0),
        ("friction.static_N".to_owned(), 21.0),
        ("environment.pressure_Pa".to_owned(), 90_000.0),
        ("effects.tube-line.length_m".to_owned(), 0.02),
    ]);
    let rig = parse(FULL).with_values(&values);
    let valve = rig.valve.as_ref().expect("a valve");
    assert_eq!(valve.supply_area_m2, [1.5e-7, 2.2e-7, 2.4e-5]);
    assert_eq!(rig.value("friction.static_N"), Some(21.0));
    assert_eq!(rig.value("effects.tube-line.length_m"), Some(0.02));
    assert!((rig.signals.gauge_zero_pa - 90_000.0).abs() < 1e-9);
    assert_eq!(parse(&rig.to_toml()), rig);
}

#[test]
fn val_a_key_without_a_place_is_reported() {
    let values = BTreeMap::from([("vessel.volume_m3".to_owned(), 1.0)]);
    let error = parse(FULL).try_with_values(&values).expect_err("no vessel");
    assert_eq!(
        error.to_string(),
        "the rig has no place for \"vessel.volume_m3\""
    );
}

#[test]
fn val_every_section_is_optional() {
    let rig = parse("format = \"rig/1\"\n");
    assert_eq!(rig, Rig::default());
    assert!((rig.ambient_pressure_pa() - STANDARD_PRESSURE_PA).abs() < 1e-9);
    assert!((rig.horizon_s() - 0.25).abs() < 1e-12);
}

#[test]
fn val_effects_are_judged_by_the_caller_with_their_line() {
    let check = |name: &str, _: &BTreeMap<String, f64>| {
        Err(EffectFault {
            parameter: None,
            problem: format!("unknown effect \"{name}\""),
            expected: "another".into(),
        })
    };
    let error = Rig::parse_with(FULL, "rig.toml", &check).expect_err("an unknown effect");
    assert_eq!(
        error.to_string(),
        "rig.toml:46: effects.chamber-leakage: unknown effect \"chamber-leakage\", expected another"
    );
}

/// Each change to the full rig, and the line that it must cause.
const BAD: &[(&str, &str, &str)] = &[
    (
        "gamma = 1.4",
        "gama = 1.4",
        "rig.toml:8: gas.gama: unknown key, expected one of: gamma, gas_constant_J_kgK (did you mean \"gamma\"?)",
    ),
    (
        "[gas]",
        "[gass]",
        "rig.toml:7: gass: unknown section, expected one of: signals, uncertainty, controller, board, effects, gas, environment, supply, valve, cylinder, vessel, actuator, chambers, axis, carriage, friction, horizon, format (did you mean \"gas\"?)",
    ),
    (
        "gamma = 1.4",
        "",
        "rig.toml:7: gas.gamma: missing, expected a ratio of specific heats between 1 and 2 (air: 1.4)",
    ),
    (
        "gamma = 1.4",
        "gamma = \"air\"",
        "rig.toml:8: gas.gamma: is the text \"air\", expected a ratio of specific heats between 1 and 2 (air: 1.4)",
    ),
    (
        "gamma = 1.4",
        "gamma = nan",
        "rig.toml:8: gas.gamma: is nan, expected a ratio of specific heats between 1 and 2 (air: 1.4)",
    ),
    (
        "pressure_Pa = 658300.0",
        "pressure_Pa = 6.5",
        "rig.toml:14: supply.pressure_Pa: 6.5 is out of range, expected absolute Pa between 10 kPa and 100 MPa (is this bar, kPa or a gauge pressure?)",
    ),
    (
        "pressure_Pa = 658300.0",
        "pressure_Pa = 90000",
        "rig.toml:14: supply.pressure_Pa: 90000 is not above the ambient pressure 100000, expected absolute Pa (is this a gauge pressure?)",
    ),
    (
        "temperature_K = 293.15",
        "temperature_K = 20",
        "rig.toml:12: environment.temperature_K: 20 is out of range, expected kelvin between 100 and 1000 (is this degC?)",
    ),
    (
        "temperature_K = 293.15",
        "temperature_K = 0",
        "rig.toml:12: environment.temperature_K: 0 is out of range, expected kelvin between 100 and 1000 (is this degC?)",
    ),
    (
        "critical_pressure_ratio = 0.290",
        "critical_pressure_ratio = 1.2",
        "rig.toml:18: valve.critical_pressure_ratio: 1.2 is out of range, expected a ratio above 0 and below 1",
    ),
    (
        "laminar_pressure_ratio = 0.985",
        "laminar_pressure_ratio = 0.2",
        "rig.toml:19: valve.laminar_pressure_ratio: 0.2 is out of range, expected a ratio above valve.critical_pressure_ratio = 0.29",
    ),
    (
        "[0, 0.5, 1.0]",
        "[0, 1.0, 0.5]",
        "rig.toml:20: valve.opening_V: point 2 is 0.5 after 1, expected strictly increasing openings",
    ),
    (
        "[0, 0.5, 1.0]",
        "[0, 0.5, 0.5]",
        "rig.toml:20: valve.opening_V: point 2 is 0.5 after 0.5, expected strictly increasing openings",
    ),
    (
        "[0, 0.5, 1.0]",
        "[0.1, 0.5, 1.0]",
        "rig.toml:20: valve.opening_V: point 0 is 0.1, expected 0: the first point is the leakage of the closed path",
    ),
    (
        "[0, 0.5, 1.0]",
        "[0]",
        "rig.toml:20: valve.opening_V: has 1 points, expected at least 2",
    ),
    (
        "[7.5e-08, 1.1e-07, 1.2e-05]",
        "[7.5e-08, 1.1e-09, 1.2e-05]",
        "rig.toml:21: valve.supply_area_m2: point 1 is 0.0000000011 after 0.000000075, expected areas that never fall",
    ),
    (
        "[0, 0.5, 1.0]",
        "[0, 0.5]",
        "rig.toml:21: valve.supply_area_m2: has 3 points, expected 2, as valve.opening_V has",
    ),
    (
        "[0, 0.5, 1.0]",
        "[0, inf, 1.0]",
        "rig.toml:20: valve.opening_V[1]: is inf, expected volts from 0 to 1000",
    ),
    (
        "[7.5e-08, 1.1e-07, 1.2e-05]",
        "[-7.5e-08, 1.1e-07, 1.2e-05]",
        "rig.toml:21: valve.supply_area_m2[0]: -0.000000075 is out of range, expected m2 from 0 to 0.01 (is this mm2?)",
    ),
    (
        "\"above-null\"",
        "\"above\"",
        "rig.toml:16: valve.feeds_a_when: is the text \"above\", expected \"above-null\" or \"below-null\"",
    ),
    (
        "area_a_m2 = 4.909e-4",
        "area_a_m2 = -4.909e-4",
        "rig.toml:26: cylinder.area_a_m2: -0.0004909 is out of range, expected m2 above 0 and at most 3 (is this cm2 or mm2?)",
    ),
    (
        "area_a_m2 = 4.909e-4",
        "area_a_m2 = 4.909e-3",
        "rig.toml:26: cylinder.area_a_m2: 0.004909 is larger than the bore's circle, expected at most 4.9087e-4 m2 for cylinder.bore_m = 0.025",
    ),
    (
        "area_a_m2 = 4.909e-4",
        "area_a_m2 = 4.909e-6",
        "rig.toml:26: cylinder.area_a_m2: 0.000004909 is much smaller than the bore's circle, expected at least 1.4726e-4 m2 for cylinder.bore_m = 0.025",
    ),
    (
        "dead_volume_a_m3 = 1.93e-05",
        "dead_volume_a_m3 = 1",
        "rig.toml:28: cylinder.dead_volume_a_m3: 1 is out of range, expected m3 from 0 to 0.5 (is this litres or cm3?)",
    ),
    (
        "position_zero = \"mid-stroke\"",
        "",
        "rig.toml:23: cylinder.position_zero: missing, expected \"mid-stroke\" or \"end-a\", as there is a stroke",
    ),
    (
        "model = \"energy-balance\"",
        "model = \"polytropic\"",
        "rig.toml:31: chambers.expansion_index: missing, expected a number, as the model is \"polytropic\"",
    ),
    (
        "coulomb_N = 17.5",
        "coulomb_N = 17.5\nstatic_N = 1.0",
        "rig.toml:40: friction.static_N: 1 is far below friction.coulomb_N = 17.5, expected static friction about as large as Coulomb friction, or larger",
    ),
    (
        "noise = 250.0",
        "noise = 0",
        "rig.toml:5: signals.p_a.noise: 0 is out of range, expected a number above 0, in SI units",
    ),
    (
        "noise = 250.0",
        "nois = 250.0",
        "rig.toml:5: signals.p_a.nois: unknown key, expected one of: column, constant, every, unit, noise, resolution, scale, offset (did you mean \"noise\"?)",
    ),
    (
        "\"bar(g)\"",
        "\"bar\"",
        "rig.toml:5: signals.p_a.unit: unit \"bar\" does not say absolute or gauge, expected \"bar(abs)\" or \"bar(g)\"",
    ),
    (
        "\"bar(g)\"",
        "\"mm\"",
        "rig.toml:5: signals.p_a.unit: \"mm\" does not fit, it is a length (m, cm, mm, um, in), expected a pressure (such as Pa(abs), bar(g), psi(abs))",
    ),
    (
        "column = 3",
        "column = -3",
        "rig.toml:6: signals.x.column: is -3, expected a header name or a column number counted from 0",
    ),
    (
        "column = 3",
        "column = \"u_V\"",
        "rig.toml:6: signals.x: reads the same column as signals.u, expected a column of its own",
    ),
    (
        "t = { column = \"t_s\", unit = \"s\" }",
        "",
        "rig.toml:2: signals.t: missing, expected the time column: t = { column = ..., unit = \"s\" }",
    ),
    (
        "\"valve.null_V\" = 0.025",
        "\"valve.nul_V\" = 0.025",
        "rig.toml:42: uncertainty.\"valve.nul_V\": names no number of this rig, expected a number of this rig, did you mean \"valve.null_V\"?",
    ),
    (
        "\"valve.null_V\" = 0.025",
        "valve.null_V = 0.025",
        "rig.toml:42: uncertainty.\"valve\": is a table, expected quotes around the whole key: \"section.key\" = value",
    ),
    (
        "\"valve.null_V\" = 0.025",
        "\"valve.null_V\" = -1",
        "rig.toml:42: uncertainty.\"valve.null_V\": -1 is out of range, expected a standard deviation in volts, 0 to 1000",
    ),
    (
        "\"rig/1\"",
        "\"rig/2\"",
        "rig.toml:1: format: the text \"rig/2\" is unknown, expected format = \"rig/1\"",
    ),
    (
        "[effects.chamber",
        "[board.p_x]\n[effects.chamber",
        "rig.toml:46: board.p_x: no signal of a board, expected one of: x, p_a, p_b, p_s, v (did you mean \"p_s\"?)",
    ),
    (
        "[effects.chamber",
        "[board.v]\noutput_mA = [4, 20]\n[effects.chamber",
        "rig.toml:47: board.v.output_mA: unknown key, expected one of: output_V, range_m_s, sensor (did you mean \"output_V\"?)",
    ),
    (
        "[effects.chamber",
        "[board.p_a]\noutput_V = [0, 24]\nrange_Pa = [0, 1e6]\n[effects.chamber",
        "rig.toml:47: board.p_a.output_V: 24 is out of range, expected V from 0 to 10, which the board's input takes",
    ),
    (
        "[effects.chamber",
        "[board.p_a]\noutput_V = [0, 10]\noutput_mA = [4, 20]\nrange_Pa = [0, 1e6]\n[effects.chamber",
        "rig.toml:47: board.p_a.output_V: stands beside output_mA, expected what the sensor puts out, output_V = [0, 10] or output_mA = [4, 20]",
    ),
    (
        "[effects.chamber",
        "[board.p_a]\noutput_mA = [4, 4]\nrange_Pa = [0, 1e6]\n[effects.chamber",
        "rig.toml:47: board.p_a.output_mA: has the same number twice, expected a list of two numbers that differ, mA from 0 to 20",
    ),
    (
        "[effects.chamber",
        "[board.x]\noutput_V = [0, 10]\n[effects.chamber",
        "rig.toml:46: board.x.range_m: missing, expected two numbers, m from -5 to 5, 0 at mid-stroke",
    ),
    (
        "[effects.chamber",
        "[board.p_b]\nsensor = \"none\"\n[effects.chamber",
        "rig.toml:47: board.p_b.sensor: is the text \"none\", expected one of: absolute, gauge",
    ),
    (
        "[effects.chamber",
        "[board.p_s]\nsensor = \"none\"\nrange_Pa = [0, 1e6]\n[effects.chamber",
        "rig.toml:46: board.p_s: stands beside sensor = \"none\", expected no other key, or a sensor",
    ),
    (
        "mass_kg = 1.740",
        "mass_kg = 1.740\nmass_kg = 2",
        "rig.toml:37: not valid TOML: duplicate key",
    ),
];

#[test]
fn val_each_bad_rig_gets_its_line() {
    for (good, bad, expected) in BAD {
        assert!(FULL.contains(good), "{good} is not in the rig");
        assert_eq!(&message(&FULL.replacen(good, bad, 1)), expected);
    }
}

#[test]
fn prop_sensors_of_a_board_survive_the_way_to_text_and_back() {
    let sensors = "
[board.p_a] # of the port
output_mA = [4, 20]
range_Pa = [0, 1.0e6]
sensor = \"gauge\"
[board.v]
sensor = \"none\"
";
    let text = format!("{FULL}{sensors}");
    let mut rig = parse(&text);
    assert_eq!(rig.board.len(), 2);
    assert_eq!(parse(&rig.to_toml()), rig);
    assert_eq!(Rig::edited(&text, &rig), text);
    rig.board.insert("v".into(), rig.board["p_a"]);
    rig.board.remove("p_a");
    let edited = Rig::edited(FULL, &rig);
    assert!(
        edited.contains("[board.v]\noutput_mA = [4.0, 20.0]"),
        "{edited}"
    );
    // A current is not for the velocity; all else reads back.
    assert!(message(&edited).contains("board.v.output_mA"));
}

#[test]
fn val_unreadable_files_get_one_line() {
    let error = Rig::read("no/such/rig.toml").expect_err("no file");
    assert!(
        error
            .to_string()
            .starts_with("no/such/rig.toml: cannot be read: ")
    );
    let error = Rig::read(env!("CARGO_MANIFEST_DIR")).expect_err("a directory");
    assert!(
        error
            .to_string()
            .ends_with(": is a directory, expected a rig file")
    );
}

#[test]
fn val_rig_files_of_the_real_recordings_are_read_and_written() {
    let names = [
        "gas-cylinder",
        "seal-friction",
        "positioning-stage",
        "plant-valve",
        "vessel-leak",
    ];
    for name in names {
        let path = common::rig_file(&format!("{name}.toml"));
        let rig = Rig::read(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(parse(&rig.to_toml()), rig, "{name}");
    }
    let gas = Rig::read(common::rig_file("gas-cylinder.toml")).expect("a rig");
    let model = gas.chambers.expect("chambers").model;
    assert_eq!(model, ChamberModel::PolytropicProcess);
}

#[test]
fn val_practice_rigs_are_read_as_they_are() {
    let Some(folder) = common::recordings("val_practice_rigs_are_read_as_they_are") else {
        return;
    };
    for case in 1..=12 {
        let path = folder.join(format!("practice/p{case:02}/rig.toml"));
        let rig = Rig::read(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(parse(&rig.to_toml()), rig);
        for key in rig.uncertainty.keys() {
            assert!(rig.uncertainty_sd(key).is_some(), "{key}");
        }
    }
    let text = fs::read_to_string(folder.join("practice/p01/rig.toml")).expect("a rig");
    assert_eq!(parse(&text).valve.expect("a valve").opening_v.len(), 19);
}

/// Every text is either a rig or an error on one line that names the file.
fn check_total(text: &str) -> Result<(), TestCaseError> {
    match Rig::parse(text, "the rig.toml") {
        Ok(rig) => prop_assert_eq!(Rig::parse(&rig.to_toml(), "again"), Ok(rig)),
        Err(error) => {
            let line = error.to_string();
            prop_assert!(line.starts_with("the rig.toml"), "{}", line);
            prop_assert!(!line.chars().any(char::is_control), "{:?}", line);
        }
    }
    Ok(())
}

proptest! {
    #[test]
    fn prop_any_text_is_a_rig_or_one_line(text in ".*") {
        check_total(&text)?;
    }

    #[test]
    fn prop_a_mutated_rig_is_a_rig_or_one_line(
        places in prop::collection::vec((0..FULL.len(), any::<u8>(), 0..4_usize), 1..4)
    ) {
        let mut bytes = FULL.as_bytes().to_vec();
        for (place, byte, removed) in places {
            let start = place.min(bytes.len());
            let end = (start + removed).min(bytes.len());
            bytes.splice(start..end, [byte]);
        }
        check_total(&String::from_utf8_lossy(&bytes))?;
    }

    #[test]
    fn prop_a_number_in_any_key_is_a_rig_or_one_line(value in any::<f64>(), row in 0..45_usize) {
        let mut lines: Vec<String> = FULL.lines().map(String::from).collect();
        if let Some((key, _)) = lines[row].split_once(" = ") {
            lines[row] = format!("{key} = {value:?}").replace("NaN", "nan");
        }
        check_total(&lines.join("\n"))?;
    }

    #[test]
    fn prop_replaced_values_survive_the_way_to_text_and_back(
        scale in 0.5..2.0_f64, mass in 0.1..100.0_f64, null in -5.0..5.0_f64
    ) {
        let values = BTreeMap::from([
            ("valve.opening_V".to_owned(), scale),
            ("carriage.mass_kg".to_owned(), mass),
            ("valve.null_V".to_owned(), null),
        ]);
        let rig = parse(FULL).with_values(&values);
        prop_assert_eq!(&parse(&rig.to_toml()), &rig);
        prop_assert_eq!(rig.value("carriage.mass_kg"), Some(mass));
    }
}

#[test]
fn prop_a_table_of_more_points_than_the_model_holds_is_refused_with_the_limit() {
    use model_core::valve::TABLE_CAPACITY;
    let read = |count: usize| {
        let column = |step: f64| {
            let points: Vec<f64> = (0..count).map(|at| at as f64 * step).collect();
            format!("{points:?}")
        };
        let text = FULL
            .replace("[0, 0.5, 1.0]", &column(0.02))
            .replace("[7.5e-08, 1.1e-07, 1.2e-05]", &column(1e-7))
            .replace("[7.7e-08, 1.1e-07, 1.3e-05]", &column(1e-7));
        Rig::parse(&text, "rig.toml")
    };
    assert!(read(TABLE_CAPACITY).is_ok());
    let fault = read(TABLE_CAPACITY + 1).unwrap_err().to_string();
    let expected = format!(
        "rig.toml:20: valve.opening_V: has {} points, expected {TABLE_CAPACITY} at most: thin the table",
        TABLE_CAPACITY + 1
    );
    assert!(fault.starts_with(&expected), "{fault}");
}
