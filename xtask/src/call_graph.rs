//! Who calls whom in a firmware image, from its instructions: what a task can
//! reach, and how much stack it can take.
//!
//! The stack of a function is the sum of all that it ever pushes, whatever the
//! way through it: a bound, not a measurement. Calls through a register and
//! recursion have no bound and are reported as such.

use crate::shell::Outcome;
use crate::thumb::{self, Effect};
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};
use std::collections::{BTreeMap, BTreeSet};

/// A function of the image.
#[derive(Clone, Debug, Default, PartialEq)]
struct Function {
    name: String,
    size: u32,
    /// All that it pushes, bytes.
    stack_bytes: u32,
    /// Functions that it calls or ends in, by address.
    calls: BTreeSet<u32>,
    /// Why its calls or its stack cannot be told.
    doubts: BTreeSet<String>,
}

/// The functions of an image by address.
#[derive(Debug, Default)]
pub struct CallGraph {
    functions: BTreeMap<u32, Function>,
}

/// What a function can reach.
#[derive(Debug, Default, PartialEq)]
pub struct Reach {
    /// Names on the way to the first function that panics.
    pub panic_path: Option<Vec<String>>,
    /// What no bound can be given for.
    pub doubts: Vec<String>,
    /// The most stack that it can take, bytes; without bound where there are doubts.
    pub stack_bytes: u32,
    /// Functions of soft arithmetic, which this processor has no instructions for.
    pub soft_arithmetic: Vec<String>,
}

impl CallGraph {
    /// Reads an image (ELF).
    pub fn read(image: &[u8]) -> Outcome<Self> {
        let file = object::File::parse(image).map_err(|error| format!("no ELF image: {error}"))?;
        let mut extents = BTreeMap::new();
        let mut data = BTreeMap::new();
        for symbol in file.symbols() {
            let name = symbol.name().unwrap_or_default();
            let address = word(symbol.address())?;
            match name.get(..2) {
                // Arm ELF: from here on data, or instructions again.
                Some("$d") => drop(data.insert(address, true)),
                Some("$t") => drop(data.insert(address, false)),
                _ if symbol.kind() == SymbolKind::Text && symbol.size() > 0 => {
                    let name = format!("{:#}", rustc_demangle::demangle(name));
                    extents.insert(address & !1, (name, word(symbol.size())?));
                }
                _ => {}
            }
        }
        let mut graph = Self::default();
        for section in file.sections().filter(|s| s.kind() == SectionKind::Text) {
            let begin = word(section.address())?;
            let bytes = section.data().map_err(|error| error.to_string())?;
            let code = Code {
                begin,
                bytes,
                data: &data,
            };
            for (address, (name, size)) in &extents {
                if code.holds(*address) {
                    let function = code.function(*address, name, *size, &extents);
                    graph.functions.insert(*address, function);
                }
            }
        }
        Ok(graph)
    }

    /// Where the function that holds this address begins, and its name.
    pub fn function_at(&self, address: u32) -> Option<(u32, &str)> {
        let (begin, function) = self.functions.range(..=address).next_back()?;
        let is_inside = address < begin.saturating_add(function.size);
        is_inside.then_some((*begin, &function.name))
    }

    /// What a function pushes itself, without those that it calls, bytes.
    pub fn own_stack_bytes(&self, name: &str) -> Outcome<u32> {
        self.find(name).map(|(_, function)| function.stack_bytes)
    }

    fn find(&self, name: &str) -> Outcome<(u32, &Function)> {
        let mut functions = self.functions.iter();
        let found = functions.find(|(_, function)| function.name == name);
        let (address, function) =
            found.ok_or_else(|| format!("the image has no function `{name}`"))?;
        Ok((*address, function))
    }

    /// What the function with this name can reach.
    pub fn reach(&self, root: &str) -> Outcome<Reach> {
        let (address, _) = self.find(root)?;
        let mut reach = Reach::default();
        let mut way = vec![address];
        let mut known = BTreeMap::new();
        reach.stack_bytes = self.descend(address, &mut way, &mut known, &mut reach);
        reach.doubts.sort();
        reach.doubts.dedup();
        Ok(reach)
    }

