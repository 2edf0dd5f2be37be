//! Signals that a file does not hold: a value that was the same all the time, and rows that are
//! evenly apart.

use grey_box::recording::Recording;
use grey_box::rig::Rig;

const RIG: &str = "\
format = \"rig/1\"

[signals]
t = { every = 2.0, unit = \"ms\" }
u = { column = \"U\", unit = \"V\" }
p_s = { constant = 6.0, unit = \"bar(g)\" }
p_a = { constant = 5.0, unit = \"bar(g)\" }
";

fn rig(text: &str) -> Rig {
    Rig::parse(text, "rig.toml").unwrap_or_else(|fault| panic!("{fault}"))
}

#[test]
fn val_a_table_without_time_has_even_rows_and_stated_values() {
    let rig = rig(RIG);
    let text = "U,other\n1.0,7\n2.0,7\n2.0,7\n3.0,7\n";
    let recording = Recording::read_from(text.as_bytes(), "table.csv", None, &rig.signals)
        .unwrap_or_else(|fault| panic!("{fault}"));
    assert_eq!(recording.time_s, [0.0, 0.002, 0.004, 0.006]);
    assert_eq!(recording.signal("u"), Some(&[1.0, 2.0, 2.0, 3.0][..]));
    assert_eq!(recording.signal("p_s"), Some(&[701_325.0; 4][..]));
    assert_eq!(recording.signal("p_a"), Some(&[601_325.0; 4][..]));
    assert_eq!(recording.unused_columns, ["other"]);
}

#[test]
fn prop_stated_signals_come_back_as_they_were_written() {
    let stated = rig(RIG);
    assert_eq!(rig(&stated.to_toml()).signals, stated.signals);
    assert_eq!(Rig::edited(RIG, &stated), RIG);
}

#[test]
fn val_a_signal_has_a_column_or_a_value() {
    for (signal, said) in [
        ("t = { every = 0.0, unit = \"s\" }", "signals.t.every"),
        ("t = { constant = 1.0, unit = \"s\" }", "signals.t.constant"),
        (
            "t = { column = \"t\", every = 1.0, unit = \"s\" }",
            "signals.t.column",
        ),
        (
            "t = { column = \"t\", unit = \"s\" }\nx = { every = 1.0, unit = \"m\" }",
            "signals.x.every",
        ),
        (
            "t = { column = \"t\", unit = \"s\" }\nx = { column = \"x\", constant = 1.0, unit = \"m\" }",
            "signals.x.column",
        ),
    ] {
        let text = format!("format = \"rig/1\"\n[signals]\n{signal}\n");
        let fault = Rig::parse(&text, "rig.toml").expect_err(signal).to_string();
        assert!(fault.contains(said), "{signal}: {fault}");
    }
}
