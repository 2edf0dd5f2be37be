//! Running commands, headings, failures.

use std::fmt;
use std::fs;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// The variable that says where recordings of real axes are.
pub const RECORDINGS: &str = "PNEUMA_RECORDINGS";

/// What a task comes to.
pub type Outcome<T = ()> = Result<T, Failure>;

/// Why a task failed, in words for its user.
#[derive(Debug)]
pub struct Failure(String);

impl fmt::Display for Failure {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

impl From<String> for Failure {
    fn from(message: String) -> Self {
        Self(message)
    }
}

impl From<&str> for Failure {
    fn from(message: &str) -> Self {
        Self(message.to_owned())
    }
}

/// The root of the repository.
pub fn root() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().unwrap_or(manifest).to_owned()
}

/// Where the recordings are, if anywhere: in `$PNEUMA_RECORDINGS`, else beside the repository.
pub fn recordings() -> PathBuf {
    let beside = || root().join("../shared/recordings");
    std::env::var_os(RECORDINGS).map_or_else(beside, PathBuf::from)
}

/// A file of JSON.
pub fn read_json(path: &Path) -> Result<serde_json::Value, Failure> {
    let text = fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    serde_json::from_str(&text).map_err(|error| format!("{}: {error}", path.display()).into())
}

/// Where cargo builds.
pub fn target_directory() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

/// Whether somebody watches: then long work shows its progress.
pub fn is_watched() -> bool {
    std::io::stderr().is_terminal()
}

/// A command in the root of the repository.
pub fn command(program: impl AsRef<Path>, arguments: &[&str]) -> Command {
    let mut command = Command::new(program.as_ref());
    command.args(arguments).current_dir(root());
    command
}

/// The cargo that started this program.
pub fn cargo(arguments: &[&str]) -> Command {
    command("cargo", arguments)
}

/// The command as somebody would type it.
pub fn as_typed(command: &Command) -> String {
    let mut words: Vec<String> = Vec::new();
    for (name, value) in command.get_envs() {
        if let Some(value) = value {
            words.push(format!(
                "{}={}",
                name.display(),
                quoted(&value.to_string_lossy())
            ));
        }
    }
    words.push(quoted(&command.get_program().to_string_lossy()));
    words.extend(
        command
            .get_args()
            .map(|argument| quoted(&argument.to_string_lossy())),
    );
    words.join(" ")
}

fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_=./:,+@".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{word}'")
    }
}

/// Run to the end, output as it comes.
pub fn run(command: &mut Command) -> Outcome {
    let status = command
        .status()
        .map_err(|error| format!("`{}` did not start: {error}", as_typed(command)))?;
    if status.success() {
        Ok(())
    } else {
        Err(format!("`{}` failed ({status})", as_typed(command)).into())
    }
}

/// Run and keep what it prints; `None` if it cannot run or fails.
pub fn output_of(command: &mut Command) -> Option<String> {
    let output = command
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .output()
        .ok()?;
    let text = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    output.status.success().then_some(text)
}

/// Whether the command runs and succeeds, its output unseen.
pub fn succeeds(command: &mut Command) -> bool {
    output_of(command).is_some()
}

/// A duration for people.
pub fn in_words(duration: Duration) -> String {
    let seconds = duration.as_secs_f64();
    if seconds < 60.0 {
        format!("{seconds:.1} s")
    } else {
        format!(
            "{} min {:02} s",
            duration.as_secs() / 60,
            duration.as_secs() % 60
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_shown_as_typed() {
        let mut command = command("cargo", &["clippy", "--", "-D", "warnings"]);
        assert_eq!(as_typed(&command), "cargo clippy -- -D warnings");
        command
            .env("RUSTDOCFLAGS", "-D warnings")
            .env_remove("CARGO");
        assert_eq!(
            as_typed(&command),
            "RUSTDOCFLAGS='-D warnings' cargo clippy -- -D warnings"
        );
    }

    #[test]
    fn durations_are_readable() {
        assert_eq!(in_words(Duration::from_millis(340)), "0.3 s");
        assert_eq!(in_words(Duration::from_secs(125)), "2 min 05 s");
    }

    #[test]
    fn a_failing_command_names_itself() {
        let failure = run(&mut command("false", &["really"])).unwrap_err();
        assert!(failure.to_string().starts_with("`false really` failed"));
        assert!(run(&mut command("no-such-program-anywhere", &[])).is_err());
        assert!(output_of(&mut command("false", &[])).is_none());
    }
}