    /// The calls that make the bound of a function's stack, from it down to the
    /// last: names, and what each pushes itself, bytes.
    pub fn deepest_way(&self, root: &str) -> Outcome<Vec<(&str, u32)>> {
        let (mut address, _) = self.find(root)?;
        let mut known = BTreeMap::new();
        self.descend(
            address,
            &mut vec![address],
            &mut known,
            &mut Reach::default(),
        );
        let mut way = Vec::new();
        while let Some(function) = self.functions.get(&address) {
            way.push((function.name.as_str(), function.stack_bytes));
            let on_the_way = way.len() > self.functions.len();
            let deepest = function.calls.iter().max_by_key(|callee| known.get(callee));
            match deepest {
                Some(callee) if !on_the_way => address = *callee,
                _ => break,
            }
        }
        Ok(way)
    }

    /// The stack from this function down; `way` is what led here.
    fn descend(
        &self,
        address: u32,
        way: &mut Vec<u32>,
        known: &mut BTreeMap<u32, u32>,
        reach: &mut Reach,
    ) -> u32 {
        let Some(function) = self.functions.get(&address) else {
            return 0;
        };
        let on_the_way = |way: &[u32]| way.iter().map(|at| self.name(*at)).collect::<Vec<_>>();
        if is_panic(&function.name) && reach.panic_path.is_none() {
            reach.panic_path = Some(on_the_way(way));
        }
        if function.name.starts_with("__aeabi_") && !is_memory(&function.name) {
            reach.soft_arithmetic.push(function.name.clone());
        }
        for doubt in &function.doubts {
            reach.doubts.push(format!("`{}` {doubt}", function.name));
        }
        let mut deepest = 0;
        for callee in &function.calls {
            let below = match known.get(callee) {
                Some(below) => *below,
                None if way.contains(callee) => {
                    let name = self.name(*callee);
                    reach.doubts.push(format!("`{name}` calls itself"));
                    0
                }
                None => {
                    way.push(*callee);
                    let below = self.descend(*callee, way, known, reach);
                    way.pop();
                    below
                }
            };
            deepest = deepest.max(below);
        }
        let stack_bytes = function.stack_bytes.saturating_add(deepest);
        known.insert(address, stack_bytes);
        stack_bytes
    }

    fn name(&self, address: u32) -> String {
        let function = self.functions.get(&address);
        function.map_or_else(|| format!("{address:#x}"), |function| function.name.clone())
    }
}

/// A section of instructions.
struct Code<'a> {
    begin: u32,
    bytes: &'a [u8],
    /// Where data (true) and instructions (false) begin.
    data: &'a BTreeMap<u32, bool>,
}

impl Code<'_> {
    fn holds(&self, address: u32) -> bool {
        address
            .checked_sub(self.begin)
            .is_some_and(|offset| (offset as usize) < self.bytes.len())
    }

    fn half_word(&self, address: u32) -> Option<u16> {
        let offset = address.checked_sub(self.begin)? as usize;
        let bytes = self.bytes.get(offset..)?.first_chunk()?;
        Some(u16::from_le_bytes(*bytes))
    }

    fn is_data(&self, address: u32) -> bool {
        let last = self.data.range(..=address).next_back();
        last.is_some_and(|(_, is_data)| *is_data)
    }

    fn function(
        &self,
        address: u32,
        name: &str,
        size: u32,
        extents: &BTreeMap<u32, (String, u32)>,
    ) -> Function {
        let mut function = Function {
            name: name.to_owned(),
            size,
            ..Function::default()
        };
        let end = address.saturating_add(size);
        let mut at = address;
        while at < end {
            if self.is_data(at) {
                at += 2;
                continue;
            }
            let Some(first) = self.half_word(at) else {
                break;
            };
            let second = self.half_word(at + 2).unwrap_or(0);
            let (effect, length) = thumb::decode(at, first, second);
            match effect {
                Effect::None => {}
                Effect::GoTo(to) if (address..end).contains(&to) => {}
                Effect::GoTo(to) => match owner(extents, to) {
                    Some(callee) => drop(function.calls.insert(callee)),
                    None => drop(
                        function
                            .doubts
                            .insert(format!("goes to {to:#x}, no function")),
                    ),
                },
                Effect::Indirect => {
                    function
                        .doubts
                        .insert(format!("calls through a register at {at:#x}"));
                }
                Effect::Push(bytes) => function.stack_bytes += bytes,
                Effect::Unknown => {
                    function
                        .doubts
                        .insert(format!("moves the stack by a register at {at:#x}"));
                }
            }
            at += length;
        }
        function
    }
}

