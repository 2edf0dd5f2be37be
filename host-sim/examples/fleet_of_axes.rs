//! A fleet of simulated axes on disk: shop-floor axes of `truth-plant` that record every night, some of
//! which develop a fault, some with broken recordings, in a hall with weather.
//!
//!     cargo run --release -p host-sim --example fleet_of_axes -- FOLDER SEED AXES NIGHTS
//!
//! writes `FOLDER/fleet.toml`, rigs, recordings, and `FOLDER/truth.json`, which the tool does not read;
//! `-- judge FOLDER` sets `FOLDER/report.json` (`pneuma fleet report --json`) against it.

#![allow(clippy::unwrap_used, reason = "a failure ends the show")]

use host_sim::side_by_side::{side_by_side, usual};
use serde_json::{Value, json};
use std::convert::Infallible;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use truth_plant::fleet::{Axis, Fault, Weather};

/// Every so many-th axis goes wrong, each of the faults once, and two sound ones in sixty have broken
/// recordings. What sags is the supply of all axes of a hall.
const ONE_IN: usize = 7;
const AXES_A_HALL: usize = 20;
const SAGGING_HALL: usize = 2;

struct Course {
    name: String,
    seed: u64,
    hall: usize,
    fault: Option<(Fault, u32, f64)>,
    is_broken: bool,
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if let [judge, folder] = &words[..]
        && judge == "judge"
    {
        return judged(Path::new(folder));
    }
    let [folder, seed, axes, nights] = &words[..] else {
        panic!("expected FOLDER SEED AXES NIGHTS");
    };
    let folder = PathBuf::from(folder);
    let (seed, axes): (u64, usize) = (seed.parse().unwrap(), axes.parse().unwrap());
    let nights: u32 = nights.parse().unwrap();
    let courses: Vec<Course> = (0..axes).map(|axis| course(seed, axis, nights)).collect();
    fs::create_dir_all(&folder).unwrap();
    let write = |course: &Course| written(&folder, course, nights);
    side_by_side(&courses, usual(), write, |()| Ok::<_, Infallible>(())).unwrap();
    let mut manifest = String::from("[fleet]\nresults = \"results\"\n");
    for course in &courses {
        write!(
            manifest,
            "\n[[axis]]\nname = \"{name}\"\ngroup = \"hall {hall}\"\nrig = \"{name}/rig.toml\"\nrecordings = \"{name}/*.csv\"\n",
            name = course.name,
            hall = course.hall
        )
        .unwrap();
    }
    fs::write(folder.join("fleet.toml"), manifest).unwrap();
    let truth: Vec<_> = courses
        .iter()
        .map(|course| {
            let fault = course.fault.map(|(fault, from, growth)| {
                json!({"fault": format!("{fault:?}"), "first_night": from, "sizes_a_night": growth})
            });
            json!({"axis": course.name, "fault": fault, "broken_recordings": course.is_broken})
        })
        .collect();
    let truth = serde_json::to_string_pretty(&truth).unwrap();
    fs::write(folder.join("truth.json"), truth).unwrap();
}

/// What a fault changes: keys of which one is right.
fn right(fault: &str) -> &'static [&'static str] {
    match fault {
        "SlowLeak" => &["effects.piston-leakage.orifice_m2"],
        "SealWear" => &["friction.coulomb_N"],
        "ValveSticking" => &["effects.valve-hysteresis.width"],
        "CloggingSilencer" => &["valve.exhaust_area_m2"],
        "GaugeDrift" => &["effects.pressure-sensor-offset.offset_a_Pa"],
        "SupplySag" => &["supply.pressure_Pa"],
        "SwappedValve" => &["valve.null_V", "valve.supply_area_m2"],
        _ => &[],
    }
}

