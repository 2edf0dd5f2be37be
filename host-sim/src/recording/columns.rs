//! Which column a written recording has where, so that it reads back through
//! the same rig's `[signals]`.

use crate::rig::{Column, Signals};

/// A column that the rig asks for and that cannot be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ColumnFault {
    pub key: String,
    pub problem: String,
    pub expected: String,
}

/// The columns in their order: name in the header, place among the `offered`
/// ones, which are pairs of signal and the name where the rig does not say.
/// Numbered ones stand where the rig says, the others in the places left.
pub(crate) fn arrange(
    signals: &Signals,
    offered: &[(&str, &str)],
) -> Result<Vec<(String, usize)>, ColumnFault> {
    let numbered = |place: usize| match signals.get(offered[place].0)?.column {
        Column::Number(number) => Some(number),
        Column::Name(_) => None,
    };
    let mut slots: Vec<Option<usize>> = vec![None; offered.len()];
    for place in 0..offered.len() {
        let Some(number) = numbered(place) else {
            continue;
        };
        let Some(slot) = slots.get_mut(number) else {
            return Err(ColumnFault {
                key: format!("signals.{}.column", offered[place].0),
                problem: format!("there is no column {number} to write"),
                expected: format!("a name, or a number below {}", offered.len()),
            });
        };
        *slot = Some(place);
    }
    let mut others = (0..offered.len()).filter(|place| numbered(*place).is_none());
    Ok(slots
        .into_iter()
        .filter_map(|slot| slot.or_else(|| others.next()))
        .map(|place| (header_name(signals, offered[place]), place))
        .collect())
}

fn header_name(signals: &Signals, (signal, name): (&str, &str)) -> String {
    match signals.get(signal).map(|signal| &signal.column) {
        Some(Column::Name(name)) if name.contains([',', '"']) => {
            format!("\"{}\"", name.replace('"', "\"\""))
        }
        Some(Column::Name(name)) => name.clone(),
        _ => name.into(),
    }
}
