//! Recordings: the layouts that are read, and the line that each bad file gets.

use std::io::{BufRead, BufReader, Read};

use host_sim::recording::{Recording, RecordingError};
use host_sim::rig::{Rig, Signals};
use proptest::prelude::*;

fn signals(time: &str, pressure: &str) -> Signals {
    let text = format!(
        "format = \"rig/1\"\n[signals]\nt = {{ column = {time}, unit = \"ms\" }}\n\
         p_a = {{ column = {pressure}, unit = \"kPa(g)\" }}\n[environment]\n\
         pressure_Pa = 100000.0\ntemperature_K = 293.0\n"
    );
    Rig::parse(&text, "rig.toml").expect("a rig").signals
}

fn named() -> Signals {
    signals("\"t\"", "\"p, left\"")
}

fn numbered() -> Signals {
    signals("0", "1")
}

fn read(bytes: &[u8], signals: &Signals) -> Result<Recording, RecordingError> {
    let size = u64::try_from(bytes.len()).ok();
    Recording::read_from(bytes, "run.csv", size, signals)
}

fn check_layout(text: &str, signals: &Signals, lines: &[u32]) {
    let recording = read(text.as_bytes(), signals).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(recording.time_s, [0.001, 0.002, 0.004], "{text:?}");
    let pressure = recording.signal("p_a").expect("a pressure");
    assert_eq!(pressure, [600_000.0, 610_000.0, 620_000.0], "{text:?}");
    assert_eq!(recording.line, lines, "{text:?}");
}

#[test]
fn val_layouts_with_a_header() {
    let files = [
        "t,\"p, left\"\n1,500\n2,510\n4,520\n",
        "\u{feff}t,\"p, left\"\r\n1,500\r\n2,510\r\n4,520",
        "\"t\";\"p, left\"\n1;500\n2;510\n4;520\n",
        "t\tp, left\n1\t500\n2\t510\n4\t520\n",
        "t, \"p, left\",\n1, 500,\n2, 510,\n4, 520,\n",
        "#t;p, left\n1 500\n 2   510\n\t4 520\n",
    ];
    for text in files {
        check_layout(text, &named(), &[2, 3, 4]);
    }
}

#[test]
fn val_layouts_without_a_header() {
    let files = [
        "1,500\n2,510\n4,520\n",
        "1.0\t5e2\t7\n2.0\t5.1e2\t7\n4.0\t5.2e2\t7\n",
        "  1 500\n  2  510\n  4 520  \n",
    ];
    for text in files {
        check_layout(text, &numbered(), &[1, 2, 3]);
    }
    let commented = "# a rig\n% another\n1 500\n\n2 510\n# a remark\n4 520\n";
    check_layout(commented, &numbered(), &[3, 5, 7]);
}

/// Milliseconds of the day and of the GPS week; two runs of a minute are none of them.
#[test]
fn val_clocks_that_begin_anew_are_unwrapped_and_a_second_run_is_not() {
    for (period_ms, name) in [(86_400_000, "midnight"), (604_800_000, "the week's end")] {
        let rows = (0..200).map(|row| format!("{},500\n", (period_ms - 100 + row) % period_ms));
        let text: String = rows.collect();
        let recording = read(text.as_bytes(), &numbered()).expect("a recording");
        let steps = recording.time_s.windows(2).map(|pair| pair[1] - pair[0]);
        assert!(steps.into_iter().all(|step| (step - 1e-3).abs() < 1e-6));
        assert!(
            recording.remarks[0].contains(name),
            "{:?}",
            recording.remarks
        );
    }
    let rows = (0..200).map(|row| format!("{},500\n", (59_900 + row) % 60_000));
    let text: String = rows.collect();
    let refused = read(text.as_bytes(), &numbered()).expect_err("two runs");
    assert!(
        refused
            .to_string()
            .contains("cut the file before this line"),
        "{refused}"
    );
}

#[test]
fn val_rows_in_the_wrong_order_get_the_remedy_that_helps() {
    let newest_first: String = (0..50).map(|row| format!("{},500\n", 100 - row)).collect();
    let refused = read(newest_first.as_bytes(), &numbered()).expect_err("falling times");
    assert!(
        refused.to_string().contains("reverse the rows"),
        "{refused}"
    );
    let set_back = (0..400).map(|row| format!("{},500\n", if row < 200 { row } else { row - 50 }));
    let refused = read(set_back.collect::<String>().as_bytes(), &numbered()).expect_err("set back");
    assert!(
        refused.to_string().contains("the clock was set back"),
        "{refused}"
    );
    let other_separator = "1,500\n2,510\n3;520\n4;530\n";
    let refused = read(other_separator.as_bytes(), &numbered()).expect_err("two separators");
    assert!(
        refused.to_string().contains("another separator"),
        "{refused}"
    );
}

