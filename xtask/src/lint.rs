//! Rules of this repository that no compiler knows.
//!
//! - Only `firmware/src/board/` may ask for a target: everywhere else the same
//!   code runs on chip and host, and a condition would split what is compared.
//!   `square-root/` may, whose result has the same bits on every target.
//! - Only the board's part of the application may be unsafe: the compiler cannot tell, since what
//!   the framework generates is unsafe too.
//! - `model-core` is `no_std`: also when a host build would not notice.
//! - No files and no rooms stand on each other in a circle ([`crate::circles`]).
//! - No function is longer than a page ([`crate::lengths`]), but for start-up sequences and tables of
//!   the firmware.
//! - Every package that is built in may be given on ([`licences`]).
//! - Nothing is built twice for want of a feature ([`features`]).

use crate::circles::{circles, circles_of_rooms};
use crate::features;
use crate::lengths::{MOST_LINES, long_functions};
use crate::licences;
use crate::shell::{self, Outcome};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The one place that may know its target.
const BOARD: &str = "firmware/src/board";
/// The one room whose result no target changes.
const SQUARE_ROOT: &str = "square-root/src";
/// Where the application's sources lie.
const FIRMWARE: &str = "firmware/src";
/// Directories of the root that hold no sources of ours.
const SKIPPED: [&str; 2] = ["target", "out"];
/// Conditions on the target.
const TARGET_CONDITIONS: [&str; 2] = ["target_os", "target_arch"];

/// The task `lint`.
pub fn run() -> Outcome {
    let root = shell::root();
    let mut findings = Vec::new();
    let sources = rust_sources(&root)?;
    for path in &sources {
        let text = read(path)?;
        let shown = path.strip_prefix(&root).unwrap_or(path);
        if !shown.starts_with(BOARD) {
            let conditions = target_conditions(&text).into_iter();
            for line in conditions.filter(|_| !shown.starts_with(SQUARE_ROOT)) {
                findings.push(format!("{}:{line}: asks for its target", shown.display()));
            }
            for line in unsafe_lines(&text).filter(|_| shown.starts_with(FIRMWARE)) {
                findings.push(format!("{}:{line}: is unsafe", shown.display()));
            }
        }
    }
    findings.extend(long_lines(&root, &sources)?);
    if !is_no_std(&read(&root.join("model-core/src/lib.rs"))?) {
        findings.push("model-core/src/lib.rs: `#![no_std]` is missing".to_owned());
    }
    findings.extend(circle_lines(&root, &sources)?);
    findings.extend(features::findings()?);
    findings.extend(licences::findings()?);
    if findings.is_empty() {
        println!("lint: {} files, nothing found", sources.len());
        return Ok(());
    }
    Err(findings.join("\n").into())
}

/// The functions that are too long, a line each.
fn long_lines(root: &Path, sources: &[PathBuf]) -> Outcome<Vec<String>> {
    let mut lines = Vec::new();
    for path in sources {
        let shown = path.strip_prefix(root).unwrap_or(path);
        if shown.starts_with(FIRMWARE) || !shown.components().any(|part| part.as_os_str() == "src")
        {
            continue;
        }
        for (line, name, length) in long_functions(&read(path)?) {
            let shown = shown.display();
            lines.push(format!(
                "{shown}:{line}: `{name}` has {length} lines, expected {MOST_LINES} at the most"
            ));
        }
    }
    Ok(lines)
}

/// A rig file's keys are those of the effects' declarations, and declarations ask the rig: these
/// rooms are read together.
const READ_TOGETHER: &str = "grey-box";

/// The circles of files and rooms in any crate, a line each.
fn circle_lines(root: &Path, sources: &[PathBuf]) -> Outcome<Vec<String>> {
    let mut crates: BTreeMap<String, Vec<(String, String)>> = BTreeMap::new();
    for path in sources {
        let shown = path.strip_prefix(root).unwrap_or(path);
        let shown = shown.to_string_lossy().replace('\\', "/");
        if let Some((name, within)) = shown.split_once("/src/") {
            let of_crate = crates.entry(name.to_owned()).or_default();
            of_crate.push((within.to_owned(), read(path)?));
        }
    }
    let lines = |(name, of_crate): (&String, &Vec<(String, String)>)| {
        let line = |files: Vec<String>| {
            let files = files.join(", ");
            format!("{name}/src: these stand on each other in a circle: {files}")
        };
        let rooms = (name != READ_TOGETHER).then(|| circles_of_rooms(of_crate));
        circles(of_crate)
            .into_iter()
            .chain(rooms.into_iter().flatten())
            .map(line)
            .collect::<Vec<String>>()
    };
    Ok(crates.iter().flat_map(lines).collect())
}

fn read(path: &Path) -> Outcome<String> {
    fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()).into())
}

