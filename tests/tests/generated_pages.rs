//! Pages that are made from the code say what it says.

use std::path::Path;
use tests::{effects, thresholds};

const ANEW: &str = "write it anew: cargo run --release -p tests --example effects";

#[test]
fn prop_the_page_of_effects_is_that_of_the_list() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    let written = std::fs::read_to_string(docs.join("effects.md")).expect("docs/effects.md");
    let page = effects::page().expect("heads of the laws");
    assert!(written == page, "docs/effects.md is out of date; {ANEW}");
    for effect in effects::named() {
        let name = effect.name;
        let picture = docs.join(format!("effects/{name}.svg"));
        assert!(
            picture.is_file(),
            "{} is missing; {ANEW}",
            picture.display()
        );
        let sizes = effects::drawn(name);
        assert!(!sizes.is_empty(), "{name}: no size to draw it at");
        for (key, value) in sizes {
            let known = effect.parameter(key);
            let least = known.unwrap_or_else(|| panic!("{name} has no {key}")).least;
            assert!(*value >= least, "{name}.{key} = {value}");
        }
        let lines = page
            .split(&format!("\n## {name}\n"))
            .nth(1)
            .expect("a section");
        let section = lines.split("\n## ").next().expect("a section");
        let is_stated = section.contains("```text") || section.contains("The law stands with");
        assert!(is_stated, "{name}: its law is not stated");
    }
}

#[test]
fn prop_the_deciding_numbers_of_the_book_are_those_of_the_code() {
    let method = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/method.md");
    let method = std::fs::read_to_string(method).expect("docs/method.md");
    let table = thresholds::table();
    assert!(
        method.contains(table.trim()),
        "docs/method.md is out of date; write it anew: cargo run -p tests --example thresholds"
    );
}
