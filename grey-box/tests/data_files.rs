//! Files of other programs, each written by a library of that program's own world
//! (`data-files/fixtures/write.py`), hold the recording that the text table holds.

use std::path::PathBuf;

use grey_box::recording::{Recording, RecordingError};
use grey_box::rig::Rig;

/// The columns of `run.csv`, each under the name that a file gives it.
fn rig(name: &dyn Fn(&str, usize) -> String, time: &str) -> Rig {
    let columns = [
        ("u", "u_V", "V"),
        ("p_a", "p_a_Pa", "Pa(abs)"),
        ("p_b", "p_b_Pa", "Pa(abs)"),
        ("x", "x_m", "m"),
        ("v", "v_m_s", "m/s"),
    ];
    let mut text = format!("format = \"rig/1\"\n[signals]\nt = {{ {time} }}\n");
    for (place, (signal, column, unit)) in columns.into_iter().enumerate() {
        let column = name(column, place + 1);
        text += &format!("{signal} = {{ column = \"{column}\", unit = \"{unit}\" }}\n");
    }
    Rig::parse(&text, "rig.toml").expect("a rig of signals alone")
}

fn fixture(name: &str) -> PathBuf {
    let folder = env!("CARGO_MANIFEST_DIR");
    PathBuf::from(folder)
        .join("../data-files/fixtures")
        .join(name)
}

fn read(name: &str, rig: &Rig) -> Result<Recording, RecordingError> {
    Recording::read(fixture(name), &rig.signals)
}

fn plain_rig() -> Rig {
    rig(&|column, _| column.into(), "column = \"t_s\", unit = \"s\"")
}

fn reference() -> Recording {
    read("run.csv", &plain_rig()).expect("the text table")
}

#[track_caller]
fn assert_same(name: &str, rig: &Rig) -> Recording {
    let read = read(name, rig).unwrap_or_else(|cause| panic!("{cause}"));
    let text = reference();
    assert_eq!(read.signals, text.signals, "{name}");
    let off = |(one, other): (&f64, &f64)| (one - other).abs();
    let most_s = read
        .time_s
        .iter()
        .zip(&text.time_s)
        .map(off)
        .fold(0.0, f64::max);
    assert!(
        read.time_s.len() == text.time_s.len() && most_s < 1e-12,
        "{name}: {most_s}"
    );
    read
}

#[test]
fn val_files_of_other_programs_hold_the_same_recording() {
    for name in [
        "run-zstd.parquet",
        "run-pandas.parquet",
        "run-lz4.feather",
        "run-zstd.feather",
        "run-v5.mat",
        "run-v7-struct.mat",
        "run-v73.mat",
        "run.h5",
        "run-compound.h5",
        "run.mf4",
        "run-deflated.mf4",
        "run-transposed.mf4",
        "run.tdms",
        "run-waveform.tdms",
        "run-chunks.tdms",
        "run-interleaved.tdms",
        "run.xlsx",
        "run-units.xlsx",
    ] {
        assert_same(name, &plain_rig());
    }
}

#[test]
fn val_columns_of_a_matrix_have_its_name_and_their_number() {
    let time = "column = \"data(:,1)\", unit = \"s\"";
    let of_matlab = rig(&|_, place| format!("data(:,{})", place + 1), time);
    assert_same("run-v5-matrix.mat", &of_matlab);
    let time = "column = \"data[0]\", unit = \"s\"";
    assert_same(
        "run-matrix.h5",
        &rig(&|_, place| format!("data[{place}]"), time),
    );
}

#[test]
fn val_a_column_may_be_named_with_its_table() {
    let seconds = |column: &str| format!("column = \"{column}\", unit = \"s\"");
    for (name, table) in [
        ("run-v7-struct.mat", "run."),
        ("run.h5", "rig/run 1/"),
        ("run-compound.h5", "run/"),
        ("run.tdms", "axis/"),
    ] {
        let full = rig(
            &|column, _| format!("{table}{column}"),
            &seconds(&format!("{table}t_s")),
        );
        assert_same(name, &full);
    }
}

#[test]
fn val_messages_are_rows_of_their_topic_at_their_log_time() {
    let column = |name: &str, _| match name {
        "p_a_Pa" => "gauges/a".into(),
        "p_b_Pa" => "/axis/gauges/b".into(),
        other => other.into(),
    };
    let by_clock = rig(&column, "column = \"t\", unit = \"s\"");
    let by_column = rig(&column, "column = \"log_time\", unit = \"ns\"");
    for name in ["run-zstd.mcap", "run-lz4.mcap"] {
        let read = assert_same(name, &by_clock);
        assert!(read.remarks[0].contains("log time"), "{:?}", read.remarks);
        assert_same(name, &by_column);
    }
}

