//! The generated references of the rig file are those of the table of keys.

use grey_box::rig::{Rig, reference};
use std::fs;
use std::path::{Path, PathBuf};

fn document(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../docs")
        .join(name)
}

#[test]
fn regress_the_committed_references_are_the_generated_ones() {
    for (name, generated) in [
        ("rig.md", reference::page()),
        ("rig.schema.json", reference::schema()),
    ] {
        let committed = fs::read_to_string(document(name)).unwrap_or_default();
        assert!(
            committed == generated,
            "docs/{name} is not the generated one: cargo run -p grey-box --example rig_reference"
        );
    }
}

/// What the schema asks of a value, as far as this project's schema goes.
fn check(schema: &serde_json::Value, value: &toml::Value, place: &str) -> Vec<String> {
    let mut faults = Vec::new();
    if let Some(words) = schema.get("enum").and_then(|words| words.as_array()) {
        let known = words.iter().any(|word| word.as_str() == value.as_str());
        if !known {
            faults.push(format!("{place}: is none of {words:?}"));
        }
    }
    let number = value
        .as_float()
        .or_else(|| value.as_integer().map(|one| one as f64));
    if let Some(number) = number {
        let limit = |key: &str| schema.get(key).and_then(serde_json::Value::as_f64);
        let low = limit("minimum").is_some_and(|least| number < least)
            || limit("exclusiveMinimum").is_some_and(|least| number <= least);
        let high = limit("maximum").is_some_and(|most| number > most)
            || limit("exclusiveMaximum").is_some_and(|most| number >= most);
        if low || high {
            faults.push(format!("{place}: {number} is out of range"));
        }
    }
    for item in value.as_array().into_iter().flatten() {
        faults.extend(check(&schema["items"], item, place));
    }
    let Some(table) = value.as_table() else {
        return faults;
    };
    for key in schema["required"].as_array().into_iter().flatten() {
        let key = key.as_str().unwrap_or_default();
        if !table.contains_key(key) {
            faults.push(format!("{place}.{key}: missing"));
        }
    }
    for (key, value) in table {
        let place = format!("{place}.{key}");
        match schema["properties"].get(key) {
            Some(inner) => faults.extend(check(inner, value, &place)),
            None if key.starts_with("effects.") => {}
            None => faults.push(format!("{place}: unknown key")),
        }
    }
    faults
}

#[test]
fn prop_what_the_reader_accepts_the_schema_accepts_and_a_slip_neither() {
    let schema: serde_json::Value = serde_json::from_str(&reference::schema()).expect("JSON");
    let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-sim/rigs");
    let mut seen = 0;
    for entry in fs::read_dir(rigs).expect("the rigs").flatten() {
        let text = fs::read_to_string(entry.path()).expect("a rig");
        let value: toml::Value = toml::from_str(&text).expect("TOML");
        assert_eq!(
            check(&schema, &value, "rig"),
            Vec::<String>::new(),
            "{}",
            entry.path().display()
        );
        seen += 1;
    }
    assert!(seen >= 5, "{seen} rigs");
    for slip in [
        "[gas]\ngama = 1.4",
        "[supply]\npressure_Pa = 6.5",
        "[valve]\nfeeds_a_when = \"above\"\nnull_V = 5\nlaminar_pressure_ratio = 0.98\nb = 0.3\nnominal_flow_l_min = 700",
        "[carriage]\nexternal_force_N = 0",
        "[controller]\nlead_s = 5",
        "[effects.tube-line]\nlength = 1",
    ] {
        let text = format!("format = \"rig/1\"\n{slip}\n");
        let value: toml::Value = toml::from_str(&text).expect("TOML");
        assert_eq!(
            check(&schema, &value, "rig").is_empty(),
            Rig::parse(&text, "r").is_ok(),
            "{slip}"
        );
        assert!(Rig::parse(&text, "r").is_err(), "{slip}");
    }
}