#[test]
fn val_unused_columns_and_an_open_last_row_are_reported() {
    let recording = read(b"t,a,\"p, left\"\n1,x,2\n2,y,3", &named()).expect("a recording");
    assert_eq!(recording.unused_columns, ["a"]);
    assert!(recording.last_row_unterminated);
}

/// A file, whether its columns are named, and the line that it must cause.
const BAD: &[(&[u8], bool, &str)] = &[
    (
        b"",
        true,
        "run.csv: is empty, expected a text table: rows of numbers",
    ),
    (
        b"\n  \n# nothing\n",
        true,
        "run.csv: holds no rows, expected a text table: rows of numbers",
    ),
    (
        b"t,\"p, left\"\n",
        true,
        "run.csv:1: holds a header but no rows, expected a text table: rows of numbers",
    ),
    (
        b"t,p\n1,2\n",
        true,
        "run.csv:1: no column \"p, left\" for the signal p_a, expected one of the file's columns: t, p",
    ),
    (
        b"t,p. left\n1,2\n",
        true,
        "run.csv:1: no column \"p, left\" for the signal p_a, expected one of the file's columns: t, p. left (did you mean \"p. left\"?)",
    ),
    (
        b"t,t,\"p, left\"\n1,1,2\n",
        true,
        "run.csv:1: two columns are named \"t\", expected one; give the column by its number in the rig",
    ),
    (
        b"1,2\n2,3\n",
        true,
        "run.csv: no header line to find \"p, left\" for the signal p_a in, expected a column number from 0 to 1 in the rig",
    ),
    (
        b"1\n2\n",
        false,
        "run.csv: no column 1 for the signal p_a, expected a number from 0 to 0",
    ),
    (
        b"t,\"p, left\"\n1,2\n2,two\n",
        true,
        "run.csv:3: column \"p, left\": \"two\" is no finite number, expected a number",
    ),
    (
        b"t,\"p, left\"\n1,2\n2,inf\n",
        true,
        "run.csv:3: column \"p, left\": \"inf\" is no finite number, expected a number",
    ),
    (
        b"t,\"p, left\"\n1,2\n2\n3,4\n",
        true,
        "run.csv:3: the row has 1 fields, expected 2 as in the header; is it a message? delete the line or mark it as a comment (#)",
    ),
    (
        b"t,\"p, left\"\n1,2\n2",
        true,
        "run.csv:3: truncated: the file ends inside this row, field 1, expected 2 fields; delete the row or copy the file again",
    ),
    (
        b"t,\"p, left\"\n1,2\n2,1e",
        true,
        "run.csv:3: column \"p, left\": truncated: the file ends inside \"1e\", expected a complete row; delete it or copy the file again",
    ),
    (
        b"t,\"p, left\"\n0,001,1,5\n0,002,1,6\n",
        true,
        "run.csv:2: the row has 4 fields, expected 2 as in the header (decimal commas? export with semicolons or tabs between the columns)",
    ),
    (
        b"1,2\n1,3\n",
        false,
        "run.csv:2: column 0: the time repeats that of line 1, as in 1 of 2 rows, expected a time of its own for each row: log a finer clock, or number the rows by the sampling rate",
    ),
    (
        b"1,2\n\n3,3\n2,3\n",
        false,
        "run.csv:4: column 0: time 0.002 s runs backward from line 3 (0.003 s), expected strictly increasing time; sort the rows by time",
    ),
    (
        b"1,2\n2,-200\n",
        false,
        "run.csv:2: column 1: -200 kPa(g) cannot be, expected Pa absolute from 0 to 1e8 (is the unit right, absolute or gauge?)",
    ),
    (
        b"1,2\n2,600000\n",
        false,
        "run.csv:2: column 1: 600000 kPa(g) cannot be, expected Pa absolute from 0 to 1e8 (is the unit right, absolute or gauge?)",
    ),
    (
        b"\x7fELF\x02\x01\n",
        false,
        "run.csv:1: is a binary file, expected a text table: rows of numbers",
    ),
    (
        b"1,2\r2,3\r3,4\r",
        false,
        "run.csv:1: a carriage return inside the line, expected lines that end with LF or CRLF",
    ),
];

#[test]
fn val_each_bad_file_gets_its_line() {
    for (bytes, by_name, expected) in BAD {
        let signals = if *by_name { named() } else { numbered() };
        let shown = String::from_utf8_lossy(bytes);
        let error = read(bytes, &signals).expect_err(&shown);
        assert_eq!(&error.to_string(), expected);
    }
}

