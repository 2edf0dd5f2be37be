//! Recordings as technicians bring them: what loggers, spreadsheets and terminals make of a
//! table of numbers.
//!
//! The same table in every dialect is the same recording to the bit; what cannot be read gets
//! one line with its place and the remedy; whatever was decided or left out is a remark.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use diagnosis::inspect::inspect;
use flate2::Compression;
use flate2::write::GzEncoder;
use host_sim::recording::{Recording, RecordingError};
use host_sim::rig::Rig;
use proptest::prelude::*;

// ---- the cases from the field

/// The cases, beside the recordings; `None` with a loud line.
fn cases(test: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/recordings");
    let recordings = std::env::var_os("PNEUMA_RECORDINGS").map_or(beside, PathBuf::from);
    let folder = recordings.join("../cases");
    if folder.join("README.md").is_file() {
        return Some(folder);
    }
    eprintln!(
        "SKIPPED {test}: no cases at {}; set PNEUMA_RECORDINGS to the recordings beside them",
        folder.display()
    );
    None
}

fn table_of(case: &Path) -> PathBuf {
    let mut files = fs::read_dir(case)
        .expect("a case")
        .map(|entry| entry.expect("an entry").path());
    files
        .find(|path| path.file_stem().is_some_and(|stem| stem == "run"))
        .expect("a recording")
}

/// The recording of a case, or the line that refuses it.
fn read_case(case: &Path) -> Result<(Rig, Recording), String> {
    let rig = Rig::read(case.join("rig.toml")).map_err(|error| error.to_string())?;
    let recording =
        Recording::read(table_of(case), &rig.signals).map_err(|error| error.to_string())?;
    Ok((rig, recording))
}

/// A case that is read: rows, rate, and a remark that must be made (empty: none may be).
const READ: &[(&str, usize, f64, &str)] = &[
    (
        "clock-column",
        1500,
        1000.0,
        "time counts from 09:12:31.000000 (line 2)",
    ),
    (
        "datetime-column",
        1500,
        1000.0,
        "time counts from 2026-03-02 09:12:31.000000 (line 2)",
    ),
    (
        "decimal-comma-quoted",
        1500,
        1000.0,
        "the decimal mark is a comma (from line 2)",
    ),
    (
        "decimal-comma-semicolon",
        1500,
        1000.0,
        "the decimal mark is a comma (from line 2)",
    ),
    (
        "decimal-comma-tab",
        1500,
        1000.0,
        "the decimal mark is a comma (from line 2)",
    ),
    ("encoder-counts-scaled", 6000, 1000.0, ""),
    (
        "epoch-ns",
        6000,
        1000.0,
        "time counts from 1772442751250000000 (line 2)",
    ),
    (
        "epoch-seconds",
        6000,
        1000.0,
        "time counts from 1772442751.250 (line 2)",
    ),
    (
        "labview-lvm",
        1500,
        1000.0,
        "the table begins at line 21; not read: lines 1 to 20 above it",
    ),
    (
        "micros-wrap",
        6000,
        1000.0,
        "the time wraps (a 32-bit counter) at line 3002: unwrapped",
    ),
    (
        "millis-wrap",
        6000,
        1000.0,
        "the time wraps (a 32-bit counter) at line 3002: unwrapped",
    ),
    ("milliampere-scaled", 6000, 1000.0, ""),
    (
        "nan-cells",
        5998,
        1000.0,
        "left out, first at line 102: column \"p_a_Pa\" in 2",
    ),
    (
        "one-duplicate-row",
        6000,
        1000.0,
        "repeats the row before is left out, first at line 3002",
    ),
    ("pretrigger", 6000, 1000.0, ""),
    (
        "putty-banner",
        1500,
        1000.0,
        "the table begins at line 2; not read: line 1 above it",
    ),
    ("quoted-comma-header", 1500, 1000.0, ""),
    (
        "uint16-tick-wrap",
        6000,
        1000.0,
        "the time wraps (a 16-bit counter) at line 538: unwrapped",
    ),
    ("unit-ns", 1500, 1000.0, ""),
    (
        "units-row",
        1500,
        1000.0,
        "line 2: units, which agree with the rig",
    ),
    ("utf16", 1500, 1000.0, ""),
];

