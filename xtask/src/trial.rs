//! Run the concealed trial and write its part of `docs/evidence.md`.

use crate::generated::{self, Part};
use crate::shell::{self, Outcome, cargo};
use crate::verdicts::PAGE;
use std::fs;

/// A trial: its part of the page, its seed and where its rigs stand.
struct Trial {
    part: Part,
    nature: &'static str,
    /// Cases of this kind only.
    kind: Option<&'static str>,
    /// The plan's seed. Cases of seeds 1 to 30 were looked at while the diagnosis was
    /// written; those of these were not.
    seed: &'static str,
    /// Cases, unless told.
    cases: &'static str,
    /// Where scorecard, seals and report land; a trial that was cut off goes on.
    folder: &'static str,
}

const TRIALS: [Trial; 3] = [
    Trial {
        part: Part {
            name: "concealed trial",
            task: "cargo xtask trial",
        },
        nature: "laboratory",
        kind: None,
        seed: "31",
        cases: "200",
        folder: "out/trial",
    },
    Trial {
        part: Part {
            name: "concealed trial on the shop floor",
            task: "cargo xtask trial --shop-floor",
        },
        nature: "shop-floor",
        kind: None,
        seed: "1042",
        cases: "36",
        folder: "out/trial-shop-floor",
    },
    Trial {
        part: Part {
            name: "effects of no list",
            task: "cargo xtask trial --unlisted",
        },
        nature: "laboratory",
        kind: Some("off-list"),
        seed: "2001",
        // Every effect of no list at every strength once.
        cases: "33",
        folder: "out/trial-unlisted",
    },
];

/// The task `trial`: `--shop-floor` for rigs that lie outside of what their files can say, `--unlisted`
/// for effects of no list; a number for how many cases.
pub fn run(options: &[String]) -> Outcome {
    let [laboratory, shop_floor, unlisted] = &TRIALS;
    let options: Vec<&str> = options.iter().map(String::as_str).collect();
    let (trial, cases) = match options[..] {
        [] => (laboratory, laboratory.cases),
        ["--shop-floor"] => (shop_floor, shop_floor.cases),
        ["--shop-floor", cases] => (shop_floor, cases),
        ["--unlisted"] => (unlisted, unlisted.cases),
        ["--unlisted", cases] => (unlisted, cases),
        [cases] => (laboratory, cases),
        _ => return Err("trial: expected [--shop-floor | --unlisted] [CASES]".into()),
    };
    let folder = shell::root().join(trial.folder);
    fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let announced = format!(
        "`pneuma trial --nature {}{} --cases {cases} --seed {}`, commit {}.",
        trial.nature,
        trial
            .kind
            .map(|kind| format!(" --kind {kind}"))
            .unwrap_or_default(),
        trial.seed,
        generated::commit()
    );
    let announcement = folder.join("announced.txt");
    fs::write(&announcement, format!("{announced}\n"))
        .map_err(|error| format!("{}: {error}", announcement.display()))?;
    let mut pneuma = cargo(&["run", "--quiet", "-p", "host-sim", "--bin", "pneuma"]);
    pneuma.args(["--", "trial", "--nature", trial.nature]);
    pneuma.args(["--cases", cases, "--seed", trial.seed]);
    if let Some(kind) = trial.kind {
        pneuma.args(["--kind", kind]);
    }
    for (option, file) in [
        ("--json", "scorecard.json"),
        ("--report", "scorecard.html"),
        ("--markdown", "tables.md"),
    ] {
        pneuma.arg(option).arg(folder.join(file));
    }
    shell::run(&mut pneuma)?;
    let tables = folder.join("tables.md");
    let tables =
        fs::read_to_string(&tables).map_err(|error| format!("{}: {error}", tables.display()))?;
    trial
        .part
        .write(PAGE, &format!("{announced}\n\n{HOW}\n{tables}"))
}

const HOW: &str = "\
Rigs drawn by `truth-plant`, which shares no code, formulation or integrator with the model: gas as mass and energy,
tubes as finite volumes, 25 us. Each truth was sealed by its hash before the diagnosis ran, and opened after. The
diagnosis read the case's files and nothing else. An effect counts if taking it out of the plant changes what an
honestly refitted model misses of the held-out recordings, and if it was not drawn at a tenth of what an engineer
would care about; where none counts, the right verdict is that nothing is missing. Place, false alarms and confident errors are counted over every case that they can be counted over, also
masked, noisy and brief ones. Counts stand beside the shares. Every case with its misses is in the report,
`scorecard.html` beside the announcement in `out`.
";
