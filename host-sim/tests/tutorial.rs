//! `docs/tutorial.md`, command by command, as its reader types them.
//!
//! The page's `sh` blocks are run in a folder with the recordings of the fixture; its
//! `text` blocks need an axis or a network and are not.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const PAGE: &str = include_str!("../../docs/tutorial.md");
/// What the page calls the files of the fixture.
const FILES: [(&str, &str); 3] = [
    ("train-1.csv", "steps.csv"),
    ("train-2.csv", "mixed.csv"),
    ("held-out.csv", "proof.csv"),
];

fn fixture() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/leaking-axis")
}

/// The commands of the page's blocks in this language.
fn commands(language: &str) -> Vec<&'static str> {
    let begin = format!("```{language}");
    let mut lines = PAGE.lines();
    let mut all = Vec::new();
    while lines.any(|line| line == begin) {
        all.extend(lines.by_ref().take_while(|line| *line != "```"));
    }
    all
}

/// Runs what somebody types in a shell.
fn typed(line: &str, folder: &Path) -> Output {
    let program = Path::new(env!("CARGO_BIN_EXE_pneuma"));
    let before = std::env::var_os("PATH").unwrap_or_default();
    let folders = program.parent().map(Path::to_owned).into_iter();
    let path = std::env::join_paths(folders.chain(std::env::split_paths(&before)));
    let mut shell = Command::new("sh");
    shell.args(["-e", "-c", line]).current_dir(folder);
    shell.env("PATH", path.expect("a search path"));
    shell.output().expect("the shell runs")
}

/// The commands that the program has.
fn known(folder: &Path) -> String {
    String::from_utf8(typed("pneuma --help", folder).stdout).expect("text")
}

fn is_known(command: &str, help: &str) -> bool {
    help.lines()
        .any(|line| line.split_whitespace().next() == Some(command))
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_the_tutorial_s_commands_end_in_the_right_verdict() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    for (name, called) in FILES {
        fs::copy(fixture().join(name), folder.join(called)).expect("a file of the fixture");
    }
    let commands = commands("sh");
    assert!(commands.len() >= 8, "{commands:?}");
    for line in commands {
        let output = typed(line, folder);
        let (out, problem) = (
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr),
        );
        assert!(output.status.success(), "`{line}`: {out}{problem}");
    }
    let verdict = fs::read_to_string(folder.join("verdict.json")).expect("the verdict");
    let verdict: serde_json::Value = serde_json::from_str(&verdict).expect("JSON");
    assert_eq!(verdict["verdict"], "named", "{verdict}");
    let effects = verdict["effects"].as_array().expect("effects");
    let names: Vec<_> = effects.iter().map(|one| &one["effect"]).collect();
    assert_eq!(names, ["piston-leakage"], "{verdict}");
    let fit = |model: &str| verdict["fit"][model]["free_run_held_out"]["p_b"].as_f64();
    let (refitted, improved) = (fit("refitted"), fit("improved"));
    assert!(improved < refitted, "{refitted:?}, {improved:?}");
    for page in ["valve.html", "before.html", "report.html", "after.html"] {
        assert!(folder.join(page).is_file(), "{page}");
    }
}

#[test]
fn prop_what_the_tutorial_shows_for_a_board_is_a_command_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let help = known(folder.path());
    let shown = commands("text");
    let shown = shown.iter().filter_map(|line| line.strip_prefix("pneuma "));
    let shown: Vec<&str> = shown.filter(|rest| !rest.starts_with("--")).collect();
    assert!(shown.len() >= 2, "{shown:?}");
    for rest in shown {
        let mut words = rest.split_whitespace();
        let command = words.next().unwrap_or_default();
        assert!(is_known(command, &help), "{rest}");
        let options = typed(&format!("pneuma {command} --help"), folder.path()).stdout;
        let options = String::from_utf8(options).expect("text");
        for option in words.filter(|word| word.starts_with("--")) {
            assert!(options.contains(option), "`pneuma {rest}`: {option}");
        }
    }
}