#[test]
fn val_dates_count_from_the_first_row_whatever_the_unit() {
    for unit in ["s", "ns"] {
        let time = format!("column = \"t_s\", unit = \"{unit}\"");
        let stamped = rig(&|column, _| column.into(), &time);
        let read = assert_same("run-datetime.parquet", &stamped);
        let says = |one: &String| one.contains("2026-03-02T09:12:31");
        assert!(read.remarks.iter().any(says), "{:?}", read.remarks);
    }
}

#[test]
fn val_positions_of_a_slower_table_lie_between_their_rows_and_pressures_stay() {
    let read = read("run-two-rates.mf4", &plain_rig()).expect("two rates with one clock");
    let text = reference();
    assert_eq!(read.remarks.len(), 5, "{:?}", read.remarks);
    // The last rows lie behind the last position.
    let rows = read.len();
    assert_eq!(rows, text.len() - 4);
    for signal in ["u", "p_a", "p_b"] {
        assert_eq!(
            read.signals[signal],
            text.signals[signal][..rows],
            "{signal}"
        );
    }
    for (row, x) in read.signals["x"].iter().enumerate() {
        let (from, to) = (row / 5 * 5, (row / 5 + 1) * 5);
        let (known, part) = (&text.signals["x"], (row % 5) as f64 / 5.0);
        let expected = known[from] + part * (known.get(to).unwrap_or(&0.0) - known[from]);
        assert!(
            (x - expected).abs() < 1e-12,
            "row {row}: {x} for {expected}"
        );
    }
}

#[test]
fn prop_what_a_file_lacks_is_said_with_the_names_that_it_has() {
    let other = rig(
        &|column, _| column.replace("x_m", "x_mm"),
        "column = \"t_s\", unit = \"s\"",
    );
    for name in ["run-pandas.parquet", "run-v73.mat", "run.tdms", "run.xlsx"] {
        let line = read(name, &other).expect_err("no such column").to_string();
        assert!(line.contains("\"x_mm\"") && line.contains("x_m"), "{line}");
    }
    let wrong = rig(
        &|column, _| column.into(),
        "column = \"t_s\", unit = \"ms\"",
    );
    for name in [
        "run-zstd.parquet",
        "run.h5",
        "run.mf4",
        "run.tdms",
        "run-units.xlsx",
    ] {
        let line = read(name, &wrong).expect_err("another unit").to_string();
        assert!(line.contains("\"s\"") && line.contains("ms"), "{line}");
    }
}

#[test]
fn val_scales_durations_and_tables_of_the_same_instants_are_as_the_file_means_them() {
    for name in [
        "run-scaled.h5",
        "run-durations.xlsx",
        "run-a-group-each.mf4",
    ] {
        assert_same(name, &plain_rig());
    }
    // The pressures' table has no time of its own, and as many rows as the one that has.
    let column = |name: &str, _| match name {
        "p_a_Pa" | "p_b_Pa" => format!("run.gauges.{name}"),
        other => format!("run.{other}"),
    };
    let nested = rig(&column, "column = \"run.t_s\", unit = \"s\"");
    assert_same("run-substruct.mat", &nested);
}

#[test]
fn val_topics_that_begin_later_count_from_the_same_instant() {
    let read = read("run-two-topics.mcap", &plain_rig()).expect("two topics with one clock");
    let text = reference();
    assert_eq!(read.len(), text.len() - 5);
    for (signal, values) in &read.signals {
        assert_eq!(values[..], text.signals[signal][5..], "{signal}");
    }
    let says = |one: &String| one.contains("log time");
    assert!(read.remarks.iter().any(says), "{:?}", read.remarks);
}

/// What a library would read as other numbers than those that were written.
#[test]
fn regress_raw_values_and_stamps_of_tdms_are_refused() {
    for (name, says) in [
        ("refused-scale.tdms", "raw values and a scale"),
        ("refused-stamps.tdms", "absolute stamps"),
    ] {
        let line = read(name, &plain_rig()).expect_err("refused").to_string();
        assert!(line.contains(says), "{line}");
    }
}
