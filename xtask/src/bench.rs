//! Run the benchmarks and write their part of `docs/benchmarks.md`.

use crate::estimates::{Row, parse_estimates, parse_name, table};
use crate::generated::Part;
use crate::shell::{self, Outcome, cargo, command};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// The page, and the table's part of it.
const PAGE: &str = "docs/benchmarks.md";
const PART: Part = Part {
    name: "time per call",
    task: "cargo xtask bench",
};
const SECONDS_PER_DAY: u64 = 86_400;

/// What was asked for.
#[derive(Debug, Default, PartialEq)]
struct Request {
    /// The benchmark that the others are compared with; the first if not named.
    reference: Option<String>,
    /// Do not run, only write.
    table_only: bool,
}

/// The task `bench`.
pub fn run(options: &[String]) -> Outcome {
    let request = parse_request(options)?;
    let begin = SystemTime::now();
    if !request.table_only {
        shell::run(&mut cargo(&["bench", "--workspace", "--bench", "*"]))?;
    }
    // After a run, older estimates belong to benchmarks that no longer exist.
    let oldest = if request.table_only {
        UNIX_EPOCH
    } else {
        begin
    };
    let rows = collect(&shell::target_directory().join("criterion"), oldest)?;
    let reference = find_reference(&rows, request.reference.as_deref())?;
    let text = document(&table(&rows, reference), &Conditions::here());
    PART.write(PAGE, &text)?;
    println!("{text}");
    println!("written: {PAGE}");
    Ok(())
}

fn parse_request(options: &[String]) -> Outcome<Request> {
    let mut request = Request::default();
    let mut words = options.iter().map(String::as_str);
    while let Some(word) = words.next() {
        match word {
            "--table-only" => request.table_only = true,
            "--reference" => {
                let name = words
                    .next()
                    .ok_or("--reference wants the name of a benchmark")?;
                request.reference = Some(name.to_owned());
            }
            other => return Err(format!("bench: unknown option {other}").into()),
        }
    }
    Ok(request)
}

/// All benchmarks under `directory` whose estimates are not older than `oldest`, by name.
fn collect(directory: &Path, oldest: SystemTime) -> Outcome<Vec<Row>> {
    let mut rows = Vec::new();
    for file in estimate_files(directory) {
        let modified = fs::metadata(&file).and_then(|data| data.modified());
        if modified.is_ok_and(|time| time >= oldest) {
            rows.push(read_row(&file)?);
        }
    }
    if rows.is_empty() {
        return Err(format!("no estimates of criterion under {}", directory.display()).into());
    }
    rows.sort_by(|first, second| first.name.cmp(&second.name));
    Ok(rows)
}

fn estimate_files(directory: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![directory.to_owned()];
    while let Some(directory) = open.pop() {
        let Ok(entries) = fs::read_dir(&directory) else {
            continue;
        };
        for path in entries.flatten().map(|entry| entry.path()) {
            if path.ends_with("new/estimates.json") {
                found.push(path);
            } else if path.is_dir() {
                open.push(path);
            }
        }
    }
    found
}

fn read_row(estimates: &Path) -> Outcome<Row> {
    let read = |path: &Path| {
        fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))
    };
    let name = parse_name(&read(&estimates.with_file_name("benchmark.json"))?);
    let median = parse_estimates(&read(estimates)?);
    match (name, median) {
        (Some(name), Some(median)) => Ok(Row { name, median }),
        _ => Err(format!("{}: not in criterion's form", estimates.display()).into()),
    }
}

fn find_reference<'a>(rows: &'a [Row], name: Option<&str>) -> Outcome<&'a Row> {
    let Some(name) = name else {
        return rows.first().ok_or_else(|| "no benchmarks".into());
    };
    let names = || {
        rows.iter()
            .map(|row| row.name.as_str())
            .collect::<Vec<_>>()
            .join(", ")
    };
    rows.iter()
        .find(|row| row.name == name)
        .ok_or_else(|| format!("no benchmark {name}; there are: {}", names()).into())
}

/// What the numbers were measured with.
struct Conditions {
    commit: String,
    compiler: String,
    processor: String,
    date: String,
}

impl Conditions {
    fn here() -> Self {
        let unknown = || "unknown".to_owned();
        let cores = std::thread::available_parallelism().map_or(0, usize::from);
        let processor = fs::read_to_string("/proc/cpuinfo")
            .ok()
            .and_then(|text| processor_name(&text))
            .unwrap_or_else(unknown);
        let compiler = shell::output_of(&mut command("rustc", &["--version"]));
        Self {
            commit: commit().unwrap_or_else(unknown),
            compiler: compiler.unwrap_or_else(unknown),
            processor: format!("{processor}, {cores} threads"),
            date: date(SystemTime::now()),
        }
    }
}

