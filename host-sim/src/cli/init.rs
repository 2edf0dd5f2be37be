//! `pneuma init`: a first rig file from a data sheet, by questions or by flags.

use std::fmt::Display;
use std::io::{self, BufRead, IsTerminal, Write};
use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;

use super::CommandError;
use super::inputs::bad_input;
use super::outputs::{check_outputs, write_text};
use crate::check::Check;
use crate::init::{
    Columns, DataSheet, Guess, PositionSensor, SignalLine, TYPICAL_B, measured, nominal_flow_of,
    of_a_board, valve_by_type, valve_types,
};
use crate::rig::{Rig, STANDARD_PRESSURE_PA};

/// Make a first rig file from the data sheet of an axis.
///
/// Asks on a terminal for what the flags do not say; elsewhere it lists the flags that are
/// missing. Values that no data sheet states are typical ones, marked so, with wide deviations.
#[derive(Args, Clone, Debug, Default)]
pub struct InitArguments {
    /// Bore of the cylinder, mm.
    #[arg(long, value_name = "MM")]
    pub bore_mm: Option<f64>,
    /// Diameter of the rod, on the side of chamber B, mm; 0 for a rodless cylinder.
    #[arg(long, value_name = "MM")]
    pub rod_mm: Option<f64>,
    /// Stroke, mm.
    #[arg(long, value_name = "MM")]
    pub stroke_mm: Option<f64>,
    /// Moving mass: piston, carriage and load, kg.
    #[arg(long, value_name = "KG")]
    pub mass_kg: Option<f64>,
    /// Angle by which +x points above the horizontal, degrees.
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pub inclination_deg: f64,
    /// Type of the valve, such as MPYE-5-1/8-HF-010B.
    #[arg(long, value_name = "TYPE", group = "flow")]
    pub valve: Option<String>,
    /// Standard nominal flow of the valve from 6 to 5 bar, l/min.
    #[arg(long, value_name = "L_MIN", group = "flow")]
    pub nominal_flow_l_min: Option<f64>,
    /// Sonic conductance C of the valve, l/(s bar).
    #[arg(long, value_name = "L_S_BAR", group = "flow")]
    pub conductance_l_s_bar: Option<f64>,
    /// Critical pressure ratio b of the valve; typical 0.3 without it.
    #[arg(long)]
    pub b: Option<f64>,
    /// Command at which the valve is closed, V.
    #[arg(
        long,
        value_name = "V",
        default_value_t = 5.0,
        allow_negative_numbers = true
    )]
    pub null_v: f64,
    /// Opening from there at which it is fully open, V: half of the command range.
    #[arg(long, value_name = "V", default_value_t = 5.0)]
    pub full_opening_v: f64,
    /// Supply pressure, bar gauge.
    #[arg(long, value_name = "BAR", group = "supply")]
    pub supply_bar_gauge: Option<f64>,
    /// Supply pressure, bar absolute.
    #[arg(long, value_name = "BAR", group = "supply")]
    pub supply_bar_absolute: Option<f64>,
    /// Ambient pressure, hPa.
    #[arg(long, value_name = "HPA", default_value_t = STANDARD_PRESSURE_PA / 100.0)]
    pub ambient_hpa: f64,
    /// Ambient temperature, degC.
    #[arg(
        long,
        value_name = "DEGC",
        default_value_t = 20.0,
        allow_negative_numbers = true
    )]
    pub temperature_c: f64,
    /// Length of each tube between valve and cylinder, m; its volume is counted.
    #[arg(long, value_name = "M", default_value_t = 0.0)]
    pub tube_m: f64,
    /// Inner diameter of the tubes, mm.
    #[arg(long, value_name = "MM", default_value_t = 4.0)]
    pub tube_bore_mm: f64,
    /// Noise of the position sensor, um; measured in the recording without it.
    #[arg(long, value_name = "UM")]
    pub position_noise_um: Option<f64>,
    /// Resolution of the position sensor, um; measured in the recording without it.
    #[arg(long, value_name = "UM")]
    pub position_resolution_um: Option<f64>,
    /// A recording: its columns are guessed from their names and values.
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// The axis has a controller board, which records it (`pneuma board run`, `pneuma commission`).
    #[arg(long, conflicts_with_all = ["csv", "column"])]
    pub board: bool,
    /// The column of a signal, in place of the guess; `SIGNAL=` leaves the signal out.
    #[arg(long, value_name = "SIGNAL=HEADER:UNIT")]
    pub column: Vec<String>,
    /// Take the guessed columns as they are.
    #[arg(long)]
    pub yes: bool,
    /// Write the rig file here.
    #[arg(long)]
    pub out: PathBuf,
    /// Replace a file that is there already.
    #[arg(long)]
    pub force: bool,
}

