//! Makes foreign text inert before it enters a page.
//!
//! Column names, file names and labels come from recordings written by others
//! and must never be read as markup.

/// Text for an element's content or a double-quoted attribute.
pub fn html(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            // Control characters are not allowed in HTML at all.
            control if control.is_control() && !control.is_whitespace() => {
                escaped.push(char::REPLACEMENT_CHARACTER);
            }
            other => escaped.push(other),
        }
    }
    escaped
}

/// Escaped text in which `` `code` `` spans become code elements.
///
/// An unpaired backtick stays a backtick.
pub fn prose(text: &str) -> String {
    let pieces: Vec<&str> = text.split('`').collect();
    let last = pieces.len() - 1;
    let mut escaped = String::with_capacity(text.len());
    for (position, piece) in pieces.iter().enumerate() {
        let inside_code = position % 2 == 1;
        if inside_code && position < last {
            escaped.push_str(&format!("<code>{}</code>", html(piece)));
        } else {
            if inside_code {
                escaped.push('`');
            }
            escaped.push_str(&html(piece));
        }
    }
    escaped
}

/// JSON text for the inside of a script element.
///
/// A browser looks for `</script` and `<!--` before anything parses the JSON,
/// so the characters that begin markup are written as JSON escapes. In JSON
/// they occur only inside strings, where such an escape means the same.
pub fn json(json_text: &str) -> String {
    json_text
        .replace('&', "\\u0026")
        .replace('<', "\\u003c")
        .replace('>', "\\u003e")
        .replace('\u{2028}', "\\u2028")
        .replace('\u{2029}', "\\u2029")
}

/// An element id made of a heading: lower-case letters, digits and hyphens.
pub fn slug(text: &str) -> String {
    let mut slug = String::new();
    for character in text.chars().flat_map(char::to_lowercase) {
        if character.is_alphanumeric() {
            slug.push(character);
        } else if !slug.is_empty() && !slug.ends_with('-') {
            slug.push('-');
        }
    }
    let slug = slug.trim_end_matches('-');
    if slug.is_empty() {
        "section".to_owned()
    } else {
        slug.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_markup_becomes_text() {
        assert_eq!(
            html("<img onerror=\"x\" a='1'>&"),
            "&lt;img onerror=&quot;x&quot; a=&#39;1&#39;&gt;&amp;"
        );
        assert_eq!(html("a\u{0}b\nc"), "a\u{fffd}b\nc");
    }

    #[test]
    fn regress_code_spans_are_escaped_too() {
        assert_eq!(prose("see `p<a`!"), "see <code>p&lt;a</code>!");
        assert_eq!(prose("one ` alone"), "one ` alone");
        assert_eq!(prose("`a` and `b"), "<code>a</code> and `b");
    }

    #[test]
    fn regress_json_survives_escaping() {
        let text = serde_json::json!({"name": "</script><!--&\u{2028}"}).to_string();
        let escaped = json(&text);
        assert!(!escaped.contains('<') && !escaped.contains('&'));
        let back: serde_json::Value = serde_json::from_str(&escaped).unwrap();
        assert_eq!(back["name"], "</script><!--&\u{2028}");
    }

    #[test]
    fn regress_slugs_are_plain() {
        assert_eq!(slug("Where the misfit sits?"), "where-the-misfit-sits");
        assert_eq!(slug("<<>>"), "section");
    }
}
