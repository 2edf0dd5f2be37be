//! By how much channels are late in recordings as they are, and in copies with one channel made late:
//! `cargo run --release -p diagnosis --example lateness [--as-recorded] RIG RECORDING...`.

use diagnosis::inspect::lateness::remarks;
use grey_box::recording::Recording;
use grey_box::rig::Rig;

fn main() {
    let mut paths: Vec<String> = std::env::args().skip(1).collect();
    let is_as_recorded = paths.first().is_some_and(|first| first == "--as-recorded");
    let mut paths = paths.drain(usize::from(is_as_recorded)..);
    let rig = Rig::read(paths.next().expect("a rig file")).expect("a rig");
    for path in paths {
        let recording = Recording::read(&path, &rig.signals).expect("a recording");
        for (signals, late_s) in [
            (&[][..], 0.0),
            (&["x", "v"], 0.008),
            (&["p_a", "p_b"], 0.005),
            (&["u"], 0.005),
            (&["p_b"], 0.005),
            (&["v"], 0.008),
        ]
        .iter()
        .take(if is_as_recorded { 1 } else { usize::MAX })
        {
            let one = late(&recording, signals, *late_s);
            let begun = std::time::Instant::now();
            let said = remarks(&rig, &one);
            println!("{path} {signals:?} {:.1?} {said:?}", begun.elapsed());
        }
    }
}

fn late(recording: &Recording, signals: &[&str], late_s: f64) -> Recording {
    let mut late = recording.clone();
    let step_s = grey_box::laws::median_step_s(&recording.time_s);
    let rows = (late_s / step_s).round() as usize;
    for name in signals {
        if let Some(signal) = late.signals.get_mut(*name) {
            let held = signal[0];
            signal.rotate_right(rows);
            signal[..rows].fill(held);
        }
    }
    late
}
