//! Channels that are late against each other, on axes of another plant.

use diagnosis::inspect::lateness::remarks;
use grey_box::laws::median_step_s;
use grey_box::recording::Recording;
use grey_box::rig::Rig;
use truth_plant::{Kind, Nature, Request};

/// A rig, and its recordings.
fn drawn(seed: u64, nature: Nature) -> (Rig, Vec<Recording>) {
    let case = Request::new(seed, Kind::Nothing).with_nature(nature).draw();
    let rig = Rig::parse(&case.rig_toml, "rig.toml").expect("a rig file");
    let read = |(name, text): &(String, String)| {
        Recording::read_from(text.as_bytes(), name, None, &rig.signals).expect("a recording")
    };
    let recordings = case.train.iter().map(read).collect();
    (rig, recordings)
}

/// The same recording with channels that are later by so much.
fn late(recording: &Recording, signals: &[&str], late_s: f64) -> Recording {
    let mut late = recording.clone();
    let rows = (late_s / median_step_s(&recording.time_s)).round() as usize;
    for name in signals {
        let Some(signal) = late.signals.get_mut(*name) else {
            continue;
        };
        let first = signal[0];
        signal.rotate_right(rows);
        signal[..rows].fill(first);
    }
    late
}

/// The time that a remark states, ms.
fn stated_ms(remark: &str) -> f64 {
    let before = remark.split(" ± ").next().unwrap_or("");
    let number = before.rsplit(' ').next().unwrap_or("");
    number.parse().expect("a time in the remark")
}

/// A recording in which little moves says nothing; what the others say is right.
#[test]
fn val_a_late_position_a_late_gauge_and_a_late_command_are_said_with_their_times() {
    let (rig, recordings) = drawn(11, Nature::Laboratory);
    for (signals, late_s, named, within_ms) in [
        (&["x", "v"][..], 0.008, "x is late against p_a and p_b", 2.0),
        (&["p_a", "p_b"], 0.006, "late against x", 2.0),
        (&["p_b"], 0.006, "p_b is late against x", 2.0),
        // Spool and rounding of rows take a part of it.
        (&["u"], 0.006, "u is logged late", 3.0),
    ] {
        let said: Vec<String> = recordings
            .iter()
            .flat_map(|one| remarks(&rig, &late(one, signals, late_s)))
            .collect();
        assert!(!said.is_empty(), "{signals:?}");
        for remark in &said {
            assert!(remark.contains(named), "{signals:?}: {remark}");
            let off_ms = (stated_ms(remark) - 1e3 * late_s).abs();
            assert!(off_ms < within_ms, "{signals:?}: {remark}");
        }
    }
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn prop_nothing_is_late_on_axes_whose_channels_are_not() {
    for (seed, nature) in [
        (11, Nature::Laboratory),
        (12, Nature::Laboratory),
        (301, Nature::ShopFloor),
        (302, Nature::ShopFloor),
        (303, Nature::ShopFloor),
    ] {
        let (rig, recordings) = drawn(seed, nature);
        for recording in &recordings[..2] {
            let said = remarks(&rig, recording);
            assert!(said.is_empty(), "{seed}: {said:?}");
        }
    }
}