#[test]
fn val_cases_that_are_read() {
    let Some(folder) = cases("val_cases_that_are_read") else {
        return;
    };
    for (name, rows, rate_hz, remark) in READ {
        let (rig, recording) =
            read_case(&folder.join(name)).unwrap_or_else(|line| panic!("{line}"));
        let inspection = inspect(&rig, &recording);
        assert_eq!(recording.len(), *rows, "{name}");
        assert!(
            (inspection.timing.rate_hz / rate_hz - 1.0).abs() < 1e-6,
            "{name}"
        );
        assert_eq!(inspection.faults, [], "{name}");
        let said = recording.remarks.iter().any(|said| said.contains(remark));
        assert!(said || remark.is_empty(), "{name}: {:?}", recording.remarks);
        assert_eq!(recording.remarks.is_empty(), remark.is_empty(), "{name}");
        assert!(
            recording
                .remarks
                .iter()
                .all(|said| inspection.notes.contains(said)),
            "{name}"
        );
    }
}

/// These hold the same rows: what differs is how they are written.
#[test]
fn val_cases_of_one_table_give_its_values() {
    const SAME: [&str; 12] = [
        "clock-column",
        "datetime-column",
        "decimal-comma-quoted",
        "decimal-comma-semicolon",
        "decimal-comma-tab",
        "epoch-ns",
        "epoch-seconds",
        "labview-lvm",
        "putty-banner",
        "unit-ns",
        "units-row",
        "utf16",
    ];
    let Some(folder) = cases("val_cases_of_one_table_give_its_values") else {
        return;
    };
    let read = |name: &str| {
        read_case(&folder.join(name))
            .unwrap_or_else(|line| panic!("{line}"))
            .1
    };
    let expected = read("quoted-comma-header");
    for name in SAME {
        let recording = read(name).part(0..1500);
        for (signal, values) in &recording.signals {
            assert_eq!(
                expected.signal(signal),
                Some(&values[..]),
                "{name} {signal}"
            );
        }
        let differences = recording.time_s.iter().zip(&expected.time_s);
        let largest_s = differences.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(largest_s < 1e-12, "{name}: {largest_s} s");
    }
}

#[test]
fn val_the_gap_is_said() {
    let Some(folder) = cases("val_the_gap_is_said") else {
        return;
    };
    let (rig, recording) = read_case(&folder.join("gap-150ms")).expect("a recording");
    let timing = inspect(&rig, &recording).timing;
    assert_eq!(timing.gap_count, 1);
    assert_eq!(timing.gaps[0].after_line, 2001);
    assert!((timing.gaps[0].length_s - 0.151).abs() < 1e-9);
}

