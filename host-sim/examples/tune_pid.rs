//! Searches the comparison controller's gains on a rig:
//! `cargo run --release --example tune_pid RIG [STEPS]`.

use host_sim::closed_loop::tune_pid;
use host_sim::rig::Rig;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let rig = Rig::read(arguments.next().ok_or("expected a rig file")?)?;
    let steps = arguments.next().map_or(Ok(80), |steps| steps.parse())?;
    println!("{:#?}", tune_pid(&rig, steps)?);
    Ok(())
}
