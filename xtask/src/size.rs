//! What the firmware costs: instructions a tick, flash, memory and stack; that
//! its control task can reach no panic; and whether any of it has grown.
//!
//! Instructions are counted by the firmware itself in QEMU, where each takes a
//! nanosecond of virtual time, while it moves an axis. The stack is a bound from
//! the image's calls, see `call_graph`; beside it stands the most that was used.

use crate::call_graph::{CallGraph, Reach};
use crate::image::{self, MPS2};
use crate::plant::{Link, Plant};
use crate::qemu::{Machine, checked_settings, with_settings};
use crate::shell::{self, Outcome};
use firmware::cost::Report;
use firmware::link;
use object::LittleEndian;
use object::elf::{SHF_ALLOC, SHF_WRITE, SHT_NOBITS};
use object::read::elf::{ElfFile32, FileHeader, SectionHeader};
use serde_json::{Map, Value};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// What is compared with, from the root of the repository.
const SNAPSHOT: &str = "xtask/snapshots/size.json";
/// Growth that passes, in percent.
const GROWTH_PERCENT: u64 = 5;
/// One round of the plant's motion.
const TICKS: u32 = 8000;
/// The control task's interrupt.
pub const CONTROL: &str = "DMA2_STREAM0";
/// The application's tasks by priority, each a symbol of the image; the last is
/// what runs before and below all interrupts.
pub const TASKS: [(&str, &str); 5] = [
    ("control", CONTROL),
    ("receive", "USART1"),
    ("supervise", "TIM7"),
    ("transmit", "UART5"),
    ("start and idle", "main"),
];
/// The start within `main`: RTIC masks interrupts before it and lets them come at
/// its end. What is idle afterwards holds nothing.
const START: &str = "firmware::app::main::__rtic_init_resources";
/// What the processor itself pushes at an interrupt: 26 words, with those of the
/// floating point unit, and one for alignment (DDI 0403, B1.5.7).
const EXCEPTION_FRAME_BYTES: u32 = 27 * 4;

/// One figure of a board, what it should stay under, and whether it was measured
/// once and is not compared.
#[derive(Debug, PartialEq)]
struct Figure {
    name: String,
    value: u64,
    goal: Option<u64>,
}

impl Figure {
    fn new(board: &str, name: &str, value: impl Into<u64>, goal: Option<u64>) -> Self {
        Self {
            name: format!("{board}.{name}"),
            value: value.into(),
            goal,
        }
    }
}

/// Instructions a tick, flash and memory that the design allows itself.
const GOAL_INSTRUCTIONS: u64 = 6000;
const GOAL_FLASH_BYTES: u64 = 96 * 1024;
const GOAL_MEMORY_BYTES: u64 = 24 * 1024;

/// A function that pushes less is not worth a line.
const SHOWN_STACK_BYTES: u32 = 64;

/// The task `size`.
pub fn run(options: &[String]) -> Outcome {
    let is_blessed = match options {
        [] => false,
        [option] if option == "--bless" => true,
        other => return Err(format!("size: unknown option {}", other.join(" ")).into()),
    };
    let mut figures = Vec::new();
    for board in image::BOARDS {
        let image = image::build(board)?;
        figures.extend(weigh(board, &image)?);
        if board == MPS2 {
            figures.extend(count(&image)?);
        }
    }
    let path = shell::root().join(SNAPSHOT);
    let blessed = if is_blessed {
        Map::new()
    } else {
        read_snapshot(&path)?
    };
    print!("{}", table(&figures, &blessed));
    if is_blessed {
        return write_snapshot(&path, &figures);
    }
    compare(&figures, &blessed)
}

