//! `modelDescription.xml`: FMI 2.0.5, section 2.2, and FMI 3.0.2, section 2.4.

use super::kind::Kind;
use super::variables::{Causality, Type, Variable};
use super::{LIBRARY, TICK_S};
use crate::hash;
use crate::rig::Rig;
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, Event};
use std::collections::BTreeSet;
use std::io;

/// The version of the standard that an archive follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standard {
    /// FMI 2.0.
    Two,
    /// FMI 3.0.
    Three,
}

type Xml = Writer<Vec<u8>>;
type Attribute<'a> = (&'a str, &'a str);

/// What an archive and its library recognise each other by: kind, rig and version in one number.
pub fn token(kind: Kind, rig: &Rig) -> String {
    let digest = hash::of_texts(&[kind.name(), &rig.to_toml(), env!("CARGO_PKG_VERSION")]);
    let part = |range: std::ops::Range<usize>| digest.get(range).unwrap_or_default();
    let (a, b, c, d, e) = (
        part(0..8),
        part(8..12),
        part(12..16),
        part(16..20),
        part(20..32),
    );
    format!("{{{a}-{b}-{c}-{d}-{e}}}")
}

/// The description of a unit.
///
/// # Errors
/// None: it is written into memory.
pub fn model_description(
    standard: Standard,
    (kind, token): (Kind, &str),
    variables: &[Variable],
) -> io::Result<String> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let name = format!("pneuma {}", kind.name());
    let version = if standard == Standard::Two {
        "2.0"
    } else {
        "3.0"
    };
    let token_name = if standard == Standard::Two {
        "guid"
    } else {
        "instantiationToken"
    };
    let tool = concat!("pneuma ", env!("CARGO_PKG_VERSION"));
    let what = match kind {
        Kind::Plant => "A servo-pneumatic axis behind the converters of its board",
        Kind::Controller => "The control task of the board, tick by tick",
        Kind::Observer => "What the board's observer believes of an axis",
    };
    let root = xml.create_element("fmiModelDescription").with_attributes([
        ("fmiVersion", version),
        ("modelName", name.as_str()),
        (token_name, token),
        ("description", what),
        ("generationTool", tool),
        ("variableNamingConvention", "flat"),
    ]);
    root.write_inner_content(|xml| {
        co_simulation(xml, standard)?;
        units(xml, variables)?;
        let categories = [("name", "error"), ("description", "why a call failed")];
        within(xml, "LogCategories", |xml| {
            empty(xml, "Category", &categories)
        })?;
        let tick = number(TICK_S);
        let experiment = [
            ("startTime", "0"),
            ("stopTime", "1"),
            ("stepSize", tick.as_str()),
        ];
        empty(xml, "DefaultExperiment", &experiment)?;
        within(xml, "ModelVariables", |xml| match standard {
            Standard::Two => variables_2(xml, variables),
            Standard::Three => variables_3(xml, variables),
        })?;
        within(xml, "ModelStructure", |xml| {
            structure(xml, standard, variables)
        })
    })?;
    Ok(String::from_utf8_lossy(&xml.into_inner()).into_owned() + "\n")
}

fn within(
    xml: &mut Xml,
    name: &str,
    content: impl FnOnce(&mut Xml) -> io::Result<()>,
) -> io::Result<()> {
    xml.create_element(name).write_inner_content(content)?;
    Ok(())
}

fn empty(xml: &mut Xml, name: &str, attributes: &[Attribute<'_>]) -> io::Result<()> {
    let element = xml.create_element(name);
    element
        .with_attributes(attributes.iter().copied())
        .write_empty()?;
    Ok(())
}

/// A number that reads back to the bit.
fn number(value: f64) -> String {
    format!("{value:?}")
}

fn co_simulation(xml: &mut Xml, standard: Standard) -> io::Result<()> {
    let tick = number(TICK_S);
    let state = match standard {
        Standard::Two => ("canGetAndSetFMUstate", "true"),
        Standard::Three => ("canGetAndSetFMUState", "true"),
    };
    let mut attributes = vec![
        ("modelIdentifier", LIBRARY),
        state,
        ("canHandleVariableCommunicationStepSize", "false"),
    ];
    match standard {
        Standard::Two => attributes.push(("canNotUseMemoryManagementFunctions", "true")),
        Standard::Three => attributes.push(("fixedInternalStepSize", &tick)),
    }
    empty(xml, "CoSimulation", &attributes)
}

/// Exponents of kg, m, s, A and K.
fn base_unit(unit: &str) -> Option<[i32; 5]> {
    Some(match unit {
        "m" => [0, 1, 0, 0, 0],
        "m2" => [0, 2, 0, 0, 0],
        "m3" => [0, 3, 0, 0, 0],
        "s" => [0, 0, 1, 0, 0],
        "1/s" | "Hz" => [0, 0, -1, 0, 0],
        "m/s" => [0, 1, -1, 0, 0],
        "m/s2" => [0, 1, -2, 0, 0],
        "kg" => [1, 0, 0, 0, 0],
        "N" => [1, 1, -2, 0, 0],
        "N/m" => [1, 0, -2, 0, 0],
        "N s/m" => [1, 0, -1, 0, 0],
        "Pa" | "Pa(abs)" => [1, -1, -2, 0, 0],
        "N/Pa" => [0, 2, 0, 0, 0],
        "K" => [0, 0, 0, 0, 1],
        "V" => [1, 2, -3, -1, 0],
        "J/K" => [1, 2, -2, 0, -1],
        "W/K" => [1, 2, -3, 0, -1],
        "J/(kg K)" => [0, 2, -2, 0, -1],
        "W/(m2 K)" => [1, 0, -3, 0, -1],
        _ => return None,
    })
}

fn units(xml: &mut Xml, variables: &[Variable]) -> io::Result<()> {
    let used: BTreeSet<&str> = variables.iter().map(|variable| variable.unit).collect();
    within(xml, "UnitDefinitions", |xml| {
        for unit in used.into_iter().filter(|unit| !unit.is_empty()) {
            unit_definition(xml, unit)?;
        }
        Ok(())
    })
}

fn unit_definition(xml: &mut Xml, unit: &str) -> io::Result<()> {
    let Some(exponents) = base_unit(unit) else {
        return empty(xml, "Unit", &[("name", unit)]);
    };
    let texts = exponents.map(|exponent| exponent.to_string());
    let bases = ["kg", "m", "s", "A", "K"].into_iter().zip(&texts);
    let stated: Vec<Attribute<'_>> = bases
        .filter(|(_, exponent)| *exponent != "0")
        .map(|(base, exponent)| (base, exponent.as_str()))
        .collect();
    let element = xml.create_element("Unit").with_attribute(("name", unit));
    element.write_inner_content(|xml| empty(xml, "BaseUnit", &stated))?;
    Ok(())
}

/// Causality, variability and initial, as both standards have them.
fn roles(variable: &Variable) -> Vec<Attribute<'static>> {
    let changes = match variable.of_type {
        Type::Real => "continuous",
        Type::Integer => "discrete",
    };
    match variable.causality {
        Causality::Parameter => vec![
            ("causality", "parameter"),
            ("variability", "fixed"),
            ("initial", "exact"),
        ],
        Causality::Input => vec![("causality", "input"), ("variability", changes)],
        Causality::Output => vec![
            ("causality", "output"),
            ("variability", changes),
            ("initial", "calculated"),
        ],
    }
}

