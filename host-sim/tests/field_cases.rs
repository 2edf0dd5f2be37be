//! Situations from the field (`../shared/cases`), as `pneuma inspect` sees them: what is wrong
//! with a recording is said, and nothing is said of the practice and real recordings (see
//! `inspection.rs`).

mod common;

use std::path::{Path, PathBuf};

use diagnosis::inspect::{Fault, FaultKind, Inspection, inspect};
use host_sim::recording::Recording;
use host_sim::rig::Rig;

fn look(case: &Path, file: &str) -> Inspection {
    let rig = Rig::read(case.join("rig.toml")).unwrap_or_else(|error| panic!("{error}"));
    let recording = Recording::read(case.join(file), &rig.signals);
    inspect(&rig, &recording.unwrap_or_else(|error| panic!("{error}")))
}

fn of_kind(inspection: &Inspection, kind: FaultKind) -> Vec<&Fault> {
    let faults = inspection.faults.iter();
    faults.filter(|fault| fault.kind == kind).collect()
}

fn case(name: &str) -> Option<PathBuf> {
    Some(common::cases(name)?.join(name))
}

#[test]
fn val_every_spike_is_named_whatever_their_number() {
    let Some(case) = case("spikes") else { return };
    let mut files = 0;
    for entry in std::fs::read_dir(&case).expect("a folder") {
        let name = entry
            .expect("an entry")
            .file_name()
            .to_string_lossy()
            .into_owned();
        let Some(count) = name
            .strip_prefix('s')
            .and_then(|rest| rest.strip_suffix(".csv"))
        else {
            continue;
        };
        let count: usize = count.parse().expect("a number");
        let inspection = look(&case, &name);
        let spikes = of_kind(&inspection, FaultKind::Spike);
        assert_eq!(spikes.len(), count, "{name}: {:?}", inspection.faults);
        assert!(
            spikes
                .iter()
                .all(|spike| spike.signal == "p_a" && spike.first_line == spike.last_line)
        );
        assert_eq!(inspection.faults.len(), count, "{name}");
        files += 1;
    }
    assert!(files > 3);
    let Some(emi) = common::cases("emi").map(|cases| cases.join("D-emi-spikes")) else {
        return;
    };
    for name in ["train-1.csv", "held-1.csv"] {
        assert_eq!(
            of_kind(&look(&emi, name), FaultKind::Spike).len(),
            12,
            "{name}"
        );
    }
}

#[test]
fn val_channels_that_are_repeated_at_a_lower_rate_are_named() {
    for (name, file) in [
        ("pressures-held-100Hz", "run.csv"),
        ("D-pressures-held-100Hz", "train-2.csv"),
        ("D-pressures-held-100Hz", "held-1.csv"),
    ] {
        let Some(case) = case(name) else { return };
        let inspection = look(&case, file);
        let held = of_kind(&inspection, FaultKind::Held);
        let signals: Vec<&str> = held.iter().map(|fault| fault.signal.as_str()).collect();
        assert_eq!(signals, ["p_a", "p_b", "p_s"], "{name}");
        assert!(
            held.iter()
                .all(|fault| fault.sentence.contains("every 10 rows")),
            "{held:?}"
        );
    }
}

#[test]
fn val_lost_rows_and_lost_counts_are_leaps() {
    let Some(case) = case("gap-renumbered") else {
        return;
    };
    let inspection = look(&case, "run.csv");
    let leaps = of_kind(&inspection, FaultKind::Leap);
    assert_eq!(leaps.len(), 1, "{:?}", inspection.faults);
    assert_eq!((leaps[0].signal.as_str(), leaps[0].last_line), ("x", 2002));
    assert!((leaps[0].to_s - 2.0).abs() < 1e-9 && leaps[0].sentence.contains("rows are missing"));
    let Some(case) = self::case("encoder-lost-counts") else {
        return;
    };
    let inspection = look(&case, "run.csv");
    let leaps = of_kind(&inspection, FaultKind::Leap);
    assert_eq!(inspection.faults.len(), 1, "{:?}", inspection.faults);
    assert_eq!((leaps[0].signal.as_str(), leaps[0].last_line), ("x", 3001));
    let Some(case) = self::case("gap-150ms") else {
        return;
    };
    let inspection = look(&case, "run.csv");
    assert_eq!(
        (inspection.timing.gap_count, inspection.faults),
        (1, Vec::new())
    );
}

#[test]
fn val_gauges_that_contradict_the_supply_are_reconciled_by_the_mistake_that_was_made() {
    for (name, said) in [
        (
            "gauge-called-absolute",
            "gauge pressure declared as absolute",
        ),
        (
            "absolute-called-gauge",
            "absolute pressure declared as gauge",
        ),
        (
            "milliampere-live-zero-forgotten",
            "4 to 20 mA over 10 bar seem to be read as 0 to 20 mA",
        ),
    ] {
        let Some(case) = case(name) else { return };
        let inspection = look(&case, "run.csv");
        // A regulator that is set otherwise does the same to all gauges: what inspection notes, the
        // diagnosis tells by the motion (`field_diagnoses.rs`).
        let faults = inspection.faults.iter().map(|fault| &fault.sentence);
        let sentences: Vec<&String> = faults.chain(&inspection.notes).collect();
        assert!(
            sentences.iter().any(|sentence| sentence.contains(said)),
            "{name}: {sentences:?}"
        );
    }
}

#[test]
fn val_chambers_that_do_not_hold_gas_are_not_saturated() {
    let Some(case) = case("S-vented") else { return };
    for file in ["run1.exp", "run2.exp"] {
        let inspection = look(&case, file);
        assert_eq!(inspection.faults.len(), 2, "{:?}", inspection.faults);
        assert!(
            inspection
                .faults
                .iter()
                .all(|fault| fault.sentence.contains("does not hold gas"))
        );
    }
}

#[test]
fn val_signs_wires_and_units_that_contradict_each_other_are_said() {
    for (name, signal) in [
        ("pa-pb-swapped", "x"),
        ("u-reversed", "u"),
        ("v-reversed-only", "v"),
        ("x-in-cm-as-mm", "v"),
        ("x-reversed", "x"),
        ("pa-clipped", "p_a"),
        ("pa-stuck", "p_a"),
    ] {
        let Some(case) = case(name) else { return };
        let inspection = look(&case, "run.csv");
        assert!(
            inspection.faults.iter().any(|fault| fault.signal == signal),
            "{name}"
        );
    }
}

/// Rows that were sampled evenly are put where they belong, and that is said.
#[test]
fn val_stamps_of_a_pc_that_jitter_are_said() {
    for (name, file) in [
        ("jitter-pc", "run.csv"),
        ("D-jitter-pc", "train-1.csv"),
        ("D-jitter-pc", "train-4.csv"),
        ("D-jitter-pc", "held-1.csv"),
    ] {
        let Some(case) = case(name) else { return };
        let inspection = look(&case, file);
        assert_eq!(inspection.faults, [], "{name}");
        let said = |note: &String| note.contains("the time stamps jitter");
        assert!(
            inspection.notes.iter().any(said),
            "{name} {file}: {:?}",
            inspection.notes
        );
        assert!(inspection.timing.jitter_s < 1e-6, "{name}");
    }
}