/// Flash, memory, stack; fails where the control task can panic or has no bound.
fn weigh(board: &str, path: &Path) -> Outcome<Vec<Figure>> {
    let image = fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let size = measure(&image).map_err(|error| format!("{}: {error}", path.display()))?;
    let graph = CallGraph::read(&image)?;
    let reaches = TASKS
        .iter()
        .map(|(task, symbol)| Ok((*task, graph.reach(symbol)?)));
    let reaches: Vec<(&str, Reach)> = reaches.collect::<Outcome<_>>()?;
    for (task, reach) in &reaches {
        judge(board, task, reach)?;
    }
    let stack_bytes = deepest(&graph, &reaches)?;
    let control_stack_bytes = reaches.first().map_or(0, |(_, reach)| reach.stack_bytes);
    Ok(vec![
        Figure::new(board, "flash_bytes", size.flash, Some(GOAL_FLASH_BYTES)),
        Figure::new(board, "static_memory_bytes", size.memory, None),
        Figure::new(
            board,
            "control_stack_bytes_at_most",
            control_stack_bytes,
            None,
        ),
        Figure::new(board, "stack_bytes_at_most", stack_bytes, None),
        Figure::new(
            board,
            "memory_and_stack_bytes_at_most",
            size.memory + u64::from(stack_bytes),
            Some(GOAL_MEMORY_BYTES),
        ),
    ])
}

/// Whose the stack is: the deepest calls of each task.
pub fn tell_stack(board: &str) -> Outcome {
    let path = image::build(board)?;
    let image = fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let graph = CallGraph::read(&image)?;
    for (task, symbol) in TASKS {
        let way = graph.deepest_way(symbol)?;
        let bytes: u32 = way.iter().map(|(_, bytes)| bytes).sum();
        println!("\n{board}: {bytes} bytes of stack at most in {task}, by these calls:");
        for (name, bytes) in way.iter().filter(|(_, bytes)| *bytes >= SHOWN_STACK_BYTES) {
            println!("{bytes:>6}  {name}");
        }
    }
    Ok(())
}

/// All tasks above what is below them, or the start alone: interrupts are masked
/// until it ends, and then only its own frame may still be there.
fn deepest(graph: &CallGraph, reaches: &[(&str, Reach)]) -> Outcome<u32> {
    let Some(((_, start), tasks)) = reaches.split_last() else {
        return Ok(0);
    };
    let held = graph.own_stack_bytes("main")? + graph.own_stack_bytes(START)?;
    let above = tasks
        .iter()
        .map(|(_, reach)| reach.stack_bytes + EXCEPTION_FRAME_BYTES)
        .sum::<u32>();
    Ok(start.stack_bytes.max(held + above))
}

/// No task may have a stack without bound, and control may neither panic nor
/// reckon in arithmetic that the processor has no instructions for.
fn judge(board: &str, task: &str, reach: &Reach) -> Outcome {
    if !reach.doubts.is_empty() {
        let doubts = reach.doubts.join("\n  ");
        return Err(format!("{board}: no bound for the stack of task {task}:\n  {doubts}").into());
    }
    if task != TASKS[0].0 {
        return Ok(());
    }
    if let Some(path) = &reach.panic_path {
        let path = path.join("\n  calls ");
        return Err(format!("{board}: task {task} can panic:\n  {path}").into());
    }
    if !reach.soft_arithmetic.is_empty() {
        let names = reach.soft_arithmetic.join(", ");
        println!("{board}: task {task} reaches soft arithmetic: {names}");
    }
    println!("{board}: task {task} can reach no panic");
    Ok(())
}

/// Instructions a tick, counted over one round of motion.
fn count(image: &Path) -> Outcome<Vec<Figure>> {
    let report = drive(image, Plant::default(), TICKS, &[])?;
    let instructions = |counts: u64| counts * 1_000_000_000 / u64::from(report.counts_per_s);
    let cost = &report.cost;
    let mean = instructions(cost.total_counts) / u64::from(cost.ticks.max(1));
    let worst = instructions(u64::from(cost.worst_counts));
    println!(
        "{MPS2}: {} ticks counted, to {} instructions; stack used {} bytes",
        cost.ticks,
        instructions(1),
        report.stack_bytes
    );
    Ok(vec![
        Figure::new(MPS2, "instructions_mean", mean, None),
        Figure::new(MPS2, "instructions_worst", worst, Some(GOAL_INSTRUCTIONS)),
    ])
}