/// All Rust files under `root`, in a fixed order.
fn rust_sources(root: &Path) -> Outcome<Vec<PathBuf>> {
    let mut found = Vec::new();
    let mut open = vec![root.to_owned()];
    while let Some(directory) = open.pop() {
        let entries =
            fs::read_dir(&directory).map_err(|e| format!("{}: {e}", directory.display()))?;
        for entry in entries.flatten() {
            let (path, name) = (entry.path(), entry.file_name());
            let name = name.to_string_lossy();
            let is_skipped =
                name.starts_with('.') || (directory == root && SKIPPED.contains(&name.as_ref()));
            let kind = entry
                .file_type()
                .map_err(|e| format!("{}: {e}", path.display()))?;
            if kind.is_dir() && !is_skipped {
                open.push(path);
            } else if kind.is_file() && name.ends_with(".rs") {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

/// Lines on which a `cfg(…)` that asks for the target begins; also one that spans lines.
fn target_conditions(text: &str) -> Vec<usize> {
    let code = without_line_comments(text);
    let mut lines = Vec::new();
    for opening in ["cfg(", "cfg!(", "cfg_attr("] {
        for (place, _) in code.match_indices(opening) {
            let condition = inside_parentheses(&code[place + opening.len()..]);
            if TARGET_CONDITIONS
                .iter()
                .any(|name| condition.contains(name))
            {
                lines.push(code[..place].matches('\n').count() + 1);
            }
        }
    }
    lines.sort_unstable();
    lines
}

/// Lines with the word `unsafe`, or with permission for it.
fn unsafe_lines(text: &str) -> impl Iterator<Item = usize> {
    let code = without_line_comments(text);
    let is_unsafe = |line: &str| {
        let mut words = line.split(|c: char| !c.is_alphanumeric() && c != '_');
        let may_be = line.contains("allow(") || line.contains("expect(");
        words.any(|word| word == "unsafe" || (word == "unsafe_code" && may_be))
    };
    let found = code.lines().enumerate().filter(|(_, line)| is_unsafe(line));
    found
        .map(|(place, _)| place + 1)
        .collect::<Vec<_>>()
        .into_iter()
}

fn without_line_comments(text: &str) -> String {
    let code = |line: &str| line.split("//").next().unwrap_or_default().to_owned();
    text.lines().map(code).collect::<Vec<_>>().join("\n")
}

/// Up to the parenthesis that closes the one already open.
fn inside_parentheses(text: &str) -> &str {
    let mut depth = 1;
    for (place, character) in text.char_indices() {
        match character {
            '(' => depth += 1,
            ')' => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return &text[..place];
        }
    }
    text
}

fn is_no_std(text: &str) -> bool {
    without_line_comments(text)
        .lines()
        .any(|line| line.trim() == "#![no_std]")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Written with a placeholder: the lint reads this file, too.
    fn source(text: &str) -> String {
        text.replace("CONDITION", "cfg")
            .replace("SYSTEM", TARGET_CONDITIONS[0])
    }

    #[test]
    fn conditions_on_the_target_are_found_with_their_line() {
        let text = source("fn a() {}\n#[CONDITION(SYSTEM = \"none\")]\nfn b() {}\n");
        assert_eq!(target_conditions(&text), [2]);
        let text = source("#[CONDITION(all(\n  unix,\n  not(SYSTEM = \"none\")\n))]\n");
        assert_eq!(target_conditions(&text), [1]);
        let text = source("if CONDITION!(SYSTEM = \"linux\") {}");
        assert_eq!(target_conditions(&text), [1]);
        let text = source("#[CONDITION_attr(SYSTEM = \"none\", no_std)]");
        assert_eq!(target_conditions(&text), [1]);
    }

    #[test]
    fn comments_and_other_conditions_are_left_alone() {
        let text = source("// CONDITION(SYSTEM = \"none\")\n#[CONDITION(test)]\nlet SYSTEM = 1;\n");
        assert!(target_conditions(&text).is_empty());
    }

    #[test]
    fn unsafe_code_is_found_and_its_prohibition_left_alone() {
        let text = "fn a() {}\nunsafe fn b() {}\n#![expect(unsafe_code)]\n// unsafe\n";
        assert_eq!(unsafe_lines(text).collect::<Vec<_>>(), [2, 3]);
        assert_eq!(unsafe_lines("#![forbid(unsafe_code)]\n").count(), 0);
    }

    #[test]
    fn no_std_must_be_unconditional() {
        assert!(is_no_std("//! Text.\n\n#![no_std]\n"));
        assert!(!is_no_std("// #![no_std]\n"));
        assert!(!is_no_std("#![cfg_attr(not(test), no_std)]\n"));
    }

    #[test]
    fn this_repository_passes() {
        assert!(rust_sources(&shell::root()).unwrap().len() > 5);
        run().unwrap();
    }
}
