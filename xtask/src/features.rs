//! Whether `cargo ... -p host-sim` and `cargo ... --workspace` build the same packages.
//!
//! Cargo builds a package once for each set of features that is asked of it. Where another
//! room asks for one more, the largest crate and all that it needs are built twice.

use crate::shell::{self, Outcome, cargo};
use std::collections::BTreeSet;

/// The crate that takes minutes.
const LARGEST: &str = "host-sim";

/// One line for each package that would be built twice.
pub fn findings() -> Outcome<Vec<String>> {
    let mut all = Vec::new();
    for (what, edges) in [("built", "normal,build"), ("tested", "normal,build,dev")] {
        let alone = packages(&["-p", LARGEST], edges)?;
        let whole = packages(&["--workspace"], edges)?;
        all.extend(alone.difference(&whole).map(|package| {
            format!(
                "Cargo.toml: {package}: with `-p {LARGEST}` it is {what} with these features, with \
                 `--workspace` with others; ask for the same in {LARGEST}/Cargo.toml"
            )
        }));
    }
    Ok(all)
}

/// Packages with their versions and features.
fn packages(choice: &[&str], edges: &str) -> Outcome<BTreeSet<String>> {
    let shape = ["--prefix", "none", "--no-dedupe", "--format", "{p} {f}"];
    let words = [&["tree", "--locked", "--edges", edges], &shape[..], choice].concat();
    let mut command = cargo(&words);
    let tree = shell::output_of(&mut command)
        .ok_or_else(|| format!("`{}` failed", shell::as_typed(&command)))?;
    Ok(tree
        .lines()
        .map(|line| line.trim_end().to_owned())
        .collect())
}

#[cfg(test)]
mod tests {
    #[test]
    fn prop_the_largest_crate_is_built_once() {
        let findings = super::findings().unwrap();
        assert!(findings.is_empty(), "{}", findings.join("\n"));
    }
}
