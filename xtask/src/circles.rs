//! No circle of files, nor of rooms: data flow one way, and each can be read with those below it.
//!
//! A file stands on another where a `use` or a path in its code (`crate::valve::flow(x)`) names that one's
//! module or something in it. What a
//! file takes from the module above it (`use super::Name`) is no tie, as a room's own names are there for
//! all in it; tests within a file are left out.

use std::collections::{BTreeMap, BTreeSet};

/// A module by its path within the crate, from the top; empty for the crate itself.
type Module = Vec<String>;

/// The circles among files of one crate, each as its files; `sources` are path below `src` and text.
pub fn circles(sources: &[(String, String)]) -> Vec<Vec<String>> {
    among(sources, &|path| path)
}

/// The circles among the rooms of one crate: folders at the top of its `src`, with what is below
/// them, and files there.
pub fn circles_of_rooms(sources: &[(String, String)]) -> Vec<Vec<String>> {
    let within: Vec<(String, String)> = sources
        .iter()
        .filter(|(path, _)| !matches!(path.as_str(), "lib.rs" | "main.rs"))
        .cloned()
        .collect();
    among(&within, &|path| {
        path.split_once('/').map_or(path, |(room, _)| room)
    })
}

/// The circles among groups of files.
fn among<'f>(
    sources: &'f [(String, String)],
    group: &dyn Fn(&'f str) -> &'f str,
) -> Vec<Vec<String>> {
    let files: BTreeMap<Module, &str> = sources
        .iter()
        .map(|(path, _)| (module_of(path), path.as_str()))
        .collect();
    let mut ties: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    let is_of_tests = |path: &str| path.ends_with("tests.rs");
    for (path, text) in sources.iter().filter(|(path, _)| !is_of_tests(path)) {
        let own = group(path);
        let below = stands_on(path, text, &files).into_iter().map(group);
        let is_folder = own != path.as_str();
        let others = below.filter(|other| !is_folder || *other != own);
        ties.entry(own).or_default().extend(others);
    }
    let reach = |from: &str| {
        let mut seen = BTreeSet::new();
        let mut open: Vec<&str> = ties.get(from).into_iter().flatten().copied().collect();
        while let Some(file) = open.pop() {
            if seen.insert(file) {
                open.extend(ties.get(file).into_iter().flatten());
            }
        }
        seen
    };
    let reached: BTreeMap<&str, BTreeSet<&str>> =
        ties.keys().map(|file| (*file, reach(file))).collect();
    let mut found: BTreeSet<Vec<String>> = BTreeSet::new();
    for (file, below) in &reached {
        if below.contains(file) {
            let members = below.iter().filter(|other| reached[*other].contains(file));
            found.insert(members.map(|member| (*member).to_owned()).collect());
        }
    }
    found.into_iter().collect()
}

fn module_of(path: &str) -> Module {
    let bare = path.strip_suffix(".rs").unwrap_or(path);
    let mut names: Module = bare.split('/').map(str::to_owned).collect();
    if names
        .last()
        .is_some_and(|last| matches!(last.as_str(), "mod" | "lib" | "main"))
    {
        names.pop();
    }
    names
}

/// The files that a file's `use` declarations name.
fn stands_on<'f>(path: &str, text: &str, files: &BTreeMap<Module, &'f str>) -> BTreeSet<&'f str> {
    let own = module_of(path);
    let code = text
        .split("#[cfg(test)]\nmod tests {")
        .next()
        .unwrap_or(text);
    let declarations = code.split(';').filter_map(|statement| {
        let begin = statement.rfind("use ")?;
        let is_word = statement[..begin].ends_with([' ', '\n', ')']) || begin == 0;
        is_word.then(|| &statement[begin + 4..])
    });
    let mut named = BTreeSet::new();
    let declared = declarations.flat_map(|tree| leaves("", tree));
    for path in declared.chain(paths_in_code(code)) {
        let Some(absolute) = absolute(&own, &path) else {
            continue;
        };
        let deepest = (1..=absolute.len())
            .rev()
            .find_map(|length| files.get(&absolute[..length]));
        named.extend(deepest.filter(|file| Some(**file) != files.get(&own).copied()));
    }
    named
}

/// Paths that begin with `crate` or `super`, wherever they stand; comments and attributes are left out.
fn paths_in_code(code: &str) -> Vec<String> {
    let is_code = |line: &&str| !line.trim_start().starts_with(['/', '#']);
    let is_of_path = |character: char| character.is_alphanumeric() || "_:".contains(character);
    code.lines()
        .filter(is_code)
        .flat_map(|line| line.split(|character| !is_of_path(character)))
        .filter(|word| word.starts_with("crate::") || word.starts_with("super::"))
        .map(|word| word.trim_end_matches(':').to_owned())
        .collect()
}

