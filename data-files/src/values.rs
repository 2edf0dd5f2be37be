//! Numbers of other encodings as values of JSON, with all their digits.

use serde_json::Value;

/// A double; what is no finite number is said in words, which JSON's numbers cannot.
pub(crate) fn double(value: f64) -> Value {
    if value.is_finite() {
        value.into()
    } else {
        value.to_string().into()
    }
}

/// A single as it would be typed: 0.1 is 0.1, and not 0.10000000149011612.
pub(crate) fn single(value: f32) -> Value {
    double(value.to_string().parse().unwrap_or(f64::from(value)))
}
