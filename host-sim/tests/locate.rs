//! Where a misfit sits, on residuals that were made for it.

use std::collections::BTreeMap;

use diagnosis::locate::{Located, locate};
use host_sim::laws::{Law, Track};
use host_sim::recording::Recording;
use host_sim::rig::Rig;

/// A bench that measures force: one output, no states.
const BENCH: &str = r#"
format = "rig/1"
[signals]
t = { column = "t", unit = "s" }
x = { column = "x", unit = "m" }
force = { column = "force", unit = "N" }
[carriage]
mass_kg = 2.0
"#;

const ROWS: usize = 8_000;
const STEP_S: f64 = 1e-3;

/// A fixed sequence of standard normals: sums of twelve uniforms.
struct Normals(u64);

impl Normals {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005);
        self.0 = self.0.wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn next(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

fn time(row: usize) -> f64 {
    row as f64 * STEP_S
}

/// Two sines that share no period: velocity and position do not follow from
/// each other or from the time.
fn position(time_s: f64) -> f64 {
    0.1 * (5.0 * time_s).sin() + 0.05 * (13.7 * time_s).cos()
}

fn velocity(time_s: f64) -> f64 {
    0.5 * (5.0 * time_s).cos() - 0.685 * (13.7 * time_s).sin()
}

fn recording(name: &str) -> Recording {
    let column = |of: fn(f64) -> f64| (0..ROWS).map(|row| of(time(row))).collect::<Vec<f64>>();
    let signals = BTreeMap::from([
        ("x".to_owned(), column(position)),
        ("force".to_owned(), column(|t| 100.0 * velocity(t))),
    ]);
    Recording::from_signals(name, column(|t| t), signals)
}

/// Locates a planted misfit in noise of 1 N.
fn planted(misfit: impl Fn(f64) -> f64) -> Located {
    let rig = Rig::parse(BENCH, "bench.toml").expect("a rig");
    let recordings = [recording("one.csv"), recording("two.csv")];
    let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
    let mut normals = Normals(7);
    let residuals: Vec<Vec<f64>> = tracks
        .iter()
        .map(|_| {
            (0..ROWS)
                .map(|row| misfit(time(row)) + normals.next())
                .collect()
        })
        .collect();
    let mut found = locate(Law::Force, &rig, &tracks, &[residuals]);
    assert_eq!(found.len(), 1);
    found.remove(0)
}

fn leading(located: &Located) -> &str {
    located.leading().map_or("", |variable| variable.name)
}

#[test]
fn prop_white_noise_has_no_place() {
    let located = planted(|_| 0.0);
    assert_eq!(located.when, "no pattern over time or state");
    assert!(located.intervals.is_empty(), "{:?}", located.intervals);
    assert!(located.leading().is_none(), "{:?}", located.leading());
    for variable in &located.variables {
        assert!(variable.eta_squared < 0.01, "{variable:?}");
    }
}

#[test]
fn prop_a_misfit_that_grows_with_velocity_is_named_so() {
    let located = planted(|t| 4.0 * velocity(t));
    assert_eq!(leading(&located), "velocity");
    assert_eq!(located.when, "increases with velocity");
    let share = located.variables[0].eta_squared;
    // Energy: 16 * (0.5^2 + 0.685^2) / 2 = 5.75 against 1 of noise.
    assert!((share - 5.75 / 6.75).abs() < 0.05, "{share}");
}

#[test]
fn prop_dry_friction_changes_sign_with_velocity() {
    let located = planted(|t| 2.0 * velocity(t).signum());
    assert_eq!(leading(&located), "velocity");
    assert_eq!(located.when, "changes sign with velocity");
}

#[test]
fn prop_an_even_misfit_grows_with_the_size_of_velocity() {
    let located = planted(|t| 6.0 * velocity(t).powi(2));
    assert_eq!(leading(&located), "velocity");
    assert_eq!(located.when, "increases with the size of the velocity");
}

#[test]
fn prop_a_misfit_at_one_position_is_found_there() {
    let located = planted(|t| 5.0 * (-((position(t) - 0.06) / 0.02).powi(2)).exp());
    assert_eq!(leading(&located), "position");
    let place = "depends on position, largest near ";
    let rest = located.when.strip_prefix(place).expect(&located.when);
    let place_mm: f64 = rest.trim_end_matches(" mm").parse().expect(rest);
    assert!((place_mm - 60.0).abs() < 15.0, "{rest}");
}

#[test]
fn prop_a_misfit_after_reversals_is_named_so() {
    let since = |t: f64| {
        let mut back = t;
        while back > 0.0 && velocity(back) * velocity(t) > 0.0 {
            back -= STEP_S;
        }
        t - back
    };
    let located = planted(|t| if t > 0.5 && since(t) < 0.03 { 8.0 } else { 0.0 });
    assert_eq!(leading(&located), "time since reversal", "{}", located.when);
    assert!(
        located.when.starts_with("mostly within 0.0"),
        "{}",
        located.when
    );
    assert!(
        located.when.ends_with(" s after a reversal"),
        "{}",
        located.when
    );
}

#[test]
fn prop_a_burst_is_found_in_time() {
    let burst = |t: f64| {
        let inside = (3.0..3.25).contains(&t);
        if inside {
            12.0 * (400.0 * t).sin()
        } else {
            0.0
        }
    };
    let located = planted(burst);
    assert_eq!(located.intervals.len(), 2, "{:?}", located.intervals);
    for (place, (name, from_s, to_s)) in located.intervals.iter().enumerate() {
        assert_eq!(name, ["one.csv", "two.csv"][place]);
        assert!((from_s - 3.0).abs() < 0.05 && (to_s - 3.25).abs() < 0.05);
    }
    assert!(located.interval_share > 0.5 && located.interval_time < 0.05);
    assert!(located.when.contains("of the time: "), "{}", located.when);
}

#[test]
fn prop_an_offset_is_called_one() {
    let located = planted(|_| 5.0);
    assert_eq!(located.when, "constant offset");
}