/// `a::{b, c::d}` as `a::b` and `a::c::d`.
fn leaves(before: &str, tree: &str) -> Vec<String> {
    let tree = tree.trim();
    let Some((head, rest)) = tree.split_once('{') else {
        return vec![format!("{before}{tree}")];
    };
    let inner = rest.rsplit_once('}').map_or(rest, |(inner, _)| inner);
    let before = format!("{before}{}", head.trim());
    let (mut depth, mut from, mut all) = (0_usize, 0, Vec::new());
    for (place, character) in inner.char_indices() {
        match character {
            '{' => depth += 1,
            '}' => depth = depth.saturating_sub(1),
            ',' if depth == 0 => {
                all.extend(leaves(&before, &inner[from..place]));
                from = place + 1;
            }
            _ => {}
        }
    }
    all.extend(leaves(&before, &inner[from..]));
    all
}

/// The path from the top of the crate; `None` for another crate's, and for a name of the module above.
fn absolute(own: &[String], path: &str) -> Option<Module> {
    let mut names: Vec<&str> = path.split("::").map(str::trim).collect();
    let mut module: Module = match *names.first()? {
        "crate" => Vec::new(),
        "self" | "super" => own.to_vec(),
        _ => return None,
    };
    while let Some(first) = names.first().copied() {
        match first {
            "crate" | "self" => {}
            "super" => {
                module.pop()?;
            }
            _ => break,
        }
        names.remove(0);
    }
    let first = names.first()?.split(' ').next()?;
    module.push(first.to_owned());
    module.extend(names[1..].iter().map(|name| (*name).to_owned()));
    Some(module)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn owned(sources: &[(&str, &str)]) -> Vec<(String, String)> {
        let owned = |(path, text): &(&str, &str)| ((*path).to_owned(), (*text).to_owned());
        sources.iter().map(owned).collect()
    }

    fn found(sources: &[(&str, &str)]) -> Vec<Vec<String>> {
        circles(&owned(sources))
    }

    #[test]
    fn val_a_circle_is_found_through_groups_and_folders() {
        let sources = [
            ("lib.rs", "mod a;\nmod b;\n"),
            ("a.rs", "use crate::b::{self, deep::{One, Two}};\n"),
            ("b/mod.rs", "mod deep;\npub use deep::One;\n"),
            (
                "b/deep.rs",
                "//! Text.\n\nuse std::fs;\nuse super::super::a::Three;\n",
            ),
        ];
        assert_eq!(found(&sources), [["a.rs", "b/deep.rs"]]);
    }

    #[test]
    fn val_a_path_in_the_code_is_a_tie() {
        let sources = [
            ("lib.rs", "mod a;\nmod b;\n"),
            ("a.rs", "use crate::b::Two;\npub struct One;\n"),
            (
                "b.rs",
                "pub struct Two;\nfn two() {\n    super::a::one(1);\n}\n",
            ),
        ];
        assert_eq!(found(&sources), [["a.rs", "b.rs"]]);
        let said = [
            sources[0],
            sources[1],
            ("b.rs", "/// As [`crate::a::One`].\npub struct Two;\n"),
        ];
        assert_eq!(found(&said), Vec::<Vec<String>>::new());
    }

    /// No file stands on itself through others, and yet neither room can be read before the other.
    #[test]
    fn val_rooms_stand_on_each_other_where_their_files_do_not() {
        let sources = owned(&[
            ("lib.rs", "mod a;\nmod b;\n"),
            ("a/one.rs", "use crate::b::two::Two;\n"),
            ("a/three.rs", ""),
            ("b/two.rs", ""),
            ("b/four.rs", "use crate::a::three::Three;\n"),
        ]);
        assert_eq!(circles(&sources), Vec::<Vec<String>>::new());
        assert_eq!(circles_of_rooms(&sources), [["a", "b"]]);
    }

    #[test]
    fn prop_one_way_is_no_circle_and_tests_do_not_count() {
        let sources = [
            ("lib.rs", "mod a;\nmod b;\npub use a::One;\n"),
            ("a.rs", "use super::b::Two;\npub struct One;\n"),
            (
                "b.rs",
                "use crate::One;\npub struct Two;\n#[cfg(test)]\nmod tests {\n    use crate::a::One;\n}\n",
            ),
        ];
        assert_eq!(found(&sources), Vec::<Vec<String>>::new());
    }
}
