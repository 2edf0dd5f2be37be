//! Files of other programs, as a user meets them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const RIG: &str = r#"format = "rig/1"
[signals]
t = { column = "t_s", unit = "s" }
u = { column = "u_V", unit = "V" }
p_a = { column = "p_a_Pa", unit = "Pa(abs)" }
p_b = { column = "p_b_Pa", unit = "Pa(abs)" }
x = { column = "x_m", unit = "m" }
"#;

fn pneuma(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pneuma"))
        .args(arguments)
        .output()
        .expect("the program runs")
}

fn fixture(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    folder.join("../data-files/fixtures").join(name)
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a path in UTF-8")
}

#[test]
fn prop_without_a_rig_the_columns_of_a_file_are_listed() {
    for (name, table, rows) in [
        ("run.csv", "", "400 rows"),
        ("run-units.xlsx", "table \"data\"", "400 rows"),
        ("run.h5", "table \"rig/run 1\"", "400 rows"),
        ("run-two-rates.mf4", "table \"encoder\"", "80 rows"),
        ("run-zstd.mcap", "table \"/axis\"", "400 rows"),
    ] {
        let output = pneuma(&["inspect", text(&fixture(name))]);
        let shown = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{name}: {output:?}");
        assert!(shown.contains(table) && shown.contains(rows), "{shown}");
        assert!(
            shown.contains("x_m") && shown.contains("0.0201932"),
            "{shown}"
        );
    }
    let output = pneuma(&["inspect", text(&fixture("run.mf4"))]);
    let shown = String::from_utf8_lossy(&output.stdout).into_owned();
    let line = shown.lines().find(|line| line.contains("p_a_Pa"));
    assert!(line.is_some_and(|line| line.contains(" Pa ")), "{shown}");
}

#[test]
fn val_a_recording_goes_through_every_written_format_bit_for_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let rig = folder.path().join("rig.toml");
    fs::write(&rig, RIG).expect("room");
    let mut source = fixture("run.xlsx");
    for (name, magic) in [
        ("run.parquet", &b"PAR1"[..]),
        ("run.mat", b"MATLAB 5.0"),
        ("run.mcap", b"\x89MCAP0"),
        ("run.csv", b"t_s,p_a_Pa,"),
    ] {
        let out = folder.path().join(name);
        let convert = [
            "convert",
            "--rig",
            text(&rig),
            "--out",
            text(&out),
            text(&source),
        ];
        let output = pneuma(&convert);
        assert!(output.status.success(), "{output:?}");
        assert!(
            fs::read(&out).expect("written").starts_with(magic),
            "{name}"
        );
        source = out;
    }
    let cells = |text: String, rows: usize| -> Vec<Vec<f64>> {
        let rows = text.lines().skip(rows);
        rows.map(|row| {
            row.split(',')
                .map(|cell| cell.parse().expect("a number"))
                .collect()
        })
        .collect()
    };
    let first = cells(
        fs::read_to_string(fixture("run.csv")).expect("a fixture"),
        1,
    );
    let last = cells(fs::read_to_string(&source).expect("written"), 2);
    // t_s, u_V, p_a_Pa, p_b_Pa, x_m, v_m_s; and t_s, p_a_Pa, p_b_Pa, u_V, x_m.
    for (before, after) in first.iter().zip(&last) {
        let expected = [before[0], before[2], before[3], before[1], before[4]];
        assert_eq!(
            expected.map(f64::to_bits).to_vec(),
            after.iter().map(|one| one.to_bits()).collect::<Vec<_>>()
        );
    }
    assert_eq!(first.len(), last.len());
    let wrong = folder.path().join("run.doc");
    let output = pneuma(&[
        "convert",
        "--rig",
        text(&rig),
        "--out",
        text(&wrong),
        text(&source),
    ]);
    assert_eq!(output.status.code(), Some(2));
}

/// Lengths beyond all memory, where a library believes them: one line, and the program goes on.
#[test]
fn prop_a_file_that_claims_more_than_memory_holds_is_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, place) in [("run-lz4.mcap", 17), ("run-lz4.feather", 1040)] {
        let mut bytes = fs::read(fixture(name)).expect("a fixture");
        bytes[place..place + 4].copy_from_slice(&[0xf0, 0xff, 0xff, 0x7f]);
        let path = folder.path().join(name);
        fs::write(&path, bytes).expect("room");
        let output = pneuma(&["inspect", text(&path)]);
        let line = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{line}");
        assert!(line.starts_with("error: "), "{line}");
        assert!(
            line.contains("more than memory") && line.lines().count() == 1,
            "{line}"
        );
    }
}