#[test]
fn val_a_damaged_row_deep_in_the_file_is_named() {
    let mut text: Vec<u8> = (0..1000)
        .flat_map(|row| format!("{row},1\n").into_bytes())
        .collect();
    text.extend(b"\0\0\0\0\0\0\0\n1001,1\n");
    let error = read(&text, &numbered()).expect_err("damage").to_string();
    assert!(error.starts_with("run.csv:1001: NUL bytes"), "{error}");
}

#[test]
fn val_a_line_without_end_is_refused_unread() {
    let endless = BufReader::new(std::io::repeat(b'1'));
    let error = Recording::read_from(endless, "run.csv", None, &numbered());
    let line = error.expect_err("no table").to_string();
    assert!(
        line.starts_with("run.csv:1: the line is longer than 1 MiB"),
        "{line}"
    );
}

#[test]
fn val_a_file_far_over_the_row_limit_is_refused_by_its_size() {
    let head: &[u8] = b"1,2\n2,3\n";
    let error = Recording::read_from(head, "run.csv", Some(1 << 31), &numbered());
    assert_eq!(
        error.expect_err("too large").to_string(),
        "run.csv: holds about 536870912 rows, expected at most 20000000 rows; cut the recording into parts"
    );
}

/// A source that fails after some bytes, as a worn disk does.
struct Failing<R>(R);

impl<R: Read> Read for Failing<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        match self.0.read(buffer)? {
            0 => Err(std::io::Error::other("worn out")),
            read => Ok(read),
        }
    }
}

#[test]
fn val_a_failing_disk_is_one_line() {
    let source = BufReader::new(Failing(&b"1,2\n2,3\n"[..]));
    let error = Recording::read_from(source, "run.csv", None, &numbered());
    let line = error.expect_err("worn out").to_string();
    assert_eq!(
        line,
        "run.csv:2: cannot be read: worn out, expected a text table: rows of numbers"
    );
}

/// Every file is either a recording that keeps its promises or an error on one
/// line that names the file.
fn check_total(source: impl BufRead, signals: &Signals) -> Result<(), TestCaseError> {
    match Recording::read_from(source, "the run.csv", None, signals) {
        Ok(recording) => {
            prop_assert!(!recording.is_empty());
            let increasing = recording.time_s.windows(2).all(|pair| pair[0] < pair[1]);
            prop_assert!(increasing);
            for values in recording.signals.values() {
                prop_assert_eq!(values.len(), recording.len());
                prop_assert!(values.iter().all(|value| value.is_finite()));
            }
        }
        Err(error) => {
            let line = error.to_string();
            prop_assert!(line.starts_with("the run.csv"), "{}", line);
            prop_assert!(!line.chars().any(char::is_control), "{:?}", line);
        }
    }
    Ok(())
}

const VALID: &str = "t,\"p, left\",x\n1,500.0,a\n2,510,b\n# remark\n4,5.2e2,c\n5,530,d\n";

proptest! {
    #[test]
    fn prop_any_bytes_are_a_recording_or_one_line(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        check_total(&bytes[..], &numbered())?;
        check_total(&bytes[..], &named())?;
    }

    #[test]
    fn prop_any_table_like_text_is_a_recording_or_one_line(text in "[0-9.,;\t \"#%eE\r\n+-]{0,200}") {
        check_total(text.as_bytes(), &numbered())?;
    }

    #[test]
    fn prop_a_mutated_file_is_a_recording_or_one_line(
        places in prop::collection::vec((0..VALID.len(), any::<u8>(), 0..4_usize), 1..4)
    ) {
        let mut bytes = VALID.as_bytes().to_vec();
        for (place, byte, removed) in places {
            let start = place.min(bytes.len());
            let end = (start + removed).min(bytes.len());
            bytes.splice(start..end, [byte]);
        }
        check_total(&bytes[..], &named())?;
    }

    #[test]
    fn prop_written_values_are_read_back_exactly(
        values in prop::collection::vec(-100.0..1e5_f64, 1..50), separator in "[,;\t ]"
    ) {
        let mut text = String::new();
        for (row, value) in values.iter().enumerate() {
            text.push_str(&format!("{row}{separator}{value:?}\n"));
        }
        let rig = "format = \"rig/1\"\n[signals]\nt = { column = 0, unit = \"s\" }\nforce = { column = 1, unit = \"N\" }\n";
        let signals = Rig::parse(rig, "rig.toml").expect("a rig").signals;
        let recording = read(text.as_bytes(), &signals).expect("a recording");
        prop_assert_eq!(recording.signal("force"), Some(&values[..]));
    }
}
