//! A fleet on disk: what changes is told, and no work is lost, doubled or done on half a file.

#![expect(clippy::unwrap_used, reason = "helpers of tests, too")]

use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use truth_plant::fleet::{Axis, Fault, Weather};

fn pneuma(words: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_pneuma"));
    command.args(words).output().unwrap()
}

fn done(words: &[&str]) -> String {
    let output = pneuma(words);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{words:?}: {said}");
    String::from_utf8(output.stdout).unwrap()
}

/// Writes an axis' nights, some of them with a fault of a size.
fn write_axis(folder: &Path, seed: u64, nights: u32, size: impl Fn(u32) -> f64) {
    let axis = Axis::draw(seed);
    let own = folder.join(format!("axis-{seed}"));
    fs::create_dir_all(&own).unwrap();
    fs::write(own.join("rig.toml"), axis.rig_toml()).unwrap();
    for night in 0..nights {
        let weather = Weather {
            ambient_k: 292.0,
            supply: 1.0 + 0.002 * f64::from(night % 3),
        };
        let text = axis.night(night, weather, Some((Fault::SealWear, size(night))));
        fs::write(own.join(format!("2026-09-{:02}.csv", night + 1)), text).unwrap();
    }
}

fn manifest(folder: &Path, seeds: &[u64], reference: usize) -> PathBuf {
    let axis = |seed: &u64| {
        format!(
            "[[axis]]\nname = \"axis {seed}\"\nrig = \"axis-{seed}/rig.toml\"\nrecordings = \"axis-{seed}/*.csv\"\nreference = {reference}\n"
        )
    };
    let path = folder.join("fleet.toml");
    fs::write(&path, seeds.iter().map(axis).collect::<String>()).unwrap();
    path
}

fn plan(folder: &Path) -> String {
    let manifest = folder.join("fleet.toml");
    done(&["fleet", "plan", manifest.to_str().unwrap()]);
    folder.join("fleet/plan.json").to_str().unwrap().to_owned()
}

/// Every result by its job, but for the time at which it was written.
fn results(folder: &Path) -> BTreeMap<String, String> {
    let files = fs::read_dir(folder.join("fleet/jobs")).unwrap();
    let one = |file: std::io::Result<fs::DirEntry>| {
        let path = file.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        (name, fs::read_to_string(path).unwrap())
    };
    files.map(one).collect()
}

/// Friction that rises from the tenth night on is told in those words.
#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_the_axis_that_changes_is_told_with_its_physics_and_its_onset() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let growing = |night: u32| 0.1 * f64::from(night.saturating_sub(9));
    write_axis(folder, 9003, 18, growing);
    manifest(folder, &[9003], 3);
    let plan = plan(folder);
    done(&["fleet", "run", "--plan", &plan, "--stage", "reference"]);
    done(&["fleet", "run", "--plan", &plan, "--stage", "night"]);
    let [report, table, page] =
        ["report.json", "nights.parquet", "fleet.html"].map(|name| folder.join(name));
    let [report_at, table_at, page_at] =
        [&report, &table, &page].map(|path| path.to_str().unwrap());
    let said = done(&[
        "fleet", "report", "--plan", &plan, "--json", report_at, "--table", table_at, "--report",
        page_at,
    ]);
    println!("{said}");
    let changes: Vec<Value> = serde_json::from_str(&fs::read_to_string(&report).unwrap()).unwrap();
    assert!(
        changes.iter().all(|one| one["name"] == "axis 9003"),
        "{said}"
    );
    let first = &changes[0];
    assert_eq!(first["quantity"], "friction.coulomb_N");
    let onset = first["onset_day"].as_f64().unwrap();
    assert!((7.0..=11.0).contains(&onset), "{onset}");
    // 0.8 of the size that matters on the last night.
    let share = first["size"].as_f64().unwrap() / first["matters_from"].as_f64().unwrap();
    assert!((0.6..1.0).contains(&share), "{share}");
    let text = fs::read_to_string(&page).unwrap();
    assert!(text.contains("dry friction") && text.contains("axis 9003"));
    assert!(fs::read(&table).unwrap().starts_with(b"PAR1"));
}

/// Killed, cut off, run by two at once and in parts, a fleet's work gives the same results; a recording
/// that is another one by now is not worked on.
#[test]
fn prop_no_work_is_lost_doubled_or_done_on_half_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_axis(folder, 9005, 6, |_| 0.0);
    manifest(folder, &[9005], 3);
    let plan_at = plan(folder);
    let run = |words: &[&str]| done(&[&["fleet", "run", "--plan", &plan_at], words].concat());
    run(&["--stage", "reference"]);
    // Three parts, two runs of each at once.
    std::thread::scope(|scope| {
        for part in ["1/3", "2/3", "3/3", "1/3", "2/3", "3/3"] {
            let run = &run;
            scope.spawn(move || run(&["--stage", "night", "--part", part, "--at-once", "1"]));
        }
    });
    let all = results(folder);
    assert_eq!(all.len(), 7, "a reference and six nights: {:?}", all.keys());
    assert!(run(&["--stage", "night"]).contains("0 done now, 6 before"));

    // One lost, one cut off.
    let nights: Vec<&String> = all
        .keys()
        .filter(|name| all[*name].contains("estimates"))
        .collect();
    fs::remove_file(folder.join("fleet/jobs").join(nights[0])).unwrap();
    let cut = &all[nights[1]][..all[nights[1]].len() / 2];
    fs::write(folder.join("fleet/jobs").join(nights[1]), cut).unwrap();
    assert!(run(&["--stage", "night"]).contains("2 done now, 4 before"));
    assert_eq!(results(folder), all, "the same bytes");

    // A seventh night arrives, half of it: planned as it is then, and not worked on when it is whole.
    let whole = fs::read_to_string(folder.join("axis-9005/2026-09-01.csv")).unwrap();
    let late = folder.join("axis-9005/2026-09-30.csv");
    fs::write(&late, &whole[..whole.len() / 2]).unwrap();
    plan(folder);
    fs::write(&late, whole.replace("0.0000,", "0.0001,")).unwrap();
    let output = pneuma(&["fleet", "run", "--plan", &plan_at, "--stage", "night"]);
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        said.contains("has changed since the plan was made"),
        "{said}"
    );
    assert_eq!(results(folder), all);
}

#[test]
fn prop_what_cannot_be_planned_is_said_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let manifest = manifest(folder.path(), &[1], 3);
    let output = pneuma(&["fleet", "plan", manifest.to_str().unwrap()]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2));
    assert!(
        said.trim().lines().count() == 1 && said.contains("axis-1/rig.toml"),
        "{said}"
    );
}
