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