/// A case that is refused: where, what is wrong, what to do.
const REFUSED: &[(&str, &str, &[&str])] = &[
    (
        "clock-15ms",
        "run.csv:3: column \"t_s\": the time repeats",
        &["5616 of 6000", "15.60 ms", "finer clock"],
    ),
    (
        "degC-as-K",
        "rig.toml:18: environment.temperature_K",
        &["kelvin", "degC"],
    ),
    (
        "encoder-counts",
        "rig.toml:9: signals.x.unit",
        &["unknown", "scale = m per count"],
    ),
    (
        "instrument-overrange",
        "run.csv:2502: column \"p_a_Pa\": \"9.91E+37\"",
        &["overrange"],
    ),
    ("kPa-under-Pa", "rig.toml:21: supply.pressure_Pa", &["kPa"]),
    (
        "labels-in-cells",
        "run.csv:2: column \"t_s\": \"t_s:0.0000\"",
        &["label", "the number alone"],
    ),
    (
        "milliampere",
        "rig.toml:6: signals.p_a.unit: unknown unit \"mA\"",
        &["scale = 0.625", "offset = -250000"],
    ),
    (
        "ms-integer-2kHz",
        "run.csv:3: column \"t_s\": the time repeats",
        &["3000 of 6000", "1.000 ms", "finer clock"],
    ),
    (
        "plotjuggler-sparse",
        "run.csv:3: column \"p_a_Pa\", \"p_b_Pa\", \"p_s_Pa\"",
        &["600 of 6000 rows", "100 Hz", "1000 Hz", "resampled"],
    ),
    (
        "stroke-mm-under-m",
        "rig.toml:33: cylinder.stroke_m",
        &["mm"],
    ),
    (
        "thousands-separator",
        "run.csv:2: column \"p_a_Pa\": \"444,568.0\"",
        &["thousands separator"],
    ),
    (
        "two-runs-concatenated",
        "run.csv:6002: the header stands here again",
        &["cut it before this line"],
    ),
];

#[test]
fn val_cases_that_are_refused_in_one_line() {
    let Some(folder) = cases("val_cases_that_are_refused_in_one_line") else {
        return;
    };
    for (name, start, parts) in REFUSED {
        let line = read_case(&folder.join(name)).expect_err(name);
        assert!(line.contains(&format!("{name}/{start}")), "{line}");
        for part in *parts {
            assert!(line.contains(part), "{name}: no \"{part}\" in {line}");
        }
        assert!(!line.contains('\n'), "{line}");
    }
}

// ---- the same table in every dialect

const NAMES: [&str; 3] = ["t", "x", "force"];

fn rig(time: &str) -> Rig {
    let text = format!(
        "format = \"rig/1\"\n[signals]\nt = {{ column = \"t\", {time} }}\n\
         x = {{ column = \"x\", unit = \"m\" }}\nforce = {{ column = \"force\", unit = \"N\" }}\n"
    );
    Rig::parse(&text, "rig.toml").expect("a rig")
}

fn seconds() -> Rig {
    rig("unit = \"s\"")
}

fn read_as(rig: &Rig, bytes: &[u8]) -> Result<Recording, RecordingError> {
    Recording::read_from(bytes, "run.csv", None, &rig.signals)
}

fn read(text: &str) -> Result<Recording, RecordingError> {
    read_as(&seconds(), text.as_bytes())
}

fn refused(text: &str) -> String {
    read(text).expect_err(text).to_string()
}

/// How a table is written.
#[derive(Clone, Copy, Debug)]
struct Dialect {
    separator: &'static str,
    quoted: bool,
    comma: bool,
    line_end: &'static str,
    preamble: &'static str,
    units: bool,
}

impl Dialect {
    fn cell(self, text: &str) -> String {
        let text = if self.comma {
            text.replace('.', ",")
        } else {
            text.into()
        };
        if self.quoted {
            format!("\"{text}\"")
        } else {
            text
        }
    }

    fn line(self, cells: impl IntoIterator<Item = String>) -> String {
        let cells: Vec<String> = cells.into_iter().collect();
        cells.join(self.separator) + self.line_end
    }

    fn table(self, rows: &[[String; 3]]) -> String {
        let mut text = self.preamble.replace('\n', self.line_end);
        text += &self.line(NAMES.map(str::to_owned));
        if self.units {
            text += &self.line(["s", "[m]", "N"].map(str::to_owned));
        }
        for row in rows {
            text += &self.line(row.iter().map(|cell| self.cell(cell)));
        }
        text
    }
}