fn commit() -> Option<String> {
    let git = |arguments: &[&str]| shell::output_of(&mut command("git", arguments));
    let commit = git(&["rev-parse", "--short=12", "HEAD"])?;
    let is_clean = git(&["status", "--porcelain", "--", ":!docs/benchmarks.md"])?.is_empty();
    Some(if is_clean {
        commit
    } else {
        format!("{commit} with uncommitted changes")
    })
}

fn processor_name(cpuinfo: &str) -> Option<String> {
    let line = cpuinfo
        .lines()
        .find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// The day in UTC, as year-month-day.
fn date(time: SystemTime) -> String {
    let seconds = time
        .duration_since(UNIX_EPOCH)
        .map_or(0, |since| since.as_secs());
    let (year, month, day) = civil_from_days(seconds / SECONDS_PER_DAY);
    format!("{year}-{month:02}-{day:02}")
}

/// Days since 1970-01-01 to the Gregorian calendar, counted from 0000-03-01 so that
/// the leap day ends a year (H. Hinnant, chrono-compatible low-level date algorithms).
fn civil_from_days(days: u64) -> (u64, u64, u64) {
    let days = days + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 {
        month_from_march + 3
    } else {
        month_from_march - 9
    };
    (era * 400 + year_of_era + u64::from(month <= 2), month, day)
}

fn document(table: &str, conditions: &Conditions) -> String {
    let Conditions {
        commit,
        compiler,
        processor,
        date,
    } = conditions;
    format!(
        "- commit: {commit}\n\
         - compiler: {compiler}, profile `bench`\n\
         - processor: {processor}\n\
         - date: {date}\n\
         - method: criterion; median of the time per iteration, with the bootstrap \
         confidence interval of the median. Compare ratios, not times, between machines.\n\n\
         {table}"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimates::Median;
    use std::time::Duration;

    fn words(text: &str) -> Vec<String> {
        text.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn options_are_read() {
        assert_eq!(parse_request(&[]).unwrap(), Request::default());
        let request = parse_request(&words("--table-only --reference fit/decay")).unwrap();
        let expected = Request {
            reference: Some("fit/decay".to_owned()),
            table_only: true,
        };
        assert_eq!(request, expected);
        assert!(parse_request(&words("--reference")).is_err());
        assert!(parse_request(&words("--fast")).is_err());
    }

    #[test]
    fn dates_are_gregorian() {
        // Checked with date --utc --date=@SECONDS +%F.
        for (seconds, expected) in [
            (0, "1970-01-01"),
            (951_782_400, "2000-02-29"),
            (951_868_800, "2000-03-01"),
            (1_735_689_599, "2024-12-31"),
            (4_107_542_400, "2100-03-01"),
        ] {
            assert_eq!(date(UNIX_EPOCH + Duration::from_secs(seconds)), expected);
        }
    }

    #[test]
    fn the_processor_is_named() {
        let text = "processor\t: 0\nmodel name\t: Some CPU @ 2.00GHz\nflags\t: fpu\n";
        assert_eq!(processor_name(text).as_deref(), Some("Some CPU @ 2.00GHz"));
        assert_eq!(processor_name("BogoMIPS: 1"), None);
    }

    #[test]
    fn an_unknown_reference_lists_the_known() {
        let median = Median {
            nanoseconds: 1.0,
            lower: 1.0,
            upper: 1.0,
            level: 0.95,
        };
        let rows = [
            Row {
                name: "a".to_owned(),
                median,
            },
            Row {
                name: "b".to_owned(),
                median,
            },
        ];
        assert_eq!(find_reference(&rows, None).unwrap().name, "a");
        assert_eq!(find_reference(&rows, Some("b")).unwrap().name, "b");
        let message = find_reference(&rows, Some("c")).unwrap_err().to_string();
        assert_eq!(message, "no benchmark c; there are: a, b");
    }

    #[test]
    fn the_document_says_how_it_was_made() {
        let conditions = Conditions {
            commit: "abc".to_owned(),
            compiler: "rustc 1.95.0".to_owned(),
            processor: "CPU, 2 threads".to_owned(),
            date: "2026-01-02".to_owned(),
        };
        let text = document("| table |\n", &conditions);
        for part in ["abc", "rustc 1.95.0", "CPU, 2", "2026-01-02"] {
            assert!(text.contains(part), "{part}");
        }
        assert!(text.ends_with("\n\n| table |\n"));
    }
}
