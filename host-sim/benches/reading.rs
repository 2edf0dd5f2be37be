//! Time to read a recording of 22 000 rows and 18 columns.

use std::fmt::Write;
use std::fs;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use host_sim::recording::Recording;
use host_sim::rig::Rig;

const ROWS: u32 = 22_000;
const COLUMNS: u32 = 18;

fn table() -> String {
    let mut text = String::from("t_s");
    for column in 1..COLUMNS {
        let _ = write!(text, ",column_{column}");
    }
    text.push('\n');
    for row in 0..ROWS {
        let time_s = f64::from(row) * 0.02;
        let _ = write!(text, "{time_s:.2}");
        for column in 1..COLUMNS {
            let value = (time_s * f64::from(column)).sin() * 100.0;
            let _ = write!(text, ",{value:.3}");
        }
        text.push('\n');
    }
    text
}

/// A rig that reads every column that a signal exists for.
const RIG: &str = r#"
format = "rig/1"
[signals]
t = { column = "t_s", unit = "s" }
u = { column = "column_1", unit = "V" }
x = { column = "column_2", unit = "mm" }
v = { column = "column_3", unit = "mm/s" }
a = { column = "column_4", unit = "m/s2" }
p_a = { column = "column_5", unit = "kPa(g)" }
p_b = { column = "column_6", unit = "kPa(g)" }
p_s = { column = "column_7", unit = "kPa(g)" }
force = { column = "column_17", unit = "N" }
"#;

fn bench_reading(criterion: &mut Criterion) {
    let rig = Rig::parse(RIG, "rig.toml").expect("a rig");
    let path = std::env::temp_dir().join(format!("pneuma-reading-{}.csv", std::process::id()));
    fs::write(&path, table()).expect("a temporary file");
    criterion.bench_function("bench_read_22000_rows_of_18_columns", |bencher| {
        bencher.iter(|| Recording::read(black_box(&path), &rig.signals).expect("a recording"));
    });
    let _ = fs::remove_file(&path);
}

criterion_group!(benches, bench_reading);
criterion_main!(benches);
