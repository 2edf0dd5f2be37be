//! Channels that cannot be true, made from recordings of another plant's axes, and healthy ones that
//! look a little like them.

use diagnosis::inspect::{Inspection, inspect};
use grey_box::random::Noise;
use grey_box::recording::Recording;
use grey_box::rig::Rig;
use truth_plant::{Kind, Request};

fn drawn() -> (Rig, Recording) {
    let (rig, mut recordings) = all_drawn();
    (rig, recordings.swap_remove(0))
}

fn all_drawn() -> (Rig, Vec<Recording>) {
    let case = Request::new(11, Kind::Nothing).draw();
    let rig = Rig::parse(&case.rig_toml, "rig.toml").expect("a rig file");
    let read = |(name, text): &(String, String)| {
        Recording::read_from(text.as_bytes(), name, None, &rig.signals).expect("a recording")
    };
    let recordings = case.train.iter().map(read).collect();
    (rig, recordings)
}

/// What inspection says of a recording in which one signal is another.
fn with(signal: &str, change: impl Fn(&mut Vec<f64>)) -> Inspection {
    let (rig, mut recording) = drawn();
    change(recording.signals.get_mut(signal).expect("the signal"));
    inspect(&rig, &recording)
}

fn is_said(inspection: &Inspection, signal: &str, said: &str) -> bool {
    let mut faults = inspection.faults.iter();
    faults.any(|fault| fault.signal == signal && fault.sentence.contains(said))
}

/// A value with noise.
fn noisy(values: &mut [f64], about: f64, deviation: f64) {
    let mut noise = Noise::new(3, 0);
    for value in values {
        *value = about + deviation * noise.normal();
    }
}

#[test]
fn prop_the_recording_that_all_of_these_are_made_from_has_no_fault() {
    let (rig, recording) = drawn();
    let inspection = inspect(&rig, &recording);
    assert!(inspection.faults.is_empty(), "{:?}", inspection.faults);
}

#[test]
fn val_a_channel_that_shows_noise_alone_is_dead() {
    let gauge = with("p_a", |values| noisy(values, 101_325.0, 250.0));
    assert!(is_said(&gauge, "p_a", "nothing else while x and p_b move"));
    let position = with("x", |values| noisy(values, 0.01, 4e-6));
    assert!(is_said(&position, "x", "nothing else while v moves"));
    let velocity = with("v", |values| noisy(values, 0.0, 1.5e-3));
    assert!(is_said(&velocity, "v", "nothing else while x moves"));
}

#[test]
fn val_two_columns_of_one_sensor_are_said() {
    let (rig, mut recording) = drawn();
    let a = recording.signal("p_a").expect("a gauge").to_vec();
    recording.signals.insert("p_b".into(), a);
    let inspection = inspect(&rig, &recording);
    assert!(is_said(
        &inspection,
        "p_b",
        "both columns are of one sensor"
    ));
}

#[test]
fn val_a_gauge_that_is_clipped_at_both_ends_is_saturated() {
    let inspection = with("p_a", |values| {
        let (low, high) = ends(values, 0.1);
        values
            .iter_mut()
            .for_each(|one| *one = one.clamp(low, high));
    });
    assert!(is_said(&inspection, "p_a", "is saturated at"));
}

