//! A closed-loop run as a recording: what the converters said, in the rig's
//! columns and units, with the command that holds from each row to the next.

use super::run::{Row, Run};
use crate::plant;
use crate::recording::{Output, Table};
use crate::rig::{Rig, RigError};

/// The run as the rig's logger would have written it, the reference besides.
pub fn recorded(run: &Run, rig: &Rig, rig_name: &str) -> Result<Table, RigError> {
    let output = |name, signal, value: fn(&Row) -> f64| Output {
        name,
        signal,
        values: run.rows.iter().map(value).collect(),
    };
    let outputs = [
        output("t_s", "t", |row| row.truth.time_s),
        output("u_V", "u", |row| row.truth.command_v),
        output("p_a_Pa", "p_a", |row| seen(row).pressure_a_pa),
        output("p_b_Pa", "p_b", |row| seen(row).pressure_b_pa),
        output("p_s_Pa", "p_s", |row| seen(row).supply_pressure_pa),
        output("x_m", "x", |row| seen(row).position_m),
        output("v_m_s", "v", |row| seen(row).velocity_m_s),
        output("x_reference_m", "", |row| {
            f64::from(row.sample.reference.position_m)
        }),
    ];
    Table::new(rig, rig_name, &outputs)
}

fn seen(row: &Row) -> plant::Seen {
    plant::seen(&row.sample.codes)
}