fn dialect() -> impl Strategy<Value = Dialect> {
    let separator = prop::sample::select(vec![",", ";", "\t", " ", "   ", "|", ", ", " ; "]);
    let line_end = prop::sample::select(vec!["\n", "\r\n"]);
    let preamble = prop::sample::select(vec![
        "",
        "# a comment\n",
        "=~=~= log 2026.03.02 11:51:37 =~=~=\n",
        "Device: 7\nRate = 1000\n\n",
        "sep=;\n",
        "Writer\t2\nX0\t0\t0\n***End***\t\n\t\n",
    ]);
    let flags = (any::<bool>(), any::<bool>(), any::<bool>());
    (separator, line_end, preamble, flags).prop_map(
        |(separator, line_end, preamble, (quoted, comma, units))| Dialect {
            separator,
            // A decimal comma between commas must be quoted.
            quoted: quoted || comma && separator.contains(','),
            comma,
            line_end,
            preamble,
            units,
        },
    )
}

fn numbers() -> impl Strategy<Value = Vec<[f64; 2]>> {
    prop::collection::vec([-0.5..0.5_f64, -1e5..1e5_f64], 2..60)
}

fn written(values: &[[f64; 2]]) -> Vec<[String; 3]> {
    let row = |(place, [x, force]): (usize, &[f64; 2])| {
        [
            format!("{:.3}", place as f64 * 0.001),
            format!("{x:?}"),
            format!("{force:?}"),
        ]
    };
    values.iter().enumerate().map(row).collect()
}

fn utf_16(text: &str, bytes: fn(u16) -> [u8; 2]) -> Vec<u8> {
    text.encode_utf16().flat_map(bytes).collect()
}

fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut packer = GzEncoder::new(Vec::new(), Compression::fast());
    packer.write_all(bytes).expect("memory");
    packer.finish().expect("memory")
}

/// Every encoding of a text.
fn encodings(text: &str) -> Vec<Vec<u8>> {
    let marked = format!("\u{feff}{text}");
    let mut encodings = vec![
        text.as_bytes().to_vec(),
        marked.as_bytes().to_vec(),
        utf_16(text, u16::to_le_bytes),
        utf_16(text, u16::to_be_bytes),
        utf_16(&marked, u16::to_le_bytes),
        utf_16(&marked, u16::to_be_bytes),
    ];
    encodings.extend(encodings.clone().iter().map(|bytes| packed(bytes)));
    encodings
}

