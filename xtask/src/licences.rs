//! Whether everything that is built in may be given on under the licences that its authors chose.

use crate::shell::{self, Outcome, cargo};
use spdx::{Expression, LicenseReq, ParseMode};

/// Licences that ask for no more than to be named, and MPL-2.0, which covers its own files only:
/// what it asks for stands in `NOTICE`.
const ALLOWED: [&str; 12] = [
    "0BSD",
    "Apache-2.0",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "ISC",
    "MIT",
    "MPL-2.0",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];
/// The licence whose packages are named in [`NOTICE`].
const NAMED: &str = "MPL-2.0";
/// The file that names them.
const NOTICE: &str = "NOTICE";
/// Where a package may come from.
const REGISTRY: &str = "registry+https://github.com/rust-lang/crates.io-index";

/// One line for each package with a licence that is not allowed, from elsewhere, or not named.
pub fn findings() -> Outcome<Vec<String>> {
    let mut command = cargo(&["metadata", "--locked", "--format-version", "1"]);
    let text = shell::output_of(&mut command)
        .ok_or_else(|| format!("`{}` failed", shell::as_typed(&command)))?;
    let metadata: serde_json::Value = serde_json::from_str(&text).map_err(|e| e.to_string())?;
    let notice = std::fs::read_to_string(shell::root().join(NOTICE)).unwrap_or_default();
    let packages = metadata["packages"].as_array().into_iter().flatten();
    Ok(packages
        .filter_map(|package| finding(package, &notice))
        .collect())
}

fn finding(package: &serde_json::Value, notice: &str) -> Option<String> {
    let name = package["name"].as_str().unwrap_or_default();
    // No source: a folder of this repository.
    let source = package["source"].as_str()?;
    let licence = package["license"].as_str().unwrap_or("none");
    if source != REGISTRY {
        return Some(format!("{name}: comes from {source}, expected crates.io"));
    }
    if !is_allowed(licence, &ALLOWED) {
        return Some(format!(
            "{name}: its licence is {licence}, expected one that xtask/src/licences.rs allows"
        ));
    }
    let without_named: Vec<&str> = ALLOWED.into_iter().filter(|one| *one != NAMED).collect();
    let needs_name = !is_allowed(licence, &without_named);
    (needs_name && !notice.contains(name))
        .then(|| format!("{NOTICE}: {name} ({licence}) is not named"))
}

/// Whether an expression holds with these licences; older packages write `A/B` for `A OR B`.
fn is_allowed(licence: &str, allowed: &[&str]) -> bool {
    let is_one = |requirement: &LicenseReq| {
        let id = requirement.license.id();
        id.is_some_and(|id| allowed.contains(&id.name))
    };
    Expression::parse_mode(licence, ParseMode::LAX)
        .is_ok_and(|expression| expression.evaluate(is_one))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_every_package_may_be_given_on() {
        let findings = findings().unwrap();
        assert!(findings.is_empty(), "{}", findings.join("\n"));
    }

    #[test]
    fn prop_expressions_are_read() {
        for good in [
            "MIT",
            "MIT/GPL-3.0",
            "(MIT OR GPL-3.0-only) AND Zlib",
            "Apache-2.0 WITH LLVM-exception",
        ] {
            assert!(is_allowed(good, &ALLOWED), "{good}");
        }
        for bad in ["GPL-3.0-only", "MIT AND GPL-2.0-only", "none", ""] {
            assert!(!is_allowed(bad, &ALLOWED), "{bad}");
        }
    }
}