/// A file that is cut or damaged gives one line, or a recording: the very one where it is cut
/// behind what is read. Never a crash, never more than a line.
#[test]
fn prop_cut_and_damaged_files_are_read_or_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let rig = folder.path().join("rig.toml");
    fs::write(&rig, RIG).expect("room");
    let out = folder.path().join("out.csv");
    let converted = |path: &Path| {
        let output = pneuma(&[
            "convert",
            "--rig",
            text(&rig),
            "--out",
            text(&out),
            text(path),
        ]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        match output.status.code() {
            Some(0) => Some(fs::read(&out).expect("written")),
            code => {
                assert_eq!(code, Some(2), "{said}");
                assert!(
                    said.starts_with("error: ") && said.lines().count() == 1,
                    "{said}"
                );
                None
            }
        }
    };
    let mut refused = 0;
    for name in [
        "run-zstd.parquet",
        "run-lz4.feather",
        "run-v5.mat",
        "run-v7-struct.mat",
        "run-v73.mat",
        "run.h5",
        "run-transposed.mf4",
        "run.tdms",
        "run-zstd.mcap",
        "run-protobuf.mcap",
        "run-ros2.mcap",
        "run.xlsx",
    ] {
        let whole = fs::read(fixture(name)).expect("a fixture");
        let path = folder.path().join(name);
        fs::write(&path, &whole).expect("room");
        let expected = converted(&path);
        let named_time = name == "run-transposed.mf4" || name.ends_with(".mcap");
        assert!(expected.is_some() || named_time, "{name}");
        for share in (1..16).step_by(2) {
            fs::write(&path, &whole[..whole.len() * share / 16]).expect("room");
            let read = converted(&path);
            assert!(
                read.is_none() || read == expected,
                "{name} cut at {share}/16"
            );
            refused += u32::from(read.is_none());
        }
        for place in (0..whole.len().min(4096)).step_by(97) {
            let mut damaged = whole.clone();
            damaged[place] ^= 0xa5;
            fs::write(&path, &damaged).expect("room");
            refused += u32::from(converted(&path).is_none());
        }
    }
    assert!(refused > 150, "{refused}");
}

/// The same axis by three encodings of messages: JSON, protobuf and CDR, by the libraries of
/// Foxglove.
#[test]
fn val_messages_of_every_encoding_hold_the_same_numbers() {
    let folder = tempfile::tempdir().expect("a folder");
    let table = |name: &str, (u, a, b): (&str, &str, &str)| {
        let rig = folder.path().join("rig.toml");
        let named = RIG
            .replace("\"u_V\"", &format!("\"{u}\""))
            .replace("\"p_a_Pa\"", &format!("\"{a}\""))
            .replace("\"p_b_Pa\"", &format!("\"{b}\""));
        fs::write(&rig, named).expect("room");
        let out = folder.path().join("run.csv");
        let (rig, out_text, source) = (text_of(&rig), text_of(&out), fixture(name));
        let convert = ["convert", "--rig", &rig, "--out", &out_text, text(&source)];
        let output = pneuma(&convert);
        assert!(output.status.success(), "{name}: {output:?}");
        let rows = fs::read_to_string(&out).expect("written");
        // Names and units are those of the file; the numbers are to be the same.
        rows.lines().skip(2).map(str::to_owned).collect::<Vec<_>>()
    };
    let json = table("run-zstd.mcap", ("u_V", "gauges/a", "gauges/b"));
    assert_eq!(json.len(), 400);
    let protobuf = table("run-protobuf.mcap", ("u_V", "gauges/a", "gauges/b"));
    assert_eq!(json, protobuf);
    let ros2 = table("run-ros2.mcap", ("u_v", "gauges/0", "gauges/1"));
    assert_eq!(json, ros2);
    let output = pneuma(&["inspect", text(&fixture("run-ros2.mcap"))]);
    let shown = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(shown.contains("header/stamp/nanosec"), "{shown}");
}

fn text_of(path: &Path) -> String {
    text(path).to_owned()
}