proptest! {
    #[test]
    fn prop_a_table_in_every_dialect_is_the_same_recording(
        values in numbers(), dialect in dialect()
    ) {
        let text = dialect.table(&written(&values));
        for bytes in encodings(&text) {
            let recording = read_as(&seconds(), &bytes);
            let recording = recording.map_err(|error| TestCaseError::fail(format!("{error}\n{text}")))?;
            let column = |place: usize| values.iter().map(|row| row[place]).collect::<Vec<f64>>();
            prop_assert_eq!(recording.signal("x"), Some(&column(0)[..]));
            prop_assert_eq!(recording.signal("force"), Some(&column(1)[..]));
            let time: Vec<f64> = (0..values.len()).map(|row| format!("{:.3}", row as f64 * 0.001).parse().expect("a number")).collect();
            prop_assert_eq!(&recording.time_s, &time);
        }
    }

    #[test]
    fn prop_a_time_in_every_notation_is_the_same_to_the_bit(
        steps_ns in prop::collection::vec(1..2_000_000_000_i64, 2..50),
        start in 1_000_000_000_000_000_000..2_000_000_000_000_000_000_i64,
    ) {
        let mut now = start;
        let stamps: Vec<i64> = std::iter::once(start)
            .chain(steps_ns.iter().map(|step| { now += step; now }))
            .collect();
        let expected: Vec<f64> = stamps.iter().map(|stamp| (stamp - start) as f64 / 1e9).collect();
        let instant = |stamp: &i64| jiff::Timestamp::from_nanosecond((*stamp).into()).expect("in range");
        let notations: [&dyn Fn(&i64) -> String; 5] = [
            &|stamp| format!("{}.{:09}", stamp / 1_000_000_000, stamp % 1_000_000_000),
            &|stamp| instant(stamp).strftime("%Y-%m-%dT%H:%M:%S.%9fZ").to_string(),
            &|stamp| instant(stamp).strftime("%Y-%m-%d %H:%M:%S.%9f").to_string(),
            &|stamp| instant(stamp).strftime("%Y/%m/%d %H:%M:%S,%9f").to_string(),
            &|stamp| instant(stamp).strftime("%H:%M:%S.%9f").to_string(),
        ];
        for notation in notations {
            let rows = stamps.iter().enumerate().map(|(row, stamp)| format!("{};{row};1\n", notation(stamp)));
            let text = format!("t;x;force\n{}", rows.collect::<String>());
            let recording = read(&text).map_err(|error| TestCaseError::fail(format!("{error}\n{text}")))?;
            prop_assert_eq!(&recording.time_s, &expected, "{}", text);
            prop_assert!(recording.remarks.iter().any(|said| said.starts_with("time counts from")));
        }
        // As whole nanoseconds the unit of the rig rounds once more.
        let rows = stamps.iter().map(|stamp| format!("{stamp},0,1\n"));
        let text = format!("t,x,force\n{}", rows.collect::<String>());
        let recording = read_as(&rig("unit = \"ns\""), text.as_bytes()).expect("a recording");
        for (found, expected) in recording.time_s.iter().zip(&expected) {
            prop_assert!((found - expected).abs() <= 2.0 * f64::EPSILON * expected, "{found} {expected}");
        }
    }

    #[test]
    fn prop_a_counter_that_wraps_is_unwrapped(
        bits in prop::sample::select(vec![16_u32, 24, 32]), before in 2..80_u64, step in 1..50_u64
    ) {
        let period = 1_u64 << bits;
        let start = period - before * step + step / 2;
        let rows = (0..200_u64).map(|row| format!("{},0,{row}\n", (start + row * step) % period));
        let text = format!("t,x,force\n{}", rows.collect::<String>());
        let recording = read_as(&rig("unit = \"ms\""), text.as_bytes()).expect("a recording");
        let first_s = recording.time_s[0];
        for (row, time_s) in recording.time_s.iter().enumerate() {
            let expected = (row as u64 * step) as f64 * 1e-3;
            prop_assert!((time_s - first_s - expected).abs() < 1e-8, "row {row}: {time_s}");
        }
        let said = format!("a {bits}-bit counter");
        prop_assert!(recording.remarks.iter().any(|remark| remark.contains(&said)), "{:?}", recording.remarks);
    }

    /// A thousands separator never passes for a decimal mark, whatever else the file holds.
    #[test]
    fn prop_no_thousands_separator_is_read(
        whole in 1_000..99_999_999_u64, decimals in prop::option::of("[0-9]{1,3}"),
        other in prop::option::of("[0-9]{1,2}"), point in any::<bool>(),
    ) {
        let (mark, group) = if point { ('.', ',') } else { (',', '.') };
        let digits = whole.to_string();
        let mut grouped = String::new();
        for (place, digit) in digits.chars().enumerate() {
            if place > 0 && (digits.len() - place) % 3 == 0 {
                grouped.push(group);
            }
            grouped.push(digit);
        }
        let decimals = decimals.map_or(String::new(), |decimals| format!("{mark}{decimals}"));
        let x = other.map_or("0".into(), |other| format!("0{mark}{other}"));
        let text = format!("t;x;force\n0;{x};{grouped}{decimals}\n1;{x};{grouped}{decimals}\n");
        if let Ok(recording) = read(&text) {
            // One point and three digits alone are decimals: there is no sign of anything else.
            let alone = !point && whole < 1_000_000 && decimals.is_empty() && !x.contains(mark);
            prop_assert!(alone, "{:?} of {}", recording.signal("force"), text);
        }
    }

    /// Rows that lack a value are left out, the others are kept as they are.
    #[test]
    fn prop_rows_without_a_value_are_left_out_and_counted(
        holes in prop::collection::btree_set(0..300_usize, 1..20),
        word in prop::sample::select(vec!["", "NaN", "nan", "N/A", "-", "null", "-nan(ind)"]),
    ) {
        let row = |row: usize| {
            let x = if holes.contains(&row) { word.into() } else { format!("0.{row:03}") };
            format!("{row},{x},1\n")
        };
        let text = format!("t,x,force\n{}", (0..300).map(row).collect::<String>());
        let recording = read(&text).expect("a recording");
        let kept: Vec<u32> = (0..300_u32).filter(|row| !holes.contains(&(*row as usize))).map(|row| row + 2).collect();
        prop_assert_eq!(&recording.line, &kept);
        let first = holes.first().expect("a hole") + 2;
        let said = format!("left out, first at line {first}: column \"x\" in {}", holes.len());
        prop_assert!(recording.remarks.iter().any(|remark| remark.contains(&said)), "{:?}", recording.remarks);
    }
}

