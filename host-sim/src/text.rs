//! Text helpers shared by the readers: one-line error texts and suggestions.

/// Longest piece of foreign text (a cell, a key) quoted in an error line.
const QUOTED_CHARACTERS: usize = 60;

/// Shows `text` on one line: control characters escaped, long text cut.
pub(crate) fn one_line(text: &str) -> String {
    escape(text, QUOTED_CHARACTERS)
}

/// Shows a file name on one line; file names may hold line breaks.
pub(crate) fn file_name(path: &str) -> String {
    escape(path, usize::MAX)
}

fn escape(text: &str, limit: usize) -> String {
    let mut shown = String::with_capacity(text.len().min(limit));
    for (count, character) in text.chars().enumerate() {
        if count == limit {
            shown.push('…');
            break;
        }
        if breaks_a_line(character) {
            shown.extend(character.escape_default());
        } else {
            shown.push(character);
        }
    }
    shown
}

/// Control characters, and the Unicode separators that some terminals and
/// editors also treat as the end of a line.
fn breaks_a_line(character: char) -> bool {
    character.is_control() || matches!(character, '\u{2028}' | '\u{2029}')
}

/// The known name closest to `word`, when it is close enough to be a slip.
pub(crate) fn closest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    /// Below this Jaro-Winkler similarity a suggestion confuses more than it
    /// helps (1 is equal).
    const SLIP: f64 = 0.8;
    let lower = word.to_lowercase();
    known
        .into_iter()
        .map(|name| (strsim::jaro_winkler(&lower, &name.to_lowercase()), name))
        .filter(|(similarity, _)| *similarity >= SLIP)
        .max_by(|left, right| left.0.total_cmp(&right.0))
        .map(|(_, name)| name)
}

/// `one of: a, b, c (did you mean "b"?)` for a word that is not among `known`.
pub(crate) fn expected_one_of(word: &str, known: &[&str]) -> String {
    format!("one of: {}{}", known.join(", "), did_you_mean(word, known))
}

/// ` (did you mean "b"?)` when a known name is close, or nothing.
pub(crate) fn did_you_mean(word: &str, known: &[&str]) -> String {
    closest(word, known.iter().copied())
        .map(|name| format!(" (did you mean \"{}\"?)", one_line(name)))
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_line_breaks_are_escaped() {
        assert_eq!(one_line("a\nb\u{2028}c"), "a\\nb\\u{2028}c");
    }

    #[test]
    fn val_long_text_is_cut() {
        assert_eq!(one_line(&"x".repeat(500)).chars().count(), 61);
    }

    #[test]
    fn val_a_slip_gets_a_suggestion_and_nonsense_none() {
        assert_eq!(closest("null_v", ["null_V", "opening_V"]), Some("null_V"));
        assert_eq!(closest("qqq", ["null_V", "opening_V"]), None);
    }
}