/// Runs the image against the plant; `options` go to QEMU as they are.
pub fn drive(image: &Path, mut plant: Plant, ticks: u32, options: &[String]) -> Outcome<Report> {
    let checked = with_settings(&checked_settings()?);
    let machine = Machine::start(image, &[&checked, options].concat())?;
    let mut link = Link::connect(&machine)?;
    for _ in 0..ticks {
        let answer = link.exchange(&plant.sample())?;
        let command = link::read_command(&answer).ok_or("the controller's answer is none")?;
        plant.apply(&command);
    }
    let report = link.end()?;
    let status = machine.wait(Duration::from_secs(10))?;
    if status.success() {
        return Ok(report);
    }
    Err(format!("the firmware ended with {status}").into())
}

/// Bytes of an image.
#[derive(Debug, Default, PartialEq)]
struct Size {
    /// Code, constants and the start values of variables.
    flash: u64,
    /// Variables; the stack is not in the image.
    memory: u64,
}

/// Sums the sections of an image. Start values of variables count twice.
fn measure(image: &[u8]) -> Outcome<Size> {
    let no_image = |error| format!("no 32-bit ELF image: {error}");
    let file = ElfFile32::<LittleEndian>::parse(image).map_err(no_image)?;
    let header = file.elf_header();
    let sections = header
        .section_headers(LittleEndian, image)
        .map_err(no_image)?;
    let mut size = Size::default();
    for section in sections {
        let flags = section.sh_flags(LittleEndian);
        let bytes = u64::from(section.sh_size(LittleEndian));
        if flags.0 & SHF_ALLOC.0 == 0 {
            continue;
        }
        if section.sh_type(LittleEndian) != SHT_NOBITS {
            size.flash += bytes;
        }
        if flags.0 & SHF_WRITE.0 != 0 {
            size.memory += bytes;
        }
    }
    Ok(size)
}

fn read_snapshot(path: &PathBuf) -> Outcome<Map<String, Value>> {
    let text = fs::read_to_string(path).map_err(|error| {
        format!("{SNAPSHOT}: {error}\n`cargo xtask size --bless` writes it from this image")
    })?;
    serde_json::from_str(&text).map_err(|error| format!("{SNAPSHOT}: {error}").into())
}

fn write_snapshot(path: &Path, figures: &[Figure]) -> Outcome {
    let values = figures.iter();
    let values = values.map(|figure| (figure.name.clone(), figure.value.into()));
    let text = format!("{:#}\n", Value::Object(values.collect()));
    let parent = path.parent().unwrap_or(path);
    let written = fs::create_dir_all(parent).and_then(|()| fs::write(path, text));
    written.map_err(|error| format!("{SNAPSHOT}: {error}"))?;
    println!("written: {SNAPSHOT}");
    Ok(())
}

fn table(figures: &[Figure], blessed: &Map<String, Value>) -> String {
    let mut text = "| figure | now | blessed | goal |\n|---|---:|---:|---:|\n".to_owned();
    let shown = |value: Option<u64>| value.map_or("-".to_owned(), |value| value.to_string());
    for figure in figures {
        let before = blessed.get(&figure.name).and_then(Value::as_u64);
        let goal = match figure.goal {
            Some(goal) if figure.value > goal => format!("{goal}, NOT MET"),
            goal => shown(goal),
        };
        let (name, value, before) = (&figure.name, figure.value, shown(before));
        text += &format!("| {name} | {value} | {before} | {goal} |\n");
    }
    text
}