/// A row a fault, and which sound axes were said to have changed.
fn judged(folder: &Path) {
    let read = |name: &str| -> Vec<Value> {
        serde_json::from_str(&fs::read_to_string(folder.join(name)).unwrap()).unwrap()
    };
    let (truth, report) = (read("truth.json"), read("report.json"));
    let first = |name: &str| report.iter().find(|one| one["name"] == name);
    println!("| axis | fault | from night | matters on | seen on | said | physics |");
    println!("|---|---|---:|---:|---:|---|---|");
    let mut is_hall_told = false;
    for one in &truth {
        let Some(fault) = one["fault"]["fault"].as_str() else {
            continue;
        };
        let of_hall = fault == "SupplySag";
        if of_hall && std::mem::replace(&mut is_hall_told, true) {
            continue;
        }
        let name = if of_hall {
            format!("hall {SAGGING_HALL}")
        } else {
            one["axis"].as_str().unwrap().to_owned()
        };
        let from = one["fault"]["first_night"].as_f64().unwrap();
        let growth = one["fault"]["sizes_a_night"].as_f64().unwrap();
        let matters = if fault == "SwappedValve" {
            from
        } else {
            from + 1.0 / growth
        };
        let found = first(&name);
        let said = found.map_or("-", |one| one["quantity"].as_str().unwrap());
        let seen = found.map_or("-".into(), |one| one["seen_day"].to_string());
        let is_right = right(fault).contains(&said);
        println!("| {name} | {fault} | {from} | {matters:.0} | {seen} | {said} | {is_right} |");
    }
    let healthy = truth.iter().filter(|one| one["fault"].is_null());
    let healthy: Vec<&str> = healthy.filter_map(|one| one["axis"].as_str()).collect();
    let false_axes = healthy.iter().filter_map(|name| first(name));
    for one in false_axes.clone() {
        println!("false: {} {} {}", one["name"], one["quantity"], one["size"]);
    }
    println!(
        "{} of {} sound axes are said to have changed",
        false_axes.count(),
        healthy.len()
    );
}

/// A share of one, drawn from a seed and what it is for.
fn share(seed: u64, what: u64) -> f64 {
    // SplitMix64 (Steele, Lea, Flood 2014).
    let mut state = seed
        .wrapping_mul(0x9e37_79b9_7f4a_7c15)
        .wrapping_add(what.wrapping_mul(0xbf58_476d_1ce4_e5b9));
    state = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    state = (state ^ (state >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((state ^ (state >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

fn course(seed: u64, axis: usize, nights: u32) -> Course {
    let own = seed * 1000 + axis as u64;
    let kind = Fault::ALL.get(axis / ONE_IN).filter(|_| axis % ONE_IN == 3);
    let hall = axis / AXES_A_HALL;
    let own_fault = kind
        .filter(|&&fault| fault != Fault::SupplySag)
        .map(|&fault| {
            let (from, growth) = beginning(own, nights);
            (fault, from, growth)
        });
    let fault = own_fault.or_else(|| {
        let (from, growth) = beginning(seed, nights);
        (hall == SAGGING_HALL).then_some((Fault::SupplySag, from, growth))
    });
    Course {
        name: format!("axis-{axis:02}"),
        seed: own,
        hall,
        fault,
        is_broken: axis % (4 * ONE_IN) == 5,
    }
}

/// From the second third of the nights on; as large as matters 10 to 25 nights later.
fn beginning(seed: u64, nights: u32) -> (u32, f64) {
    let from = f64::from(nights) * (0.33 + 0.2 * share(seed, 1));
    (from as u32, 1.0 / (10.0 + 15.0 * share(seed, 2)))
}

fn written(folder: &Path, course: &Course, nights: u32) {
    let axis = Axis::draw(course.seed);
    let folder = folder.join(&course.name);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("rig.toml"), axis.rig_toml()).unwrap();
    let first: jiff::civil::Date = "2026-09-01".parse().unwrap();
    for night in 0..nights {
        let size = course.fault.map(|(fault, from, growth)| {
            let since = f64::from(night.saturating_sub(from));
            // Another valve comes at once.
            let size = match fault {
                Fault::SwappedValve if night >= from => 1.5,
                Fault::SwappedValve => 0.0,
                _ => growth * since,
            };
            (fault, size)
        });
        let hall = course.hall as u64 + 77;
        let season = (2.0 * std::f64::consts::PI * f64::from(night) / 365.0).cos();
        let weather = Weather {
            ambient_k: 291.0 + 5.0 * season + 2.0 * (share(hall, u64::from(night)) - 0.5),
            supply: 1.0 + 0.01 * (share(hall + 1, u64::from(night)) - 0.5),
        };
        let mut text = axis.night(night, weather, size);
        if course.is_broken && night % 5 == 2 {
            text = with_a_stuck_gauge(&text);
        }
        let date = first.checked_add(jiff::Span::new().days(night)).unwrap();
        fs::write(folder.join(format!("{date}.csv")), text).unwrap();
    }
}

/// The gauge of chamber A stands still through the middle third.
fn with_a_stuck_gauge(text: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    let (from, to) = (lines.len() / 3, 2 * lines.len() / 3);
    let stuck = lines[from].split(',').nth(2).unwrap();
    let one = |(row, line): (usize, &&str)| {
        if row < from || row > to {
            return (*line).to_owned();
        }
        let mut cells: Vec<&str> = line.split(',').collect();
        cells[2] = stuck;
        cells.join(",")
    };
    lines
        .iter()
        .enumerate()
        .map(one)
        .collect::<Vec<_>>()
        .join("\n")
        + "\n"
}