// ---- single rules

const ROWS: &str = "0.001,0.1,1\n0.002,0.2,2\n0.004,0.3,3\n";

fn check_rows(text: &str) -> Recording {
    let recording = read(text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert_eq!(recording.time_s, [0.001, 0.002, 0.004], "{text}");
    assert_eq!(recording.signal("x"), Some(&[0.1, 0.2, 0.3][..]), "{text}");
    recording
}

#[test]
fn val_a_header_over_several_lines_is_one_header() {
    let rig = Rig::parse(
        "format = \"rig/1\"\n[signals]\nt = { column = \"t\", unit = \"s\" }\nx = { column = \"x (m)\", unit = \"m\" }\n",
        "rig.toml",
    );
    let text = format!("t,\"x\n(m)\",\"force\n(N)\"\n{ROWS}");
    let recording = read_as(&rig.expect("a rig"), text.as_bytes()).expect("a recording");
    assert_eq!(recording.line, [4, 5, 6]);
    assert_eq!(recording.unused_columns, ["force (N)"]);
}

#[test]
fn val_latin_1_headers_are_read() {
    let text = "format = \"rig/1\"\n[signals]\nt = { column = \"t [µs]\", unit = \"us\" }\n\
                temperature_a = { column = \"T [°C]\", unit = \"degC\" }\n";
    let rig = Rig::parse(text, "rig.toml").expect("a rig");
    let recording = read_as(&rig, b"t [\xb5s];T [\xb0C]\n0;20,5\n10;21,5\n").expect("a recording");
    assert_eq!(
        recording.signal("temperature_a"),
        Some(&[293.65, 294.65][..])
    );
}

#[test]
fn val_text_under_the_header() {
    let recording = check_rows(&format!("t,x,force\ns,m,N\nclock,laser,cell\n{ROWS}"));
    assert_eq!(
        recording.remarks,
        [
            "line 2: units, which agree with the rig",
            "line 3: text under the header, not read"
        ]
    );
    assert_eq!(
        refused(&format!("t,x,force\ns,mm,N\n{ROWS}")),
        "run.csv:2: column \"x\": the file says \"mm\", the rig \"m\", expected the same unit in both"
    );
}

#[test]
fn val_a_unit_in_a_name_that_is_not_the_rig_s_is_said() {
    let text = "format = \"rig/1\"\n[signals]\nt = { column = \"t (ms)\", unit = \"s\" }\n\
                x = { column = \"x [m]\", unit = \"m\" }\n\
                p_a = { column = \"p (in)\", unit = \"bar(g)\" }\n";
    let rig = Rig::parse(text, "rig.toml").expect("a rig");
    let recording = read_as(&rig, b"t (ms),x [m],p (in)\n0,0,1\n1,0,2\n").expect("a recording");
    assert_eq!(
        recording.remarks,
        ["column \"t (ms)\": its name says ms, the rig s"]
    );
}

#[test]
fn val_rows_are_no_preamble() {
    let line = refused(&format!("{ROWS}t,x,force\n{ROWS}"));
    assert!(
        line.starts_with("run.csv:4: the header stands below rows (line 1)"),
        "{line}"
    );
    let line = refused("t,x,force\n1,2\n2,3\n3,4,5\n");
    assert!(
        line.starts_with("run.csv:2: the row has 2 fields, expected 3"),
        "{line}"
    );
}

#[test]
fn val_counts_need_a_scale() {
    let parse = |keys: &str| {
        let text = format!(
            "format = \"rig/1\"\n[signals]\nt = {{ column = 0, unit = \"s\" }}\nx = {{ column = 1, {keys} }}\n"
        );
        Rig::parse(&text, "rig.toml")
    };
    let rig = parse("unit = \"count\", scale = 5e-6, offset = -0.1").expect("a rig");
    let recording = read_as(&rig, b"0,20000\n1,20001\n").expect("a recording");
    let x = recording.signal("x").expect("a position");
    assert!(x[0].abs() < 1e-12 && (x[1] - 5e-6).abs() < 1e-12, "{x:?}");
    for unit in ["count", "counts", "raw", "LSB", "mA"] {
        let line = parse(&format!("unit = \"{unit}\""))
            .expect_err(unit)
            .to_string();
        assert!(line.starts_with("rig.toml:4: signals.x.unit"), "{line}");
        assert!(line.contains("scale"), "{line}");
    }
}

/// Files, and how the line begins that each must cause.
const ODD: &[(&str, &str)] = &[
    (
        "t,x,force\n0,1 mm,2\n",
        "run.csv:2: column \"x\": \"1 mm\" has text after its number",
    ),
    (
        "t,x,force\n0,1,2\n1,Inf,2\n",
        "run.csv:3: column \"x\": \"Inf\" is no finite number",
    ),
    (
        "t,x,force\n0,1,-9.9E37\n",
        "run.csv:2: column \"force\": \"-9.9E37\" is the overrange code",
    ),
    (
        "t,x,force\n0,1,\"2\n1,1,3\n",
        "run.csv:2: a quote is opened and not closed",
    ),
    (
        "t,x,force\n0,1,2\n1,2,3\n0,1,2\n",
        "run.csv:4: column \"t\": time 0 s runs backward from line 3 (1 s), expected strictly increasing time; another run begins here?",
    ),
    (
        "t,x,force\n0,1,2\n1,1,2\nThe end\n",
        "run.csv:4: the row has 1 fields, expected 3 as in the header; is it a message? delete the line",
    ),
    (
        "t,x,force\n1772442751250,1,2\n",
        "run.csv:2: column \"t\": 1772442751250 s is no time of a recording, expected unit = \"ms\"",
    ),
    (
        "t,x,force\n3/2/2026 9:12:31,1,2\n",
        "run.csv:2: column \"t\": \"3/2/2026 9:12:31\" is no time that can be read, expected a number, a clock time",
    ),
    (
        "t,x,force\n9:12:31,1,2\n9:12:31,2,2\n",
        "run.csv:3: column \"t\": the time repeats that of line 2, as in 1 of 2 rows",
    ),
    (
        "t,x,force\n65530,1,2\n65531,1,2\n9,1,2\n",
        "run.csv:4: column \"t\": the time wraps from 65531 to 9 (a 16-bit counter)",
    ),
    (
        "t,x,force\n0,,2\n1,,2\n",
        "run.csv:2: column \"x\": no value in any row",
    ),
    (
        "t,x,force\n0,1,\n1,,2\n2,1,\n3,,2\n",
        "run.csv:2: column \"force\", \"x\": values in 2 of 4 rows",
    ),
    (
        "t;x;force\n0;1,5;658 556,0\n",
        "run.csv:2: column \"force\": \"658 556,0\" has a thousands separator",
    ),
    (
        "t,x,force\n0,1,2\n2,2,3\n1,1,2\n",
        "run.csv:4: column \"t\": time 1 s runs backward from line 3 (2 s), expected strictly increasing time; sort the rows by time",
    ),
    (
        "PK\u{3}\u{4}",
        "run.csv: cannot be read as a workbook: Cannot detect file format, expected a whole file of that format; copy it again, or export it plainly packed or as CSV",
    ),
    (
        "BZh91AY",
        "run.csv: is packed with bzip2, expected a text table: rows of numbers; export it as CSV",
    ),
];

#[test]
fn val_each_odd_file_gets_its_line() {
    for (text, start) in ODD {
        let line = refused(text);
        assert!(line.starts_with(start), "{line}");
    }
}

#[test]
fn val_a_packed_file_that_was_cut_is_refused() {
    let rows: String = (0..2000).map(|row| format!("{row},0.{row},1\n")).collect();
    let mut bytes = packed(format!("t,x,force\n{rows}").as_bytes());
    bytes.truncate(bytes.len() / 2);
    let line = read_as(&seconds(), &bytes)
        .expect_err("it was cut")
        .to_string();
    assert!(line.contains("the packed file ends too early"), "{line}");
}

#[test]
fn val_clocks_pass_midnight_and_wraps_are_counted() {
    let recording =
        read("t,x,force\n23:59:59.5,1,1\n00:00:00.5,1,2\n00:00:01.5,1,3\n").expect("a recording");
    assert_eq!(recording.time_s, [0.0, 1.0, 2.0]);
    assert!(
        recording.remarks[1].contains("midnight) at line 3"),
        "{:?}",
        recording.remarks
    );
    let rows = (0..40_000_u32).map(|row| format!("{},0,{row}\n", row * 10 % 65_536));
    let text = format!("t,x,force\n{}", rows.collect::<String>());
    let recording = read_as(&rig("unit = \"ms\""), text.as_bytes()).expect("a recording");
    assert!(
        recording.remarks[0].contains("the first of 6 times"),
        "{:?}",
        recording.remarks
    );
}

// ---- sources that are read once

/// A named pipe into which the text is written.
#[cfg(unix)]
#[test]
fn val_a_pipe_is_read_once() {
    let pipe = std::env::temp_dir().join(format!("pneuma-pipe-{}", std::process::id()));
    let made = Command::new("mkfifo").arg(&pipe).status().expect("mkfifo");
    assert!(made.success());
    let (target, text) = (pipe.clone(), format!("t,x,force\n{ROWS}"));
    let writer = std::thread::spawn(move || fs::write(target, text));
    let recording = Recording::read(&pipe, &seconds().signals);
    writer.join().expect("a writer").expect("it was read");
    let _ = fs::remove_file(&pipe);
    assert_eq!(recording.expect("a recording").len(), 3);
}

#[test]
fn val_standard_input_is_read() {
    let folder = std::env::temp_dir().join(format!("pneuma-stdin-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder");
    let rig = folder.join("rig.toml");
    let text = "format = \"rig/1\"\n[signals]\nt = { column = \"t\", unit = \"s\" }\nx = { column = \"x\", unit = \"m\" }\n";
    fs::write(&rig, text).expect("a rig");
    let mut program = Command::new(env!("CARGO_BIN_EXE_pneuma"))
        .arg("inspect")
        .arg("--rig")
        .arg(&rig)
        .arg("-")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program");
    let mut input = program.stdin.take().expect("its input");
    let rows: String = (0..100)
        .map(|row| format!("{}\t0,{row:03}\n", row))
        .collect();
    input
        .write_all(&packed(format!("t\tx\n{rows}").as_bytes()))
        .expect("it reads");
    drop(input);
    let output = program.wait_with_output().expect("it ends");
    let _ = fs::remove_dir_all(&folder);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("100 rows, 0.000 to 99.000 s"), "{said}");
    assert!(said.contains("the decimal mark is a comma"), "{said}");
}