/// Fails where a figure has grown, is new, or is gone.
fn compare(figures: &[Figure], blessed: &Map<String, Value>) -> Outcome {
    let mut findings = Vec::new();
    for figure in figures {
        let (name, value) = (&figure.name, figure.value);
        match blessed.get(name).and_then(Value::as_u64) {
            None => findings.push(format!("{name} is not in the snapshot")),
            Some(before) if value * 100 > before * (100 + GROWTH_PERCENT) => {
                findings.push(format!("{name} has grown from {before} to {value}"));
            }
            Some(_) => {}
        }
    }
    for name in blessed.keys() {
        if figures.iter().all(|figure| figure.name != *name) {
            findings.push(format!("{name} is in the snapshot alone"));
        }
    }
    if findings.is_empty() {
        return Ok(());
    }
    Err(format!(
        "{}\n(more than {GROWTH_PERCENT} % counts as growth; if it is meant: `cargo xtask size --bless`)",
        findings.join("\n")
    )
    .into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use object::elf::{SHT_PROGBITS, SHT_STRTAB, SectionFlags, SectionType};

    /// An ELF header and section headers with these kinds, flags and sizes.
    fn image(sections: &[(SectionType, SectionFlags, u32)]) -> Vec<u8> {
        let mut image = vec![0; 52];
        image[..7].copy_from_slice(b"\x7fELF\x01\x01\x01");
        image[16] = 2; // Executable.
        image[20] = 1; // Version.
        image[32] = 52; // The section headers follow this one.
        image[40] = 52;
        image[46] = 40;
        image[48] = u8::try_from(sections.len() + 2).unwrap();
        image[50] = 1; // The second one holds names: here none, the header's first byte.
        image.extend([0; 40]); // The first one is empty by definition.
        let names = (SHT_STRTAB, SectionFlags(0), 1);
        for (kind, flags, bytes) in std::iter::once(&names).chain(sections) {
            let mut header = [0; 40];
            header[4..8].copy_from_slice(&kind.0.to_le_bytes());
            header[8..12].copy_from_slice(&flags.0.to_le_bytes()[..4]);
            header[20..24].copy_from_slice(&bytes.to_le_bytes());
            image.extend(header);
        }
        image
    }

    #[test]
    fn start_values_count_twice_and_debug_information_not_at_all() {
        let text = (SHT_PROGBITS, SHF_ALLOC, 5000);
        let start_values = (SHT_PROGBITS, SHF_ALLOC | SHF_WRITE, 40);
        let zeroed = (SHT_NOBITS, SHF_ALLOC | SHF_WRITE, 600);
        let debug = (SHT_PROGBITS, SectionFlags(0), 99_999);
        let size = measure(&image(&[text, start_values, zeroed, debug])).unwrap();
        assert_eq!(
            size,
            Size {
                flash: 5040,
                memory: 640
            }
        );
    }

    #[test]
    fn other_files_are_refused() {
        assert!(measure(b"no image").is_err());
        assert!(measure(&[0; 100]).is_err());
    }

    #[test]
    fn growth_and_strange_names_are_found() {
        let figures = [Figure::new("b", "x", 105_u64, None)];
        let blessed = |name: &str, value: u64| Map::from_iter([(name.to_owned(), value.into())]);
        assert!(compare(&figures, &blessed("b.x", 100)).is_ok());
        let failure = compare(&figures, &blessed("b.x", 99))
            .unwrap_err()
            .to_string();
        assert!(
            failure.starts_with("b.x has grown from 99 to 105"),
            "{failure}"
        );
        let failure = compare(&figures, &blessed("b.y", 9))
            .unwrap_err()
            .to_string();
        assert!(
            failure.contains("b.x is not in") && failure.contains("b.y is in"),
            "{failure}"
        );
    }

    #[test]
    fn only_control_must_not_panic_and_all_need_a_bound() {
        let panics = Reach {
            panic_path: Some(vec!["a".to_owned(), "b".to_owned()]),
            ..Reach::default()
        };
        let failure = judge("b", "control", &panics).unwrap_err().to_string();
        assert_eq!(failure, "b: task control can panic:\n  a\n  calls b");
        assert!(judge("b", "receive", &panics).is_ok());
        let doubtful = Reach {
            doubts: vec!["`a` calls itself".to_owned()],
            ..Reach::default()
        };
        assert!(judge("b", "receive", &doubtful).is_err());
    }
}
