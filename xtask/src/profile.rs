//! Where the control task's instructions go: QEMU writes down each instruction
//! that it executes, the image's debug information says whose it is.

use crate::call_graph::CallGraph;
use crate::image::{self, MPS2};
use crate::plant::Plant;
use crate::shell::{self, Outcome};
use crate::size::{self, CONTROL, TASKS};
use addr2line::gimli::{Dwarf, EndianSlice, LittleEndian, SectionId};
use object::read::elf::ElfFile32;
use object::{Endianness, Object, ObjectSection};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::path::Path;

/// Ticks written down, each some 100 kB; they begin where the motion does.
const TICKS: u32 = 400;
const FIRST_TICK: u32 = 500;
/// Lines shown.
const SHOWN: usize = 25;
/// What arithmetic itself is written in: its instructions belong to who uses it.
const TRANSPARENT: [&str; 4] = ["core::", "<f32", "<u", "model_core::real::"];

/// The debug information of an image.
type DebugInformation<'a> = addr2line::Context<EndianSlice<'a, LittleEndian>>;

/// Counts of instructions.
#[derive(Debug, Default)]
struct Profile {
    ticks: u64,
    /// By address, within the control task.
    counts: BTreeMap<u32, u64>,
}

/// The option `--where` of the task `size`.
pub fn run() -> Outcome {
    let image = image::build(MPS2)?;
    let log = shell::target_directory()
        .join(MPS2)
        .join("instructions.log");
    let options = ["-singlestep", "-d", "exec,nochain", "-D"].map(str::to_owned);
    let mut options = options.to_vec();
    options.push(log.to_string_lossy().into_owned());
    size::drive(&image, Plant::beginning_at(FIRST_TICK), TICKS, &options)?;
    let bytes = fs::read(&image).map_err(|error| format!("{}: {error}", image.display()))?;
    let profile = read(&log, &CallGraph::read(&bytes)?);
    // Large, and of no use any more; whether or not it could be read.
    drop(fs::remove_file(&log));
    let failure = |reason| format!("{}: {reason}", image.display());
    let debug = debug_information(&bytes).map_err(failure)?;
    print!("{}", table(&profile?, &debug));
    image::BOARDS.into_iter().try_for_each(size::tell_stack)
}

/// Reads the log, in which each line that begins with `Trace` is an instruction.
fn read(log: &Path, graph: &CallGraph) -> Outcome<Profile> {
    let failure = |error| format!("{}: {error}", log.display());
    let mut profile = Profile::default();
    let mut is_control = false;
    let mut last = 0;
    for line in BufReader::new(File::open(log).map_err(failure)?).lines() {
        let line = line.map_err(failure)?;
        let Some(address) = address(&line) else {
            continue;
        };
        // An access to a device is tried, and then executed: written down twice.
        if address == last {
            continue;
        }
        last = address;
        match graph.function_at(address) {
            Some((begin, CONTROL)) => {
                profile.ticks += u64::from(begin == address);
                is_control = true;
            }
            Some((_, name)) if TASKS.iter().any(|(_, symbol)| *symbol == name) => {
                is_control = false;
            }
            _ => {}
        }
        if is_control {
            *profile.counts.entry(address).or_default() += 1;
        }
    }
    if profile.ticks == 0 {
        return Err(format!("{}: no tick of `{CONTROL}` in it", log.display()).into());
    }
    Ok(profile)
}

/// `Trace 0: 0x7f2a30000bc0 [00800408/000000ca/00000110/ff020201] Reset`: the
/// second number in brackets is the address.
fn address(line: &str) -> Option<u32> {
    let line = line.strip_prefix("Trace")?;
    u32::from_str_radix(line.split('/').nth(1)?, 16).ok()
}

fn debug_information(image: &[u8]) -> Result<DebugInformation<'_>, String> {
    let file = ElfFile32::<Endianness>::parse(image).map_err(|error| error.to_string())?;
    // A section that is missing is empty.
    let section = |id: SectionId| {
        let bytes = file
            .section_by_name(id.name())
            .and_then(|one| one.data().ok());
        Ok(EndianSlice::new(bytes.unwrap_or_default(), LittleEndian))
    };
    let context = Dwarf::load(section).and_then(addr2line::Context::from_dwarf);
    context.map_err(|error: addr2line::gimli::Error| error.to_string())
}

fn table(profile: &Profile, debug: &DebugInformation) -> String {
    let mut by_function: BTreeMap<String, u64> = BTreeMap::new();
    for (address, count) in &profile.counts {
        *by_function.entry(function(debug, *address)).or_default() += count;
    }
    let mut rows: Vec<(String, u64)> = by_function.into_iter().collect();
    rows.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let per_tick = |count: u64| count.div_ceil(profile.ticks);
    let total = per_tick(profile.counts.values().sum());
    let mut text = format!(
        "| instructions a tick, mean of {} | function |\n|---:|---|\n| {total} | all of `{CONTROL}` |\n",
        profile.ticks
    );
    for (name, count) in rows.iter().take(SHOWN) {
        text += &format!("| {} | `{name}` |\n", per_tick(*count));
    }
    text
}

/// The innermost function in the sources that is not arithmetic itself.
fn function(debug: &DebugInformation, address: u32) -> String {
    let unknown = || format!("{address:#x}");
    let frames = debug.find_frames(u64::from(address));
    let Ok(mut frames) = frames.skip_all_loads() else {
        return unknown();
    };
    let mut last = None;
    while let Ok(Some(frame)) = frames.next() {
        let name = frame
            .function
            .and_then(|name| Some(name.demangle().ok()?.into_owned()));
        let Some(name) = name else { continue };
        if !TRANSPARENT.iter().any(|begin| name.starts_with(begin)) {
            return name;
        }
        last = Some(name);
    }
    last.unwrap_or_else(unknown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_read_from_the_log() {
        let line = "Trace 0: 0x7f2a30000bc0 [00800408/000000ca/00000110/ff020201] Reset";
        assert_eq!(address(line), Some(0xCA));
        assert_eq!(address("Stopped execution of TB chain"), None);
    }
}
