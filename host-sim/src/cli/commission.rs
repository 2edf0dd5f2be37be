//! `pneuma commission`: from a board with a rig file to an acceptance sheet, step by step.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use firmware::settings::Wiring;
use serde_json::Value;

use super::check_wiring::{check, stands_at_m};
use super::diagnose::{self, DiagnoseArguments};
use super::inputs::{bad_input, bare_name, provenance, read_rig, rig_fault};
use super::on_board::{OnBoard, announce, note};
use super::outputs::{write_json, write_page, write_text};
use super::{CommandError, typed};
use crate::board::orders;
use crate::board::send::Kept;
use crate::board::words;
use crate::commission::programs;
use crate::commission::score::Run;
use crate::commission::sheet::{Runs, sheet};
use crate::commission::steps::{Progress, Step};
use crate::model::AxisFault;
use crate::recording::Recording;
use crate::rig::Rig;

/// What is done, in the folder.
const PROGRESS: &str = "commission.json";
/// The recordings to learn from, and the one to judge by.
const RECORDINGS: [&str; 3] = ["train-1", "train-2", "held-out"];

/// Those of the exploration; the last one judges.
const EXPLORED: [&str; 4] = ["explore-1", "explore-2", "explore-3", "explore-4"];

/// A recording that ended early is used if it is so long, s: one of the loop, one of pulses.
const LEAST_S: f64 = 5.0;
const LEAST_PULSES_S: f64 = 1.5;

/// Bring a board into service: settings, wiring, score, recordings, diagnosis,
/// improved settings, score, acceptance sheet.
///
/// Says before each motion what will move and within what, and waits for a key. It can be
/// stopped at any moment (the valve goes to its null) and gone on with: what is done
/// stands in FOLDER/commission.json. Every step is a command of its own, which is
/// shown.
#[derive(Args, Clone, Debug)]
pub struct CommissionArguments {
    /// Board, rig file and folder.
    #[command(flatten)]
    pub board: OnBoard,
    /// Begin again with this step.
    #[arg(long, value_name = "STEP", value_parser = step_of)]
    pub from: Option<Step>,
    /// End with this step.
    #[arg(long, value_name = "STEP", value_parser = step_of)]
    pub until: Option<Step>,
}

fn step_of(word: &str) -> Result<Step, String> {
    let found = Step::ALL.into_iter().find(|step| step.name() == word);
    found.ok_or_else(|| {
        let names: Vec<&str> = Step::ALL.iter().map(|step| step.name()).collect();
        format!("expected one of {}", names.join(", "))
    })
}

/// Runs the command.
///
/// # Errors
/// If a step cannot be done; what is done until then is kept.
pub fn run(arguments: &CommissionArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let rig = read_rig(&arguments.board.rig)?;
    fs::create_dir_all(&arguments.board.folder)?;
    let place = arguments.board.folder.join(PROGRESS);
    let read = Progress::read(&place);
    let mut progress = read.map_err(|error| bad_input(format!("{}: {error}", place.display())))?;
    if let Some(step) = arguments.from {
        progress.again_from(step);
    }
    let mut way = Way {
        arguments,
        rig: &rig,
        progress,
        out,
    };
    while let Some(step) = way.progress.next() {
        let number = step as usize + 1;
        let all = Step::ALL.len();
        writeln!(
            way.out,
            "\n{number} of {all}, {}: {}",
            step.name(),
            step.text()
        )?;
        way.out.flush()?;
        way.go(step)?;
        way.progress.done.push(step);
        write_json(&place, &way.progress)?;
        if arguments.until == Some(step) {
            return Ok(());
        }
    }
    let sheet = way.file("sheet.html");
    Ok(writeln!(way.out, "{sheet}")?)
}

struct Way<'a> {
    arguments: &'a CommissionArguments,
    rig: &'a Rig,
    progress: Progress,
    out: &'a mut dyn Write,
}

