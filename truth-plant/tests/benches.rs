//! The test benches as a whole: files, repeatability, ranges.

use truth_plant::bench::{BenchCase, Experiment, draw};

/// A column of a recording.
fn column(case: &BenchCase, file: &str, name: &str) -> Vec<f64> {
    let (_, text) = case
        .recordings
        .iter()
        .find(|(recording, _)| recording == file)
        .expect("the recording exists");
    let mut lines = text.lines();
    let position = lines
        .next()
        .and_then(|header| header.split(',').position(|item| item == name))
        .expect("the column exists");
    let number = |row: &str| row.split(',').nth(position)?.parse().ok();
    lines
        .map(|row| number(row).expect("the row has a number"))
        .collect()
}

#[test]
fn prop_equal_seeds_give_equal_bytes_and_others_do_not() {
    for experiment in Experiment::ALL {
        let case = draw(experiment, 11);
        assert_eq!(case, draw(experiment, 11), "{experiment}");
        let other = draw(experiment, 12);
        assert_ne!(case.truth, other.truth, "{experiment}");
        assert_ne!(case.recordings, other.recordings, "{experiment}");
    }
}

#[test]
fn prop_a_rig_file_names_columns_that_its_recordings_have() {
    for experiment in Experiment::ALL {
        let case = draw(experiment, 3);
        let rig: toml::Table = case.rig_toml.parse().unwrap();
        assert_eq!(rig["format"].as_str(), Some("rig/1"));
        let signals = rig["signals"].as_table().unwrap();
        for (name, text) in &case.recordings {
            let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
            assert_eq!(header.len(), signals.len(), "{experiment} {name}");
            for (signal, declared) in signals {
                let column = declared["column"].as_str().unwrap();
                assert!(header.contains(&column), "{experiment} {name}: {signal}");
            }
        }
    }
}

#[test]
fn prop_what_a_bench_measures_is_wrong_in_its_rig_file_within_three_deviations() {
    for experiment in Experiment::ALL {
        let case = draw(experiment, 8);
        let rig: toml::Table = case.rig_toml.parse().unwrap();
        let uncertainty = rig["uncertainty"].as_table().unwrap();
        for (key, truth) in &case.truth {
            let Some((section, name)) = key.split_once('.') else {
                continue;
            };
            let stated = rig.get(section).and_then(|section| section.get(name));
            let (Some(stated), Some(deviation)) = (stated, uncertainty.get(key)) else {
                // Not stated: all is left to the experiment.
                assert!(stated.is_none(), "{experiment}: {key} is stated as exact");
                continue;
            };
            let (stated, deviation) = (stated.as_float().unwrap(), deviation.as_float().unwrap());
            let scale = if key.ends_with("_V") { 1.0 } else { *truth };
            let wrong = (stated / scale - truth / scale).abs() / deviation;
            assert!(wrong > 1e-3 && wrong < 3.0, "{experiment} {key}: {wrong}");
        }
    }
}

#[test]
fn prop_all_benches_of_a_seed_measure_one_axis() {
    let [valve, vessel] =
        [Experiment::ValveFlow, Experiment::VesselFlow].map(|experiment| draw(experiment, 6).truth);
    let spool = draw(Experiment::Spool, 6).truth;
    let equal = |first: f64, second: f64| assert_eq!(first.to_bits(), second.to_bits());
    equal(valve["valve.null_V"], spool["valve.null_V"]);
    for opening in ["1.0", "2.0", "3.0", "4.5"] {
        let key = format!("supply_area_m2@{opening}");
        equal(valve[&key], vessel[&key]);
    }
}

#[test]
fn prop_a_vessel_is_filled_and_emptied_again() {
    let case = draw(Experiment::VesselFlow, 6);
    for (name, _) in &case.recordings {
        let pressure_pa = column(&case, name, "p_a_Pa");
        let supply_pa = column(&case, name, "p_s_Pa")[0];
        let most_pa = pressure_pa.iter().copied().fold(0.0, f64::max);
        assert!(most_pa > 0.97 * supply_pa, "{name}: {most_pa} Pa");
    }
}

#[test]
fn prop_a_name_of_an_experiment_can_be_read() {
    for experiment in Experiment::ALL {
        assert_eq!(experiment.name().parse(), Ok(experiment));
    }
    let error = "flow".parse::<Experiment>().unwrap_err();
    assert!(error.to_string().contains("valve-flow"), "{error}");
}
