//! The valve's areas out of recordings, against axes of another plant whose areas are known.

use diagnosis::valve_flow::{Point, ValveFlow, measure};
use grey_box::laws::Track;
use grey_box::recording::Recording;
use grey_box::rig::Rig;
use truth_plant::{Kind, Request, Truth};

/// Openings at which the drawn curves have a point of their own, V, beyond their dead zones.
const OPENINGS_V: [f64; 5] = [0.5, 0.8, 1.3, 2.0, 2.5];

fn drawn(seed: u64, noise: f64) -> (Rig, Vec<Recording>, Truth) {
    let request = Request::new(seed, Kind::Nothing).with_noise(noise);
    let case = request.draw();
    let rig = Rig::parse(&case.rig_toml, "rig.toml").expect("a rig file");
    let read = |(name, text): &(String, String)| {
        Recording::read_from(text.as_bytes(), name, None, &rig.signals).expect("a recording")
    };
    let recordings = case.train.iter().map(read).collect();
    (rig, recordings, request.truth())
}

fn measured(rig: &Rig, recordings: &[Recording]) -> ValveFlow {
    let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
    measure(rig, &tracks).expect("a valve")
}

/// The rig file of somebody who has a data sheet and nothing else.
fn with_one_flow(rig: &Rig) -> Rig {
    let text = rig.to_toml();
    let table = [
        "opening_V",
        "supply_area_m2",
        "exhaust_area_m2",
        "critical_pressure_ratio",
    ];
    let is_kept = |line: &&str| !table.iter().any(|key| line.contains(key));
    let kept: Vec<&str> = text.lines().filter(is_kept).collect();
    let stated = kept.join("\n").replace(
        "[valve]",
        "[valve]\nnominal_flow_l_min = 700.0\nb = 0.3\ndead_zone_V = 0.4\nfull_opening_V = 5.0",
    );
    Rig::parse(&stated, "rig.toml").expect("a rig file")
}

fn at(valve: &ValveFlow, opening_v: f64) -> Point {
    let above = valve
        .points
        .partition_point(|point| point.opening_v <= opening_v);
    let above = above.clamp(1, valve.points.len() - 1);
    let (from, to) = (valve.points[above - 1], valve.points[above]);
    let along = (opening_v - from.opening_v) / (to.opening_v - from.opening_v);
    let between = |from: [f64; 2], to: [f64; 2]| {
        [0, 1].map(|path| from[path] + along * (to[path] - from[path]))
    };
    Point {
        opening_v,
        area_m2: between(from.area_m2, to.area_m2),
        deviation_m2: between(from.deviation_m2, to.deviation_m2),
    }
}

/// Supply and exhaust of the drawn plant, m2.
fn true_areas_m2(truth: &Truth, opening_v: f64) -> [f64; 2] {
    let of = |name: &str| truth.plant[name];
    let free_v = (opening_v - of("ovl")).max(0.0);
    let supply_m2 = of("Aleak") + of("Amax") * (free_v / of("span")).powf(of("shape")).tanh();
    [supply_m2, supply_m2 * of("asym")]
}

fn assert_near_the_truth(valve: &ValveFlow, truth: &Truth, null_within_v: f64) {
    let null_v = truth.plant["null"];
    let is_near = (valve.null_v - null_v).abs() < null_within_v;
    assert!(is_near, "{} of {null_v} V", valve.null_v);
    for (found, name) in valve.dead_volume_m3.iter().zip(["V0a", "V0b"]) {
        let off = found / truth.plant[name] - 1.0;
        assert!(off.abs() < 0.06, "dead volume {name} is off by {off}");
    }
    for opening_v in OPENINGS_V {
        let point = at(valve, opening_v);
        for (path, true_m2) in true_areas_m2(truth, opening_v).into_iter().enumerate() {
            let (area_m2, deviation_m2) = (point.area_m2[path], point.deviation_m2[path]);
            let off = (area_m2 - true_m2) / deviation_m2;
            let shown = format!("path {path} at {opening_v} V: {area_m2} ± {deviation_m2}");
            assert!(off.abs() < 3.0, "{shown} of {true_m2}");
            assert!(deviation_m2 < 0.12 * area_m2, "{shown} says little");
        }
    }
}

#[test]
fn val_areas_null_and_dead_volumes_are_those_of_the_plant() {
    for seed in [505, 506] {
        let (rig, recordings, truth) = drawn(seed, 1.0);
        assert_near_the_truth(&measured(&rig, &recordings), &truth, 2e-3);
    }
}

#[test]
fn val_one_nominal_flow_leads_to_the_same_curve() {
    let (rig, recordings, truth) = drawn(505, 1.0);
    let stated = with_one_flow(&rig);
    let valve = measured(&stated, &recordings);
    assert_near_the_truth(&valve, &truth, 2e-3);
    let improved = valve.applied(&stated);
    let edited = Rig::edited(&stated.to_toml(), &improved);
    let read_back = Rig::parse(&edited, "improved.toml").unwrap();
    assert_eq!(read_back, improved);
    assert!(read_back.valve.unwrap().stated_flow.is_none());
}

/// Noise stands in the dead volume's column too: plain least squares found 20 % too little under
/// ten times the usual noise.
#[test]
fn regress_noise_draws_no_volume_to_nought() {
    let (rig, recordings, truth) = drawn(505, 10.0);
    assert_near_the_truth(&measured(&rig, &recordings), &truth, 2e-2);
}

#[test]
fn prop_what_is_missing_is_said() {
    let (rig, mut recordings, _) = drawn(505, 1.0);
    for recording in &mut recordings {
        recording.signals.remove("p_b");
    }
    let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
    let error = measure(&rig, &tracks).unwrap_err();
    assert!(error.contains("p_b is missing"), "{error}");
    let mut bare = rig;
    bare.valve = None;
    assert!(measure(&bare, &tracks).unwrap_err().contains("[valve]"));
}