/// Unit and start of a variable's type.
fn typed<'a>(variable: &'a Variable, start: &'a str) -> Vec<Attribute<'a>> {
    let mut attributes = Vec::new();
    if !variable.unit.is_empty() {
        attributes.push(("unit", variable.unit));
    }
    if variable.causality != Causality::Output {
        attributes.push(("start", start));
    }
    attributes
}

fn start_text(variable: &Variable) -> String {
    match variable.of_type {
        Type::Real => number(variable.start),
        Type::Integer => format!("{:.0}", variable.start),
    }
}

/// The name that tools see: where an input and an output share one in the tables of pneuma, they
/// never do in one unit.
fn referenced(variables: &[Variable]) -> impl Iterator<Item = (String, &Variable)> {
    let places = (1..).map(|place: u32| place.to_string());
    places.zip(variables)
}

fn variables_2(xml: &mut Xml, variables: &[Variable]) -> io::Result<()> {
    for (reference, variable) in referenced(variables) {
        let start = start_text(variable);
        let of_type = match variable.of_type {
            Type::Real => "Real",
            Type::Integer => "Integer",
        };
        let element = xml.create_element("ScalarVariable");
        let named = element.with_attributes([
            ("name", variable.name.as_str()),
            ("valueReference", reference.as_str()),
            ("description", variable.what.as_str()),
        ]);
        let said = named.with_attributes(roles(variable));
        said.write_inner_content(|xml| empty(xml, of_type, &typed(variable, &start)))?;
    }
    Ok(())
}

fn variables_3(xml: &mut Xml, variables: &[Variable]) -> io::Result<()> {
    let time = [
        ("name", "time"),
        ("valueReference", "0"),
        ("causality", "independent"),
        ("variability", "continuous"),
    ];
    empty(xml, "Float64", &time)?;
    for (reference, variable) in referenced(variables) {
        let start = start_text(variable);
        let of_type = match variable.of_type {
            Type::Real => "Float64",
            Type::Integer => "Int32",
        };
        let mut attributes = vec![
            ("name", variable.name.as_str()),
            ("valueReference", reference.as_str()),
            ("description", variable.what.as_str()),
        ];
        attributes.extend(roles(variable));
        attributes.extend(typed(variable, &start));
        empty(xml, of_type, &attributes)?;
    }
    Ok(())
}

/// Outputs depend on no input at once; at the beginning on what was set.
fn structure(xml: &mut Xml, standard: Standard, variables: &[Variable]) -> io::Result<()> {
    let outputs: Vec<String> = referenced(variables)
        .filter(|(_, variable)| variable.causality == Causality::Output)
        .map(|(reference, _)| reference)
        .collect();
    match standard {
        Standard::Two => {
            let unknown = |xml: &mut Xml, index: &str| {
                empty(xml, "Unknown", &[("index", index), ("dependencies", "")])
            };
            within(xml, "Outputs", |xml| {
                outputs.iter().try_for_each(|index| unknown(xml, index))
            })?;
            within(xml, "InitialUnknowns", |xml| {
                let initial = |xml: &mut Xml, index| empty(xml, "Unknown", &[("index", index)]);
                outputs.iter().try_for_each(|index| initial(xml, index))
            })
        }
        Standard::Three => {
            for reference in &outputs {
                let attributes = [("valueReference", reference.as_str()), ("dependencies", "")];
                empty(xml, "Output", &attributes)?;
            }
            for reference in &outputs {
                empty(
                    xml,
                    "InitialUnknown",
                    &[("valueReference", reference.as_str())],
                )?;
            }
            Ok(())
        }
    }
}