impl Way<'_> {
    fn path(&self, name: &str) -> PathBuf {
        self.arguments.board.folder.join(name)
    }

    fn file(&self, name: &str) -> String {
        self.path(name).display().to_string()
    }

    fn go(&mut self, step: Step) -> Result<(), CommandError> {
        match step {
            Step::Board => self.board(),
            // As of an unchecked axis: nothing can move far.
            Step::Settings => self.be_careful(&self.arguments.board.rig, Wiring::Unchecked),
            Step::Wiring => self.wiring(),
            // An axis that is not as the rig file says may not be scored yet: that is why it is diagnosed.
            Step::ScoreBefore => {
                let rig = self.arguments.board.rig.display().to_string();
                self.go_home()?;
                self.send(&rig, Wiring::Checked, Kept::UntilStart)?;
                let ended = self.experiment("before", programs::score(self.rig))?;
                self.progress.before = match ended {
                    None => Some(self.scored("before.csv")?.score()),
                    Some(why) => self.noted(&why).map(|()| None)?,
                };
                Ok(())
            }
            Step::Recordings => self.recordings(),
            Step::Exploration => self.exploration(),
            Step::FirstModel => self.first_model(),
            Step::Diagnosis => self.diagnosis(),
            Step::ImprovedSettings => {
                let improved = self.file("improved.toml");
                self.send(&improved, Wiring::Checked, Kept::Stored)
            }
            Step::ScoreAfter => {
                self.go_home()?;
                let ended = self.experiment("after", programs::score(self.rig))?;
                if let Some(why) = ended {
                    return Err(bad_input(why));
                }
                self.progress.after = Some(self.scored("after.csv")?.score());
                Ok(())
            }
            Step::Sheet => self.sheet(),
        }
    }

    fn noted(&mut self, what: &str) -> Result<(), CommandError> {
        note(what, self.out)
    }

    fn wiring(&mut self) -> Result<(), CommandError> {
        let [rig, folder] = [&self.arguments.board.rig, &self.arguments.board.folder];
        let [rig, folder] = [rig, folder].map(|path| path.display().to_string());
        let serial = &self.arguments.board.port.serial;
        let words = ["board", "check-wiring", "--rig", &rig, "--serial", serial];
        announce(&[&words[..], &["--folder", &folder]].concat(), self.out)?;
        check(&self.arguments.board, self.rig, self.out)
    }

    /// What the board says; a fault ends the way here.
    fn board(&mut self) -> Result<(), CommandError> {
        let status = self.arguments.board.asked(orders::status)?;
        for line in words::lines(&status) {
            writeln!(self.out, "  {line}")?;
        }
        self.progress.firmware = words::program(&status);
        if let Some(finding) = status.finding {
            return Err(bad_input(words::fault_line(finding)));
        }
        Ok(())
    }

    /// Settings to the board, whose wiring was checked or not; what is only tried is not stored.
    fn send(&mut self, rig: &str, wiring: Wiring, kept: Kept) -> Result<(), CommandError> {
        let board = &self.arguments.board;
        let mut words = vec!["settings", "--rig", rig, "--serial", &board.port.serial];
        words.extend((wiring == Wiring::Checked).then_some("--wiring-checked"));
        words.extend((kept == Kept::UntilStart).then_some("--try-out"));
        announce(&words, self.out)?;
        let settings = (&read_rig(Path::new(rig))?, rig);
        board.send(settings, (wiring, kept), self.out)
    }

    /// The loop is slower meanwhile: it is to stay quiet about an axis of which the settings do not
    /// know all.
    fn be_careful(&mut self, rig: &Path, wiring: Wiring) -> Result<(), CommandError> {
        let careful = self.path("careful.toml");
        let text = Rig::edited_file(rig, &programs::careful(&read_rig(rig)?));
        write_text(&careful, &text.map_err(bad_input)?)?;
        self.send(&careful.display().to_string(), wiring, Kept::UntilStart)
    }

    fn experiment(
        &mut self,
        name: &str,
        program: Option<String>,
    ) -> Result<Option<String>, CommandError> {
        let rig = self.arguments.board.rig.display();
        let text = program.ok_or_else(|| {
            bad_input(format!(
                "{rig}: the stroke is not known: give [cylinder] stroke_m"
            ))
        })?;
        let ended = self.arguments.board.experiment((name, &text), self.out)?;
        Ok(ended.map(|ended| ended.why))
    }

    /// Pulses from about the middle. A run that leaves the places of its envelope has shown something too.
    fn exploration(&mut self) -> Result<(), CommandError> {
        self.be_careful(&self.arguments.board.rig, Wiring::Checked)?;
        for (number, name) in EXPLORED.into_iter().enumerate() {
            self.go_home()?;
            let program =
                programs::exploration(self.rig, number).map_err(|fault| self.no_axis(fault))?;
            if let Some(why) = self.experiment(name, program)? {
                self.use_until_then(name, &why, LEAST_PULSES_S)?;
            }
        }
        // One to learn from, one to judge by.
        if self.used(&EXPLORED).len() < 2 {
            let why =
                "the pulses showed too little: none or one of their recordings is long enough";
            return Err(bad_input(why));
        }
        Ok(())
    }

    /// To the middle of the stroke, if the load is not near it.
    fn go_home(&mut self) -> Result<(), CommandError> {
        let position_m = stands_at_m(&self.arguments.board)?;
        let program =
            programs::homeward(self.rig, position_m).map_err(|fault| self.no_axis(fault))?;
        if program.is_some() {
            // It ends where it leaves its envelope, in the middle.
            self.experiment("homeward", program)?;
        }
        Ok(())
    }

    fn no_axis(&self, fault: AxisFault) -> CommandError {
        rig_fault(&self.arguments.board.rig, fault)
    }

    /// A recording that ended early is used if it is long enough, else it is left out.
    fn use_until_then(&mut self, name: &str, why: &str, least_s: f64) -> Result<(), CommandError> {
        let path = self.path(&format!("{name}.csv"));
        let recording = Recording::read(&path, &self.rig.signals).map_err(bad_input)?;
        let seconds = recording.duration_s();
        if seconds < least_s {
            fs::remove_file(path)?;
            return self.noted(&format!(
                "{why}; {seconds:.1} s are too little and are left out"
            ));
        }
        self.noted(&format!("{why}; the {seconds:.1} s until then are used"))
    }

    /// Those of these recordings that there are.
    fn used<'n>(&self, names: &[&'n str]) -> Vec<&'n str> {
        let is_there = |name: &&&str| self.path(&format!("{name}.csv")).exists();
        names.iter().filter(is_there).copied().collect()
    }

    /// The rig by the pulses.
    fn first_model(&mut self) -> Result<(), CommandError> {
        let used = self.used(&EXPLORED);
        let Some((judge, train)) = used.split_last() else {
            return Err(bad_input(
                "no recording of the exploration is there: --from exploration",
            ));
        };
        self.diagnose(train, &[judge], ["first.toml", "first.html", "first.json"])?;
        Ok(())
    }

    /// A run that ends early has shown something too, if it lasted.
    fn recordings(&mut self) -> Result<(), CommandError> {
        let first = self.path("first.toml");
        self.be_careful(&first, Wiring::Checked)?;
        for (number, name) in RECORDINGS.into_iter().enumerate() {
            self.go_home()?;
            if let Some(why) = self.experiment(name, programs::varied(self.rig, number))? {
                self.use_until_then(name, &why, LEAST_S)?;
                // A loop that swung was made slower; with new settings it begins anew.
                self.be_careful(&first, Wiring::Checked)?;
            }
        }
        Ok(())
    }

    fn diagnosis(&mut self) -> Result<(), CommandError> {
        let train = self.used(&[&EXPLORED[..2], &RECORDINGS[..2]].concat());
        let held_out = self.used(&[&EXPLORED[2..], &RECORDINGS[2..]].concat());
        let verdict = self.diagnose(
            &train,
            &held_out,
            ["improved.toml", "diagnosis.html", "verdict.json"],
        )?;
        self.progress.verdict = verdict["sentence"].as_str().map(str::to_owned);
        Ok(())
    }

    /// A diagnosis of these recordings; it writes improved rig, report and verdict.
    fn diagnose(
        &mut self,
        train: &[&str],
        held_out: &[&str],
        outputs: [&str; 3],
    ) -> Result<Value, CommandError> {
        let rig = self.arguments.board.rig.display().to_string();
        let files = |names: &[&str]| -> Vec<String> {
            names
                .iter()
                .map(|name| self.file(&format!("{name}.csv")))
                .collect()
        };
        let (train, held_out) = (files(train), files(held_out));
        let [improved, report, json] = outputs.map(|name| self.file(name));
        let mut words = vec!["diagnose", "--rig", &rig, "--train"];
        words.extend(train.iter().map(String::as_str));
        words.push("--held-out");
        words.extend(held_out.iter().map(String::as_str));
        words.extend([
            "--improved-rig",
            &improved,
            "--report",
            &report,
            "--json",
            &json,
        ]);
        announce(&words, self.out)?;
        diagnose::run(&typed::<DiagnoseArguments>(&words)?, self.out)?;
        let text = fs::read_to_string(&json)?;
        serde_json::from_str(&text).map_err(bad_input)
    }

    fn scored(&mut self, name: &str) -> Result<Run, CommandError> {
        let run = Run::read(&self.path(name), self.rig).map_err(bad_input)?;
        let score = run.score();
        writeln!(
            self.out,
            "  {:.3} mm at rest after moves, {:.3} mm in the sine (rms {:.3})",
            score.at_rest_mm, score.in_sine_mm, score.in_sine_rms_mm
        )?;
        Ok(run)
    }

    fn sheet(&mut self) -> Result<(), CommandError> {
        let before = self.progress.before.map(|_| self.scored("before.csv"));
        let runs = Runs {
            before: before.transpose()?,
            after: self.scored("after.csv")?,
        };
        let rig = bare_name(&self.arguments.board.rig);
        let date = jiff::Timestamp::now().strftime("%Y-%m-%d").to_string();
        let mut page = sheet(&rig, &date, &self.progress, &runs);
        let files = [
            self.arguments.board.rig.clone(),
            self.path("before.csv"),
            self.path("after.csv"),
        ];
        page.provenance(provenance(&files));
        let path = self.path("sheet.html");
        write_page(&path, &page)
    }
}
