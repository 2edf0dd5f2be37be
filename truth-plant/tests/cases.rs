//! Cases: same seed same bytes, the form of the practice rigs, ablation.

#![expect(clippy::unwrap_used, reason = "helpers of tests may panic as tests do")]

use std::collections::BTreeSet;
use std::path::PathBuf;

use truth_plant::effects::names;
use truth_plant::plant::TICK_S;
use truth_plant::{Case, Kind, Nature, Request, Strength, Truth, draw};

fn single(name: &str) -> Case {
    Request::new(5, Kind::Single)
        .with_effect(name)
        .unwrap()
        .with_strength(Strength::Medium)
        .with_noise(1.0)
        .draw()
}

/// A column of a recording's text.
fn column(text: &str, name: &str) -> Vec<f64> {
    let mut lines = text.lines();
    let header = lines.next().unwrap();
    let position = header.split(',').position(|column| column == name).unwrap();
    lines
        .map(|line| line.split(',').nth(position).unwrap().parse().unwrap())
        .collect()
}

fn recordings(case: &Case) -> impl Iterator<Item = &(String, String)> {
    case.train.iter().chain(&case.held_out)
}

fn rms_difference(first: &[f64], second: &[f64]) -> f64 {
    let square: f64 = first.iter().zip(second).map(|(a, b)| (a - b).powi(2)).sum();
    (square / first.len() as f64).sqrt()
}

#[test]
fn prop_the_same_seed_gives_the_same_bytes() {
    let [first, second] = [draw(3, Kind::Pair), draw(3, Kind::Pair)];
    assert_eq!(first.rig_toml, second.rig_toml);
    assert_eq!(first.train, second.train);
    assert_eq!(first.held_out, second.held_out);
    assert_eq!(first.truth, second.truth);
    assert_ne!(first.train[0].1, draw(4, Kind::Pair).train[0].1);
}

#[test]
fn prop_every_kind_holds_what_it_says() {
    for kind in Kind::ALL {
        let truth = Request::new(21, kind).truth();
        let effects = &truth.effects;
        let count = match kind {
            Kind::Nothing | Kind::Parameters => 0,
            Kind::Pair => 2,
            Kind::Dirty => 3,
            _ => 1,
        };
        assert_eq!(effects.len(), count, "{kind}");
        assert_eq!(truth.off_list, kind == Kind::OffList, "{kind}");
        assert_eq!(truth.observable, kind != Kind::Unobservable, "{kind}");
        for effect in effects {
            assert_eq!(effect.onset.is_some(), kind == Kind::Onset, "{kind}");
            let immaterial = effect.strength == Strength::Immaterial;
            assert_eq!(immaterial, kind == Kind::Dirty, "{kind}");
            assert!(!effect.places.is_empty() && !effect.parameters.is_empty());
        }
        let text = serde_json::to_string(&truth).unwrap();
        assert_eq!(serde_json::from_str::<Truth>(&text).unwrap(), truth);
    }
}

#[test]
fn prop_taking_an_effect_out_changes_nothing_else() {
    let with = single("piston-leakage");
    let without = with.without("piston-leakage").unwrap();
    assert_eq!(with.rig_toml, without.rig_toml);
    assert_eq!(with.truth.plant, without.truth.plant);
    assert!(without.truth.effects.is_empty());
    for ((_, with), (name, without)) in recordings(&with).zip(recordings(&without)) {
        let first = |text: &str| text.lines().nth(1).unwrap().to_owned();
        // The first row is before the effect could act: rig, start and noise.
        assert_eq!(first(with), first(without), "{name}");
        let [a, b] = [with, without].map(|text| column(text, "p_a_Pa"));
        assert!(rms_difference(&a, &b) > 1e3, "{name}");
    }
    assert!(with.without("tube-line").is_none());
}

#[test]
fn prop_an_effect_is_present_in_its_window_only() {
    let case = Request::new(8, Kind::Onset)
        .with_effect("pressure-sensor-offset")
        .unwrap()
        .with_strength(Strength::Strong)
        .draw();
    let without = case.without("pressure-sensor-offset").unwrap();
    let effect = &case.truth.effects[0];
    let onset = effect.onset.as_ref().unwrap();
    // The offset does not act on the motion: the rest must be equal to the byte.
    for ((name, with), (_, without)) in recordings(&case).zip(recordings(&without)) {
        let window = onset.windows[name];
        let mut inside = 0_usize;
        for (row, (with, without)) in with.lines().zip(without.lines()).skip(1).enumerate() {
            let time_s = row as f64 * TICK_S;
            let present = time_s >= window.from_s - 1e-9 && time_s < window.to_s - 1e-9;
            assert_eq!(with != without, present, "{name} at {time_s} s");
            inside += usize::from(present);
        }
        let share = inside as f64 / (with.lines().count() - 1) as f64;
        assert!(
            (share - onset.present_share).abs() < 1e-3,
            "{name}: {share}"
        );
    }
}