/// Runs the command.
///
/// # Errors
/// If a value is missing or cannot be used, a guess is not confirmed, or the file is there already.
pub fn run(arguments: &InitArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    check_outputs(&arguments.csv.iter().collect::<Vec<_>>(), &[&arguments.out])?;
    if arguments.out.exists() && !arguments.force {
        return Err(bad_input(format!(
            "{}: is there already, expected another --out, or --force to replace it",
            arguments.out.display()
        )));
    }
    let asks = io::stdin().is_terminal();
    let completed = if asks {
        ask_missing(arguments.clone(), out)?
    } else {
        arguments.clone()
    };
    let mut sheet = data_sheet(&completed)?;
    let signals = match &completed.csv {
        Some(_) => signals(&completed, &mut sheet, asks, out)?,
        None if completed.board => of_a_board(position_sensor(&completed)),
        None => Vec::new(),
    };
    let text = sheet.rig_file(&signals);
    let name = completed.out.display().to_string();
    let (rig, faults) = Rig::faults(&text, &name);
    if let Some(fault) = faults.first() {
        return Err(bad_input(format!("the answers make no rig: {fault}")));
    }
    write_text(&completed.out, &text)?;
    summarise(&name, &rig, &completed, out)
}

fn summarise(
    name: &str,
    rig: &Rig,
    arguments: &InitArguments,
    out: &mut dyn Write,
) -> Result<(), CommandError> {
    writeln!(
        out,
        "{name} written; typical values are marked as typical, measure them where you can"
    )?;
    if arguments.board {
        let next = "pneuma doctor, then pneuma commission";
        writeln!(
            out,
            "next: {next} --rig {name} --serial PORT --folder FOLDER, which measures them with the board"
        )?;
        return Ok(());
    }
    if arguments.csv.is_none() {
        writeln!(out, "next: name the columns of a recording under [signals]")?;
        return Ok(());
    }
    for law in Check::of_rig(name, rig, &[]).laws {
        for lack in &law.lacks {
            writeln!(
                out,
                "note: the law of the {} is not run, it lacks {lack}",
                law.law
            )?;
        }
    }
    writeln!(
        out,
        "next: pneuma check --rig {name} RECORDING, then pneuma identify valve-flow --rig {name} RECORDING... --improved-rig measured.toml"
    )?;
    Ok(())
}

// the data sheet

fn data_sheet(arguments: &InitArguments) -> Result<DataSheet, CommandError> {
    let missing = missing(arguments);
    if !missing.is_empty() {
        return Err(bad_input(format!("missing {}", missing.join(", "))));
    }
    let b = (arguments.b.unwrap_or(TYPICAL_B), arguments.b.is_none());
    if !(0.0..1.0).contains(&b.0) || b.0 <= 0.0 {
        return Err(bad_input(format!(
            "--b: is {}, expected a ratio above 0 and below 1",
            b.0
        )));
    }
    let (valve, nominal_flow_l_min) = flow(arguments, b.0)?;
    let ambient_pa = 100.0 * arguments.ambient_hpa;
    let supply_pa = supply(arguments, ambient_pa);
    let millimetres = |value: Option<f64>| 1e-3 * value.unwrap_or_default();
    Ok(DataSheet {
        bore_m: millimetres(arguments.bore_mm),
        rod_m: millimetres(arguments.rod_mm),
        stroke_m: millimetres(arguments.stroke_mm),
        mass_kg: arguments.mass_kg.unwrap_or_default(),
        inclination_deg: arguments.inclination_deg,
        valve,
        nominal_flow_l_min,
        critical_pressure_ratio: b,
        null_v: arguments.null_v,
        full_opening_v: arguments.full_opening_v,
        supply_pa,
        ambient_pa,
        temperature_k: arguments.temperature_c + 273.15,
        tube_m: (arguments.tube_m, 1e-3 * arguments.tube_bore_mm),
        feeds_a_above_null: (true, "assumed: a small command above the null moves to +x"),
        zero_is_mid_stroke: (true, "assumed"),
    })
}

