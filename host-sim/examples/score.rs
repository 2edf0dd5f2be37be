//! The controller's score on a rig: `cargo run --release --example score RIG [SEEDS] [GAINS]`
//! With seven gains, the comparison controller's.

use host_sim::closed_loop::{
    Case, Drive, HostController, PidController, PidGains, control_task, score,
};
use host_sim::rig::Rig;
use std::error::Error;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let rig = arguments.next().map(PathBuf::from);
    let rig = rig.unwrap_or_else(|| concat!(env!("CARGO_MANIFEST_DIR"), "/rigs/paper.toml").into());
    let seeds: u64 = arguments.next().map_or(Ok(20), |count| count.parse())?;
    let rig = Rig::read(&rig)?;
    let gains: Vec<f64> = arguments
        .map(|gain| gain.parse())
        .collect::<Result<_, _>>()?;
    let gains: Option<[f64; 7]> = gains.try_into().ok();
    let factory = |known: &Rig| {
        let drive: Box<dyn Drive> = match gains {
            Some(gains) => Box::new(PidController::new(known, PidGains::from_array(gains))?),
            None => Box::new(HostController::new(control_task(known)?)),
        };
        Ok(drive)
    };
    let seeds: Vec<u64> = (1..=seeds).collect();
    let scores = score(&rig, &factory, &Case::ALL, &seeds)?;
    for case in Case::ALL {
        let Some(first) = scores
            .first()
            .and_then(|score| score.cases.iter().find(|measured| measured.case == case))
        else {
            continue;
        };
        for (measure, _) in &first.measures {
            let mut values: Vec<f64> = scores
                .iter()
                .filter_map(|score| score.get(case, *measure))
                .collect();
            values.sort_by(f64::total_cmp);
            let (median, worst) = (values[values.len() / 2], values[values.len() - 1]);
            let mark = measure.mark(case);
            let verdict = mark.map_or("", |mark| if worst <= mark { "ok" } else { "MISSED" });
            println!(
                "{case:?} {measure:?}: median {:.4} worst {:.4} mark {:?} (1e-3) {verdict}",
                1e3 * median,
                1e3 * worst,
                mark.map(|mark| 1e3 * mark)
            );
        }
        let stops = scores
            .iter()
            .flat_map(|score| &score.cases)
            .filter(|measured| measured.case == case && measured.hit_end_stop)
            .count();
        if stops > 0 {
            println!("{case:?}: {stops} runs hit an end stop");
        }
    }
    Ok(())
}
