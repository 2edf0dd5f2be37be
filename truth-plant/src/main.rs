//! `truth-plant`: writes a case into a folder, as the practice rigs have it.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, ValueEnum};
use truth_plant::bench::{self, BenchCase, Experiment};
use truth_plant::{Case, Kind, Nature, Request, Strength};

/// Draws a rig with concealed physics and writes its recordings.
#[derive(Parser)]
struct Arguments {
    /// The seed that everything follows from.
    #[arg(long)]
    seed: u64,
    /// single, pair, onset, nothing, parameters, dirty, other-form, off-list or
    /// unobservable.
    #[arg(long, required_unless_present = "bench")]
    kind: Option<Kind>,
    /// A test bench in place of a kind: valve-flow, vessel-flow, spool, heat-transfer, friction,
    /// presliding or dead-volume.
    #[arg(long, conflicts_with_all = ["kind", "nature", "effect", "strength", "noise"])]
    bench: Option<Experiment>,
    /// laboratory, where the rig file's laws hold exactly, or shop-floor, where they hold nearly.
    #[arg(long, default_value_t = Nature::Laboratory)]
    nature: Nature,
    /// An effect that is to be there.
    #[arg(long)]
    effect: Option<String>,
    /// How large the effects are to be.
    #[arg(long)]
    strength: Option<Size>,
    /// Multiplier of the sensors' noise.
    #[arg(long)]
    noise: Option<f64>,
    /// The folder to write.
    #[arg(long)]
    out: PathBuf,
}

#[derive(Clone, Copy, ValueEnum)]
enum Size {
    Weak,
    Medium,
    Strong,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("truth-plant: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    if let Some(experiment) = arguments.bench {
        return write_bench(&bench::draw(experiment, arguments.seed), &arguments.out);
    }
    let kind = arguments.kind.ok_or("neither --kind nor --bench")?;
    let mut request = Request::new(arguments.seed, kind).with_nature(arguments.nature);
    if let Some(name) = &arguments.effect {
        request = request.with_effect(name)?;
    }
    if let Some(size) = arguments.strength {
        request = request.with_strength(match size {
            Size::Weak => Strength::Weak,
            Size::Medium => Strength::Medium,
            Size::Strong => Strength::Strong,
        });
    }
    if let Some(multiplier) = arguments.noise {
        if !(multiplier >= 0.0 && multiplier.is_finite()) {
            return Err(format!("--noise {multiplier}: expected a number of at least 0").into());
        }
        request = request.with_noise(multiplier);
    }
    write(&request.draw(), &arguments.out)
}

fn write(case: &Case, folder: &Path) -> Result<(), Box<dyn Error>> {
    let recordings = case.train.iter().chain(&case.held_out);
    write_files(
        folder,
        &case.rig_toml,
        recordings,
        &case.truth.practice_json()?,
    )
}

fn write_bench(case: &BenchCase, folder: &Path) -> Result<(), Box<dyn Error>> {
    write_files(
        folder,
        &case.rig_toml,
        &case.recordings,
        &case.truth_json()?,
    )
}

fn write_files<'a>(
    folder: &Path,
    rig_toml: &str,
    recordings: impl IntoIterator<Item = &'a (String, String)>,
    truth_json: &str,
) -> Result<(), Box<dyn Error>> {
    let put = |name: &str, text: &str| {
        let path = folder.join(name);
        fs::write(&path, text).map_err(|error| format!("cannot write {}: {error}", path.display()))
    };
    fs::create_dir_all(folder)
        .map_err(|error| format!("cannot make the folder {}: {error}", folder.display()))?;
    put("rig.toml", rig_toml)?;
    for (name, text) in recordings {
        put(name, text)?;
    }
    put("truth.json", truth_json)?;
    Ok(())
}
