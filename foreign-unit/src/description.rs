//! `modelDescription.xml`: FMI 2.0.5, section 2.2, and FMI 3.0.2, section 2.4.

use crate::UnitError;
use roxmltree::{Document, Node};

/// The standard that a unit follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Standard {
    /// 2.0.
    Two,
    /// 3.0.
    Three,
}

/// Which way a variable goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Causality {
    /// Set from outside at any time.
    Input,
    /// Read from outside.
    Output,
    /// Set before the start.
    Parameter,
    /// Of no other use than to be looked at.
    Local,
}

/// A real variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Its name.
    pub name: String,
    /// Which way it goes.
    pub causality: Causality,
    /// Its unit as the author spelt it.
    pub unit: Option<String>,
    pub(crate) reference: u32,
}

/// What of a description is used here.
#[derive(Debug)]
pub(crate) struct Description {
    pub(crate) standard: Standard,
    /// The name of the library.
    pub(crate) model: String,
    /// What instance and description must agree on.
    pub(crate) token: String,
    pub(crate) name: String,
    pub(crate) variables: Vec<Variable>,
}

impl Description {
    pub(crate) fn read(text: &str) -> Result<Self, UnitError> {
        let document = Document::parse(text).map_err(|cause| fault(cause.to_string()))?;
        let root = document.root_element();
        let version = attribute(root, "fmiVersion")?;
        let standard = match version.split('.').next() {
            Some("2") => Standard::Two,
            Some("3") => Standard::Three,
            _ => {
                return Err(fault(format!(
                    "fmiVersion is {version}, expected 2.0 or 3.0"
                )));
            }
        };
        let co_simulation = child(root, "CoSimulation").ok_or_else(|| {
            fault("has no CoSimulation, expected a unit that steps itself".to_owned())
        })?;
        let token = match standard {
            Standard::Two => "guid",
            Standard::Three => "instantiationToken",
        };
        let all = child(root, "ModelVariables");
        let all = all.into_iter().flat_map(|all| all.children());
        let variables = all.filter_map(|node| match standard {
            Standard::Two => child(node, "Real").map(|real| variable(node, real)),
            Standard::Three => node.has_tag_name("Float64").then(|| variable(node, node)),
        });
        Ok(Self {
            standard,
            model: attribute(co_simulation, "modelIdentifier")?.to_owned(),
            token: attribute(root, token)?.to_owned(),
            name: attribute(root, "modelName")?.to_owned(),
            variables: variables.collect::<Result<_, _>>()?,
        })
    }
}

fn variable(node: Node<'_, '_>, real: Node<'_, '_>) -> Result<Variable, UnitError> {
    let name = attribute(node, "name")?;
    let reference = attribute(node, "valueReference")?;
    let reference = reference
        .parse()
        .map_err(|_| fault(format!("{name}: valueReference is {reference}")))?;
    Ok(Variable {
        name: name.to_owned(),
        causality: match node.attribute("causality") {
            Some("input") => Causality::Input,
            Some("output") => Causality::Output,
            Some("parameter" | "structuralParameter") => Causality::Parameter,
            _ => Causality::Local,
        },
        unit: real.attribute("unit").map(str::to_owned),
        reference,
    })
}

fn child<'a, 'd>(node: Node<'a, 'd>, name: &str) -> Option<Node<'a, 'd>> {
    node.children().find(|one| one.has_tag_name(name))
}

fn attribute<'a>(node: Node<'a, '_>, name: &str) -> Result<&'a str, UnitError> {
    let owner = node.tag_name().name();
    node.attribute(name)
        .ok_or_else(|| fault(format!("{owner} has no {name}")))
}

fn fault(problem: String) -> UnitError {
    UnitError::Description(problem)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: &str = r#"<fmiModelDescription fmiVersion="2.0" modelName="Axis" guid="{1}">
        <CoSimulation modelIdentifier="axis"/>
        <ModelVariables>
          <ScalarVariable name="u" valueReference="3" causality="input"><Real unit="V"/></ScalarVariable>
          <ScalarVariable name="on" valueReference="4" causality="input"><Boolean/></ScalarVariable>
          <ScalarVariable name="s" valueReference="7" causality="output"><Real/></ScalarVariable>
        </ModelVariables></fmiModelDescription>"#;

    #[test]
    fn val_real_variables_are_read_with_their_units() {
        let read = Description::read(TWO).expect("a description");
        assert_eq!(
            (read.standard, read.model.as_str()),
            (Standard::Two, "axis")
        );
        let names = read.variables.iter().map(|one| {
            let unit = one.unit.as_deref();
            (one.name.as_str(), one.reference, one.causality, unit)
        });
        let expected = [
            ("u", 3, Causality::Input, Some("V")),
            ("s", 7, Causality::Output, None),
        ];
        assert!(names.eq(expected));
        let three = r#"<fmiModelDescription fmiVersion="3.0" modelName="Axis" instantiationToken="t">
            <CoSimulation modelIdentifier="axis"/>
            <ModelVariables><Float64 name="p" valueReference="9" causality="output" unit="Pa"/>
            <Int32 name="n" valueReference="1"/></ModelVariables></fmiModelDescription>"#;
        let read = Description::read(three).expect("a description");
        assert_eq!(read.standard, Standard::Three);
        assert_eq!(read.variables.len(), 1);
    }

    #[test]
    fn prop_what_cannot_be_stepped_is_refused_in_words() {
        for (from, to, expected) in [
            ("2.0", "1.0", "expected 2.0 or 3.0"),
            (
                "CoSimulation",
                "ModelExchange",
                "expected a unit that steps itself",
            ),
            ("modelIdentifier", "model", "has no modelIdentifier"),
            (
                "valueReference=\"3\"",
                "valueReference=\"-3\"",
                "u: valueReference is -3",
            ),
            ("guid", "id", "has no guid"),
            ("</fmi", "</", "modelDescription.xml"),
        ] {
            let said = Description::read(&TWO.replace(from, to));
            let said = said.expect_err(to).to_string();
            assert!(said.contains(expected), "{said}");
        }
    }
}