/// The flags that neither were given nor have a usual value.
fn missing(arguments: &InitArguments) -> Vec<&'static str> {
    let valve = arguments.valve.is_some()
        || arguments.nominal_flow_l_min.is_some()
        || arguments.conductance_l_s_bar.is_some();
    let supply = arguments.supply_bar_gauge.or(arguments.supply_bar_absolute);
    [
        (arguments.bore_mm.is_some(), "--bore-mm"),
        (
            arguments.rod_mm.is_some(),
            "--rod-mm (0 for a rodless cylinder)",
        ),
        (arguments.stroke_mm.is_some(), "--stroke-mm"),
        (arguments.mass_kg.is_some(), "--mass-kg"),
        (
            valve,
            "--valve TYPE or --nominal-flow-l-min or --conductance-l-s-bar",
        ),
        (
            supply.is_some(),
            "--supply-bar-gauge or --supply-bar-absolute",
        ),
    ]
    .into_iter()
    .filter_map(|(given, flag)| (!given).then_some(flag))
    .collect()
}

fn flow(arguments: &InitArguments, b: f64) -> Result<(String, f64), CommandError> {
    if let Some(name) = &arguments.valve {
        let Some((name, flow_l_min)) = valve_by_type(name) else {
            return Err(bad_input(format!(
                "--valve {name}: is not listed, expected one of {} or --nominal-flow-l-min of its data sheet",
                valve_types().join(", ")
            )));
        };
        let told = format!("{name}, nominal flow from memory of the catalogue, not checked");
        return Ok((told, flow_l_min));
    }
    if let Some(conductance) = arguments.conductance_l_s_bar {
        let told = format!("valve with C = {conductance} l/(s bar)");
        return Ok((told, nominal_flow_of(conductance, b)));
    }
    Ok((
        "valve by its nominal flow".into(),
        arguments.nominal_flow_l_min.unwrap_or_default(),
    ))
}

fn supply(arguments: &InitArguments, ambient_pa: f64) -> (f64, String) {
    match (arguments.supply_bar_gauge, arguments.supply_bar_absolute) {
        (Some(gauge), _) => (1e5 * gauge + ambient_pa, format!("{gauge} bar gauge")),
        (None, absolute) => {
            let absolute = absolute.unwrap_or_default();
            (1e5 * absolute, format!("{absolute} bar absolute"))
        }
    }
}

// the columns

fn signals(
    arguments: &InitArguments,
    sheet: &mut DataSheet,
    asks: bool,
    out: &mut dyn Write,
) -> Result<Vec<SignalLine>, CommandError> {
    let Some(path) = &arguments.csv else {
        return Ok(Vec::new());
    };
    let mut columns = Columns::of(path, sheet).map_err(bad_input)?;
    let named = arguments
        .column
        .iter()
        .map(|text| named_column(text, columns.names()));
    let named = named.collect::<Result<Vec<_>, _>>()?;
    for (signal, guess) in named {
        columns.guesses.retain(|other| other.signal != signal);
        columns.guesses.extend(guess);
    }
    for guess in &columns.guesses {
        writeln!(
            out,
            "{} is column \"{}\" in {}: {}",
            guess.signal, guess.column, guess.unit, guess.why
        )?;
    }
    confirm(arguments, &mut columns, asks, out)?;
    columns.complete(sheet);
    let sensor = position_sensor(arguments);
    measured(path, &columns.guesses, sensor).map_err(bad_input)
}

fn position_sensor(arguments: &InitArguments) -> PositionSensor {
    let metres = |micrometres: Option<f64>| micrometres.map(|value| 1e-6 * value);
    PositionSensor {
        noise_m: metres(arguments.position_noise_um),
        resolution_m: metres(arguments.position_resolution_um),
    }
}

/// `SIGNAL=HEADER:UNIT`; `SIGNAL=` for a signal that is not recorded.
fn named_column(text: &str, names: &[String]) -> Result<(String, Option<Guess>), CommandError> {
    let wrong = |problem: &str| {
        bad_input(format!(
            "--column {text}: {problem}, expected SIGNAL=HEADER:UNIT such as x=\"Position\":mm"
        ))
    };
    let (signal, column) = text
        .split_once('=')
        .ok_or_else(|| wrong("names no signal"))?;
    if column.is_empty() {
        return Ok((signal.into(), None));
    }
    let (column, unit) = column
        .rsplit_once(':')
        .ok_or_else(|| wrong("states no unit"))?;
    if !names.iter().any(|name| name == column) {
        return Err(wrong(&format!(
            "no column is called \"{column}\" among {}",
            names.join(", ")
        )));
    }
    let guess = Guess {
        signal: signal.into(),
        column: column.into(),
        unit: unit.into(),
        why: "as stated".into(),
    };
    Ok((signal.into(), Some(guess)))
}