#[test]
fn prop_an_unobservable_effect_does_not_show() {
    // The sensor's noise and the step of its converter.
    let noise_pa = 260.0;
    let case = Request::new(7, Kind::Unobservable)
        .with_effect("end-cushion")
        .unwrap()
        .with_noise(1.0)
        .draw();
    let without = case.without("end-cushion").unwrap();
    for ((file, with), (_, without)) in recordings(&case).zip(recordings(&without)) {
        for signal in ["p_a_Pa", "p_b_Pa"] {
            let [a, b] = [with, without].map(|text| column(text, signal));
            let difference_pa = rms_difference(&a, &b);
            assert!(difference_pa < noise_pa, "{file}: {difference_pa} Pa");
        }
    }
}

/// All keys of a TOML text, with their sections.
fn keys(text: &str) -> BTreeSet<String> {
    let table: toml::Table = text.parse().unwrap();
    let mut keys = BTreeSet::new();
    for (section, value) in table {
        match value {
            toml::Value::Table(inner) => {
                keys.extend(inner.keys().map(|key| format!("{section}.{key}")));
            }
            _ => {
                keys.insert(section);
            }
        }
    }
    keys
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_rig_file_and_columns_are_those_of_the_practice_rigs() {
    let beside = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/recordings");
    let root = std::env::var_os("PNEUMA_RECORDINGS").map_or(beside, PathBuf::from);
    let folder = root.join("practice/p01");
    let Ok(theirs) = std::fs::read_to_string(folder.join("rig.toml")) else {
        println!("SKIPPED: no recordings in {}", folder.display());
        return;
    };
    let header = std::fs::read_to_string(folder.join("train-1.csv")).unwrap();
    let header = header.lines().next().unwrap();
    // p01 records the supply pressure; not every case does.
    let case = (1..20)
        .map(|seed| draw(seed, Kind::Nothing))
        .find(|case| case.rig_toml.contains("p_s = "))
        .unwrap();
    assert_eq!(keys(&case.rig_toml), keys(&theirs));
    assert_eq!(case.train.len(), 4);
    assert_eq!(case.held_out.len(), 2);
    for (name, text) in recordings(&case) {
        assert_eq!(text.lines().next().unwrap(), header, "{name}");
        let rows = text.lines().count() - 1;
        assert!((6000..=10_000).contains(&rows), "{name}: {rows}");
        // Where the carriage is and what the sensors say stays in the rig.
        let positions = column(text, "x_m");
        assert!(
            positions.iter().all(|position_m| position_m.abs() < 0.25),
            "{name}"
        );
        let pressures = column(text, "p_a_Pa");
        assert!(
            pressures
                .iter()
                .all(|pressure_pa| (90e3..2e6).contains(pressure_pa))
        );
    }
}

#[test]
fn prop_every_effect_changes_a_recording() {
    // Pulses to one end, then a rest and a slow push back.
    let commands_v: Vec<f64> = (0..4000_u32)
        .map(|tick| match tick {
            0..1500 if tick % 500 < 200 => 7.0,
            0..2500 => 5.0,
            _ => 5.0 - 0.6 * f64::from(tick - 2500) * TICK_S,
        })
        .collect();
    let mut without = Request::new(13, Kind::Nothing).with_noise(1.0).plant();
    let without: Vec<_> = commands_v.iter().map(|v| without.step(*v)).collect();
    for name in names() {
        let mut with = Request::new(13, Kind::Single)
            .with_effect(name)
            .unwrap()
            .with_strength(Strength::Strong)
            .with_noise(1.0)
            .plant();
        let mut farthest = [0.0_f64; 3];
        for (command_v, b) in commands_v.iter().zip(&without) {
            let a = with.step(*command_v);
            let gaps = [
                (a.pressure_pa[0] - b.pressure_pa[0]) / 244.0,
                (a.pressure_pa[1] - b.pressure_pa[1]) / 244.0,
                (a.position_m - b.position_m) / 7.6e-6,
            ];
            for (farthest, gap) in farthest.iter_mut().zip(gaps) {
                *farthest = farthest.max(gap.abs());
            }
        }
        let worst = farthest.into_iter().fold(0.0, f64::max);
        assert!(worst.is_finite() && worst > 5.0, "{name}: {farthest:?}");
    }
}

/// A shop floor moves every recording by more than its noise, and takes nothing from the
/// laboratory.
#[test]
#[ignore = "long: cargo xtask test --all"]
fn prop_a_shop_floor_lies_near_the_rig_file_and_not_on_it() {
    let request = Request::new(7, Kind::Nothing).with_noise(0.1);
    let laboratory = request.clone().with_nature(Nature::Laboratory).draw();
    assert_eq!(laboratory.rig_toml, request.draw().rig_toml);
    assert_eq!(laboratory.train, request.draw().train);
    let floor = request.with_nature(Nature::ShopFloor).draw();
    assert!(floor.truth.effects.is_empty());
    assert_eq!(floor.truth.nature, Nature::ShopFloor);
    assert_ne!(floor.train, laboratory.train);
    assert_ne!(floor.rig_toml, laboratory.rig_toml);
    let drawn: Vec<String> = (0..3)
        .map(|seed| Request::new(seed, Kind::Nothing).with_nature(Nature::ShopFloor))
        .map(|request| request.draw().rig_toml)
        .collect();
    let points = |rig: &String| {
        let line = rig.lines().find(|line| line.starts_with("opening_V"));
        line.map_or(0, |line| line.matches(',').count())
    };
    assert!(drawn.iter().any(|rig| points(rig) != points(&drawn[0])));
}