/// The function that holds this address.
fn owner(extents: &BTreeMap<u32, (String, u32)>, address: u32) -> Option<u32> {
    let (begin, (_, size)) = extents.range(..=address).next_back()?;
    (address < begin.saturating_add(*size)).then_some(*begin)
}

/// Whether a function is the beginning of a panic: `core`'s own, or where all end.
fn is_panic(name: &str) -> bool {
    const ENDINGS: [&str; 5] = [
        "::unwrap_failed",
        "::expect_failed",
        "_fail",
        "rust_begin_unwind",
        "firmware::panicked",
    ];
    name.starts_with("core::panicking::") || ENDINGS.iter().any(|ending| name.ends_with(ending))
}

fn is_memory(name: &str) -> bool {
    name.starts_with("__aeabi_mem")
}

fn word(value: u64) -> Outcome<u32> {
    u32::try_from(value).map_err(|_| "the image is not one of a 32-bit processor".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn graph(functions: &[(u32, &str, u32, &[u32])]) -> CallGraph {
        let function = |(address, name, stack_bytes, calls): &(u32, &str, u32, &[u32])| {
            let function = Function {
                name: (*name).to_owned(),
                size: 1,
                stack_bytes: *stack_bytes,
                calls: calls.iter().copied().collect(),
                doubts: BTreeSet::new(),
            };
            (*address, function)
        };
        CallGraph {
            functions: functions.iter().map(function).collect(),
        }
    }

    #[test]
    fn prop_a_panic_is_found_with_its_path_and_only_from_where_it_is_reached() {
        let graph = graph(&[
            (1, "control", 8, &[2, 3]),
            (2, "harmless", 100, &[]),
            (3, "step", 24, &[4, 6]),
            (4, "core::panicking::panic_bounds_check", 16, &[]),
            (5, "other", 8, &[2, 6]),
            (6, "__aeabi_dmul", 40, &[]),
        ]);
        let control = graph.reach("control").unwrap();
        let path = ["control", "step", "core::panicking::panic_bounds_check"];
        assert_eq!(control.panic_path.unwrap(), path);
        assert_eq!(control.stack_bytes, 8 + 100);
        assert_eq!(control.soft_arithmetic, ["__aeabi_dmul"]);
        let way = graph.deepest_way("control").unwrap();
        assert_eq!(way, [("control", 8), ("harmless", 100)]);
        let other = graph.reach("other").unwrap();
        assert_eq!((other.panic_path, other.stack_bytes), (None, 108));
        assert!(graph.reach("nobody").is_err());
        assert_eq!(graph.function_at(2), Some((2, "harmless")));
        assert_eq!(graph.function_at(9), None);
    }

    #[test]
    fn prop_recursion_has_no_bound() {
        let graph = graph(&[(1, "a", 8, &[2]), (2, "b", 8, &[1])]);
        assert_eq!(graph.reach("a").unwrap().doubts, ["`a` calls itself"]);
    }

    #[test]
    fn prop_instructions_become_calls_and_stack() {
        // push {r4, lr}; sub sp, #8; bl 0x1010; blx r3; a word of data (the code of
        // `bl 0x1010` from elsewhere); and at 0x1010: bx lr.
        let halves = [
            0xB510, 0xB082, 0xF000, 0xF804, 0x4798, 0xBF00, 0xF000, 0xF804, 0x4770,
        ];
        let bytes: Vec<u8> = halves
            .iter()
            .flat_map(|half: &u16| half.to_le_bytes())
            .collect();
        let code = Code {
            begin: 0x1000,
            bytes: &bytes,
            data: &BTreeMap::from([(0x1000, false), (0x100C, true), (0x1010, false)]),
        };
        let extents = BTreeMap::from([
            (0x1000, ("caller".to_owned(), 16)),
            (0x1010, ("callee".to_owned(), 2)),
        ]);
        let function = code.function(0x1000, "caller", 16, &extents);
        assert_eq!(function.stack_bytes, 16);
        assert_eq!(function.calls, BTreeSet::from([0x1010]));
        assert_eq!(function.doubts.len(), 1);
    }
}