/// Values that a part of the rows lies below, and above.
fn ends(values: &[f64], part: f64) -> (f64, f64) {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let place = (part * sorted.len() as f64) as usize;
    (sorted[place], sorted[sorted.len() - 1 - place])
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_spikes_in_the_first_and_the_last_rows_are_spikes() {
    for (row, name) in [(0, "first"), (2, "third"), (1, "second")] {
        for is_last in [false, true] {
            let inspection = with("p_a", |values| {
                let place = if is_last { values.len() - 1 - row } else { row };
                values[place] += 1.5e5;
            });
            assert!(
                is_said(&inspection, "p_a", "has a spike"),
                "{name} {is_last}"
            );
        }
    }
}

#[test]
fn val_dropouts_are_found_whatever_their_number() {
    for count in [1, 6, 20] {
        let inspection = with("p_a", |values| {
            for dropout in 0..count {
                let begin = 150 + dropout * 120;
                values[begin..begin + 20].fill(101_325.0);
            }
        });
        let faults = inspection.faults.iter();
        let dropouts = faults.filter(|fault| fault.sentence.contains("drops out for 20 rows"));
        assert_eq!(dropouts.count(), count);
    }
}

#[test]
fn val_a_command_that_never_crosses_the_null_does_not_move_an_axis_to_and_fro() {
    let (rig, recordings) = all_drawn();
    let said = recordings.into_iter().filter(|recording| {
        let mut weak = recording.clone();
        let command = weak.signals.get_mut("u").into_iter().flatten();
        command.for_each(|one| *one *= 0.1);
        is_said(&inspect(&rig, &weak), "u", "never crosses the valve's null")
    });
    // Those that do not go to and fro say nothing.
    assert!(said.count() > 0);
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_factors_of_units_between_position_and_velocity_are_said() {
    let (rig, recording) = drawn();
    for factor in [2.0, 4.0, 0.394, 25.4] {
        let inspection = with("x", |values| {
            values.iter_mut().for_each(|one| *one *= factor);
        });
        let said = "the unit or the sign of one is wrong";
        assert!(is_said(&inspection, "v", said) || factor > 10.0, "{factor}");
        assert!(!inspection.faults.is_empty(), "{factor}");
    }
    let mut in_milliseconds = recording;
    let time_s = in_milliseconds.time_s.iter_mut();
    time_s.for_each(|time| *time *= 1000.0);
    let inspection = inspect(&rig, &in_milliseconds);
    assert!(is_said(&inspection, "v", "the unit of t is probably wrong"));
}

/// A regulator is set to another pressure, and the chambers follow it.
#[test]
fn prop_a_supply_that_is_set_otherwise_is_no_fault_of_a_gauge() {
    let (rig, recording) = drawn();
    let was_pa = recording.signal("p_s").expect("a gauge")[0];
    for set_pa in (4..10).map(|step| 1e5 * f64::from(step)) {
        let mut set = recording.clone();
        for name in ["p_s", "p_a", "p_b"] {
            let signal = set.signals.get_mut(name).into_iter().flatten();
            signal.for_each(|one| *one *= set_pa / was_pa);
        }
        let inspection = inspect(&rig, &set);
        assert!(inspection.faults.is_empty(), "{:?}", inspection.faults);
    }
}

#[test]
fn val_counts_that_are_lost_without_a_velocity_are_said() {
    let (rig, mut recording) = drawn();
    recording.signals.remove("v");
    let sound = inspect(&rig, &recording);
    assert!(sound.faults.is_empty(), "{:?}", sound.faults);
    let middle = recording.len() / 2;
    let position = recording.signals.get_mut("x").expect("a position");
    position[middle..].iter_mut().for_each(|one| *one += 5e-3);
    let inspection = inspect(&rig, &recording);
    assert!(
        is_said(&inspection, "x", "counts were lost"),
        "{:?}",
        inspection.faults
    );
}

/// Two closed chambers of a cylinder, compressed in turns.
fn gas_spring(direction: f64) -> Inspection {
    let rig = "format = \"rig/1\"\n[signals]\nt = { column = \"t\", unit = \"s\" }\n\
               x = { column = \"x\", unit = \"m\" }\np_a = { column = \"a\", unit = \"Pa(abs)\" }\n\
               p_b = { column = \"b\", unit = \"Pa(abs)\" }\n[cylinder]\nstroke_m = 0.5\n\
               bore_m = 0.025\narea_a_m2 = 4.9e-4\narea_b_m2 = 4.9e-4\ndead_volume_a_m3 = 2e-5\n\
               dead_volume_b_m3 = 2e-5\nposition_zero = \"mid-stroke\"\n[chambers]\n\
               model = \"energy-balance\"\nheat_transfer_charging_W_m2K = 50.0\n\
               heat_transfer_discharging_W_m2K = 20.0\n";
    let rig = Rig::parse(rig, "rig.toml").expect("a rig");
    let mut text = "t,x,a,b\n".to_owned();
    let mut noise = Noise::new(9, 0);
    for row in 0..3000 {
        let time_s = 1e-2 * f64::from(row);
        let x_m = 0.15 * (1.3 * time_s).sin();
        let pressure = |length_m: f64| 3e5 * 0.25 / length_m + 300.0 * noise.normal();
        let [a, b] = [0.25 + x_m, 0.25 - x_m].map(pressure);
        text += &format!("{time_s},{},{a},{b}\n", direction * x_m);
    }
    let recording = Recording::read_from(text.as_bytes(), "run.csv", None, &rig.signals);
    inspect(&rig, &recording.expect("a recording"))
}

#[test]
fn val_a_gas_spring_that_is_read_the_wrong_way_round_is_said() {
    let sound = gas_spring(1.0);
    assert!(sound.faults.is_empty(), "{:?}", sound.faults);
    let reversed = gas_spring(-1.0);
    assert!(
        is_said(&reversed, "x", "has the wrong sign"),
        "{:?}",
        reversed.faults
    );
}

/// Gauges that count from the surroundings have a live zero too.
#[test]
fn val_a_live_zero_of_gauge_pressures_is_noted() {
    let (rig, mut recording) = drawn();
    let text = rig.to_toml().replace("Pa(abs)", "Pa(g)");
    let gauges = Rig::parse(&text, "rig.toml").expect("a rig of gauges");
    let ambient_pa = rig.ambient_pressure_pa();
    for name in ["p_s", "p_a", "p_b"] {
        let signal = recording.signals.get_mut(name).into_iter().flatten();
        signal.for_each(|one| *one = ambient_pa + 2e5 + 0.8 * (*one - ambient_pa));
    }
    let inspection = inspect(&gauges, &recording);
    let notes = inspection.notes.iter();
    let mut said = notes.chain(inspection.faults.iter().map(|fault| &fault.sentence));
    let what = "4 to 20 mA over 10 bar seem to be read as 0 to 20 mA";
    assert!(said.any(|said| said.contains(what)), "{inspection:?}");
}