fn confirm(
    arguments: &InitArguments,
    columns: &mut Columns,
    asks: bool,
    out: &mut dyn Write,
) -> Result<(), CommandError> {
    if arguments.yes || columns.guesses.iter().all(|guess| guess.why == "as stated") {
        return Ok(());
    }
    if !asks {
        out.flush()?;
        return Err(bad_input(
            "the columns above are guesses, expected --yes to take them, or --column SIGNAL=HEADER:UNIT for those that are wrong",
        ));
    }
    loop {
        let answer: String = ask(
            out,
            "Right? Enter for yes, or SIGNAL=HEADER:UNIT to change one",
            Some(String::new()),
        )?;
        if answer.is_empty() || answer == "y" || answer == "yes" {
            return Ok(());
        }
        match named_column(&answer, columns.names()) {
            Ok((signal, guess)) => {
                columns.guesses.retain(|other| other.signal != signal);
                columns.guesses.extend(guess);
            }
            Err(error) => writeln!(out, "{error}")?,
        }
    }
}

// questions

/// Asks for what the flags do not say.
fn ask_missing(
    mut arguments: InitArguments,
    out: &mut dyn Write,
) -> Result<InitArguments, CommandError> {
    let number =
        |out: &mut dyn Write, known: Option<f64>, question: &str, usual: Option<f64>| match known {
            Some(value) => Ok(Some(value)),
            None => ask(out, question, usual).map(Some),
        };
    arguments.bore_mm = number(out, arguments.bore_mm, "Bore in mm", None)?;
    arguments.rod_mm = number(
        out,
        arguments.rod_mm,
        "Rod diameter in mm, 0 for rodless",
        Some(0.0),
    )?;
    arguments.stroke_mm = number(out, arguments.stroke_mm, "Stroke in mm", None)?;
    arguments.mass_kg = number(out, arguments.mass_kg, "Moving mass in kg", None)?;
    ask_valve(&mut arguments, out)?;
    if arguments
        .supply_bar_gauge
        .or(arguments.supply_bar_absolute)
        .is_none()
    {
        let pressure: f64 = ask(out, "Supply pressure in bar", None)?;
        let reference: String = ask(out, "Is that gauge or absolute", Some("gauge".into()))?;
        if reference.starts_with('a') {
            arguments.supply_bar_absolute = Some(pressure);
        } else {
            arguments.supply_bar_gauge = Some(pressure);
        }
    }
    if arguments.csv.is_none() && !arguments.board {
        let path: String = ask(
            out,
            "A recording (CSV), Enter for none",
            Some(String::new()),
        )?;
        arguments.csv = (!path.is_empty()).then(|| path.into());
    }
    Ok(arguments)
}

fn ask_valve(arguments: &mut InitArguments, out: &mut dyn Write) -> Result<(), CommandError> {
    let known = arguments
        .nominal_flow_l_min
        .or(arguments.conductance_l_s_bar);
    if arguments.valve.is_some() || known.is_some() {
        return Ok(());
    }
    writeln!(out, "Listed valves: {}", valve_types().join(", "))?;
    let valve: String = ask(
        out,
        "Valve type, or its nominal flow (6 to 5 bar) in l/min",
        None,
    )?;
    match valve.parse() {
        Ok(flow_l_min) => arguments.nominal_flow_l_min = Some(flow_l_min),
        Err(_) => arguments.valve = Some(valve),
    }
    Ok(())
}

/// Asks until the answer can be read; Enter takes the usual value.
fn ask<T: FromStr + Display>(
    out: &mut dyn Write,
    question: &str,
    usual: Option<T>,
) -> Result<T, CommandError> {
    let shown = usual
        .as_ref()
        .map(ToString::to_string)
        .filter(|usual| !usual.is_empty());
    let shown = shown.map_or_else(String::new, |usual| format!(" [{usual}]"));
    loop {
        write!(out, "{question}{shown}: ")?;
        out.flush()?;
        let mut answer = String::new();
        if io::stdin().lock().read_line(&mut answer)? == 0 {
            return Err(bad_input("the questions were not answered to the end"));
        }
        let answer = answer.trim();
        if answer.is_empty() {
            if let Some(usual) = usual {
                return Ok(usual);
            }
        } else if let Ok(value) = answer.parse() {
            return Ok(value);
        }
        writeln!(out, "\"{answer}\" is no answer to that")?;
    }
}
