//! How long functions are, read off the formatter's layout: a function ends at the brace that stands
//! where its first line begins.

/// A function of more lines than this does more than one thing.
pub const MOST_LINES: usize = 60;

/// The functions of a file before its tests that are longer: first line, name and lines.
pub fn long_functions(text: &str) -> Vec<(usize, String, usize)> {
    let lines: Vec<&str> = text
        .lines()
        .take_while(|line| *line != "mod tests {")
        .collect();
    let starts = lines.iter().enumerate();
    starts
        .filter_map(|(first, line)| {
            let name = function_name(line)?;
            let indent = line.len() - line.trim_start().len();
            let end = format!("{}}}", " ".repeat(indent));
            let length = lines[first..].iter().position(|line| *line == end)? + 1;
            (length > MOST_LINES).then_some((first + 1, name, length))
        })
        .collect()
}

/// The name of the function that a line begins; none where it ends there, too.
fn function_name(line: &str) -> Option<String> {
    let before = line.trim_start();
    let (modifiers, after) = before.split_once("fn ")?;
    let is_modifier = |word: &str| {
        ["const", "async", "unsafe", "extern"].contains(&word) || word.starts_with("pub")
    };
    let is_declared = modifiers.split_whitespace().all(is_modifier);
    let ends_here = line.ends_with(';') || line.ends_with('}');
    let name: String = after
        .chars()
        .take_while(|one| one.is_alphanumeric() || *one == '_')
        .collect();
    (is_declared && !ends_here && !name.is_empty()).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_function_counts_from_its_name_to_its_brace() {
        let of = |body: usize| {
            let body = "        work();\n".repeat(body);
            format!(
                "impl A {{\n    pub(crate) fn long<R>(\n        a: R,\n    ) {{\n{body}    }}\n}}\n"
            )
        };
        assert_eq!(long_functions(&of(MOST_LINES - 4)), []);
        let found = long_functions(&of(MOST_LINES - 3));
        assert_eq!(found, [(2, "long".to_owned(), MOST_LINES + 1)]);
        assert_eq!(
            long_functions("    fn declared(&self);\n// fn in a comment\n"),
            []
        );
    }
}
