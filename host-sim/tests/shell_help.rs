//! Completions, the manual and the demo's folder, as a user meets them.

use std::fs;
use std::process::{Command, Output};

fn pneuma(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pneuma"))
        .args(arguments)
        .output()
        .expect("the program runs")
}

fn text(arguments: &[&str]) -> String {
    let output = pneuma(arguments);
    assert!(output.status.success(), "{arguments:?}: {output:?}");
    String::from_utf8(output.stdout).expect("text")
}

/// The commands that `--help` lists.
fn commands() -> Vec<String> {
    let help = text(&["--help"]);
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let lines = lines.take_while(|line| !line.is_empty());
    let names = lines.filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    let names = names.filter(|name| !name.is_empty()).map(str::to_owned);
    names.collect()
}

#[test]
fn prop_completions_and_manual_know_every_command() {
    let commands = commands();
    assert!(commands.len() > 10, "{commands:?}");
    for shell in ["bash", "zsh", "fish"] {
        let script = text(&["completions", shell]);
        for command in &commands {
            assert!(script.contains(command.as_str()), "{shell}: {command}");
        }
    }
    assert!(text(&["man"]).contains(".TH pneuma 1"));
    for command in commands.iter().filter(|command| *command != "help") {
        let page = text(&["man", command]);
        assert!(page.contains(&format!(".TH pneuma-{command} 1")), "{page}");
    }
}

#[test]
fn val_an_unknown_command_has_no_page() {
    let output = pneuma(&["man", "diagnos"]);
    assert_eq!(output.status.code(), Some(2));
    let problem = String::from_utf8(output.stderr).expect("text");
    assert_eq!(problem.lines().count(), 1, "{problem}");
}

#[test]
fn val_the_demo_writes_over_nobody_s_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let mine = folder.path().join("train-1.csv");
    fs::write(&mine, "mine").expect("a file");
    let output = pneuma(&["demo", "--out", &folder.path().display().to_string()]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert_eq!(fs::read_to_string(&mine).expect("my file"), "mine");
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
}
