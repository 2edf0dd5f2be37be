//! The controller's score on rigs beside the comparison's, as tables:
//! `cargo run --release --example score -- [--seeds N] [--retune STEPS] RIG...`.
//!
//! The first rig is shown in full, all of them in an overview. `--retune` has
//! the comparison's gains searched for on every rig but the first, from those of
//! the paper's rig.

use host_sim::closed_loop::table::{Compared, full_table, incidents, overview};
use host_sim::closed_loop::{
    Case, Drive, Factory, HostController, PidController, PidGains, ScoreError, control_task,
    retune_pid, score,
};
use host_sim::rig::Rig;
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let (mut seeds, mut steps, mut rigs) = (20, 0, Vec::new());
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--seeds" => seeds = arguments.next().ok_or("--seeds wants a number")?.parse()?,
            "--retune" => steps = arguments.next().ok_or("--retune wants a number")?.parse()?,
            _ => rigs.push(argument),
        }
    }
    let seeds: Vec<u64> = (1..=seeds).collect();
    let mut all = Vec::new();
    for (place, path) in rigs.iter().enumerate() {
        let steps = if place == 0 { 0 } else { steps };
        all.push(compared(Path::new(path), &seeds, steps)?);
    }
    let first = all.first().ok_or("expected a rig file")?;
    println!("{}", full_table(first));
    if all.len() > 1 {
        println!("{}", overview(&all));
    }
    for incident in all.iter().filter_map(incidents) {
        println!("{incident}");
    }
    Ok(())
}

fn compared(path: &Path, seeds: &[u64], steps: u64) -> Result<Compared, Box<dyn Error>> {
    let rig = Rig::read(path)?;
    let gains = match steps {
        0 => PidGains::PAPER,
        steps => retune_pid(&rig, PidGains::PAPER, steps)?,
    };
    let scored =
        |factory: &Factory| -> Result<_, ScoreError> { score(&rig, factory, &Case::ALL, seeds) };
    let controller = |known: &Rig| {
        let drive: Box<dyn Drive> = Box::new(HostController::new(control_task(known)?));
        Ok(drive)
    };
    let comparison = |known: &Rig| {
        let drive: Box<dyn Drive> = Box::new(PidController::new(known, gains)?);
        Ok(drive)
    };
    Ok(Compared {
        rig: name(path),
        controller: scored(&controller)?,
        comparison: scored(&comparison)?,
    })
}

/// `p01` of `practice/p01/rig.toml`, `paper` of `rigs/paper.toml`.
fn name(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default();
    let folder = path.parent().and_then(Path::file_name);
    let name = if stem == "rig" {
        folder.unwrap_or(stem)
    } else {
        stem
    };
    name.to_string_lossy().into_owned()
}
