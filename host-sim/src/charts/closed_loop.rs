//! The page of `pneuma loop`.

use crate::closed_loop::{Judged, Row, Run};
use crate::motion::Segment;
use crate::report::{Cell, Chart, ChartStack, Page, Provenance, Role, Series, Table, number};

const MM_PER_M: f64 = 1e3;
const MV_PER_V: f64 = 1e3;
const PA_PER_BAR: f64 = 1e5;
const PANEL_HEIGHT_PX: u32 = 160;
const STATE_HEIGHT_PX: u32 = 80;

/// The page of a closed-loop run.
pub fn closed_loop_page(title: &str, run: &Run, judged: &[Judged], how: Provenance) -> Page {
    let mut page = Page::new(title);
    page.lead(lead(judged));
    tiles(&mut page, run, judged);
    page.section("By segment", |section| {
        section.text(
            "True position compared with the reference. Overshoot: beyond the end of the preceding \
             move. At rest, and command rms: from 0.3 s after the begin of the segment.",
        );
        section.table(table(judged));
    });
    page.section("Over time", |section| {
        if let Some(stop) = &run.end_stop {
            section.callout(format!(
                "At {} s the carriage hit the end of its stroke at {} mm.",
                number::fixed(stop.time_s, 3),
                number::fixed(MM_PER_M * stop.position_m, 1)
            ));
        }
        section.text("The panels share zoom and cursor.");
        section.chart(plots(run));
    });
    page.provenance(how);
    page
}

/// The largest of what some parts came to, if any.
fn largest(judged: &[Judged], value: impl Fn(&Judged) -> Option<f64>) -> Option<f64> {
    judged.iter().filter_map(value).max_by(f64::total_cmp)
}

fn while_moving(judged: &Judged) -> Option<f64> {
    let rests = matches!(judged.part.segment, Segment::Hold { .. });
    (!rests).then_some(judged.worst_m)
}

fn lead(judged: &[Judged]) -> String {
    let mm = |value: Option<f64>| {
        value.map_or("none".into(), |value| {
            format!("{} mm", number::significant(MM_PER_M * value, 2))
        })
    };
    format!(
        "The load follows its reference to within {} and stands to within {} of it.",
        mm(largest(judged, while_moving)),
        mm(largest(judged, |part| part.at_rest_m)),
    )
}

fn tiles(page: &mut Page, run: &Run, judged: &[Judged]) {
    let figure = |value: Option<f64>, scale: f64| {
        value.map_or("-".into(), |value| number::significant(scale * value, 3))
    };
    let moving = largest(judged, while_moving);
    let resting = largest(judged, |part| part.at_rest_m);
    let beyond = largest(judged, |part| part.overshoot_m);
    let command = largest(judged, |part| part.command_movement_v);
    let seconds = run.rows.last().map_or(0.0, |row| row.truth.time_s);
    page.tile("error, moving", figure(moving, MM_PER_M), "mm", "largest");
    page.tile("error, at rest", figure(resting, MM_PER_M), "mm", "largest");
    page.tile("overshoot", figure(beyond, MM_PER_M), "mm", "largest");
    page.tile(
        "command at rest",
        figure(command, MV_PER_V),
        "mV",
        "largest rms about its mean",
    );
    page.tile(
        "run",
        number::significant(seconds, 3),
        "s",
        format!("{} ticks", run.rows.len()),
    );
}

fn table(judged: &[Judged]) -> Table {
    let headings = [
        "segment",
        "from, s",
        "worst error, mm",
        "RMS error, mm",
        "overshoot, mm",
        "at rest, mm",
        "command, mV RMS",
    ];
    let optional = |value: Option<f64>, scale: f64, decimals| match value {
        Some(value) => Cell::number(scale * value, decimals),
        None => "".into(),
    };
    judged.iter().fold(Table::new(headings), |table, judged| {
        table.row([
            judged.part.segment.to_string().into(),
            Cell::number(judged.part.begin_s, 2),
            Cell::number(MM_PER_M * judged.worst_m, 3),
            Cell::number(MM_PER_M * judged.rms_m, 3),
            optional(judged.overshoot_m, MM_PER_M, 3),
            optional(judged.at_rest_m, MM_PER_M, 3),
            optional(judged.command_movement_v, MV_PER_V, 1),
        ])
    })
}

fn plots(run: &Run) -> ChartStack {
    let stack = plots_of_forces(run, plots_of_gas(run, plots_of_motion(run)));
    let curve = Curves(run);
    stack.panel(
        panel("State", "0 init, 1 idle, 2 track, 3 fault", "")
            .height(STATE_HEIGHT_PX)
            .y_range(-0.2, 3.2)
            .series(
                curve
                    .of("state", Role::Recorded, |row| f64::from(row.command.state))
                    .step(),
            ),
    )
}

fn panel(title: &str, quantity: &str, unit: &str) -> Chart {
    Chart::new(title)
        .y_axis(quantity, unit)
        .height(PANEL_HEIGHT_PX)
}

/// The curves of a run over its time.
struct Curves<'r>(&'r Run);

impl Curves<'_> {
    fn of(&self, name: &str, role: Role, value: fn(&Row) -> f64) -> Series {
        let points = self.0.rows.iter();
        Series::new(name, role, points.map(|row| (row.truth.time_s, value(row))))
    }
}

fn plots_of_motion(run: &Run) -> ChartStack {
    let curves = Curves(run);
    let curve = |name, role, value| curves.of(name, role, value);
    let position = |row: &Row| MM_PER_M * row.error_of_belief_m();
    let velocity = |row: &Row| f64::from(row.command.estimate[1]);
    ChartStack::new("")
        .panel(
            panel("Carriage", "position", "mm")
                .series(curve("true", Role::Recorded, |row| {
                    MM_PER_M * row.truth.position_m
                }))
                .series(
                    curve("reference", Role::Improved, |row| {
                        MM_PER_M * f64::from(row.sample.reference.position_m)
                    })
                    .dashed(),
                ),
        )
        .panel(
            panel("Error", "position", "mm")
                .series(curve("observer", Role::Noise, position))
                .series(curve("true against reference", Role::Mark, |row| {
                    MM_PER_M * row.error_m()
                })),
        )
        .panel(
            panel("Velocity", "velocity", "m/s")
                .series(curve("observer", Role::Improved, velocity))
                .series(curve("true", Role::Recorded, |row| row.truth.velocity_m_s)),
        )
}

fn plots_of_gas(run: &Run, stack: ChartStack) -> ChartStack {
    let curves = Curves(run);
    let curve = |name, role, value| curves.of(name, role, value);
    stack
        .panel(
            panel("Valve", "command", "V")
                .series(curve("command", Role::Recorded, |row| row.truth.command_v).step()),
        )
        .panel(
            panel("Chambers", "pressure, absolute", "bar")
                .series(curve("chamber A", Role::Improved, |row| {
                    row.truth.pressure_a_pa / PA_PER_BAR
                }))
                .series(curve("chamber B", Role::Refitted, |row| {
                    row.truth.pressure_b_pa / PA_PER_BAR
                }))
                .series(
                    curve("supply", Role::Recorded, |row| {
                        row.truth.supply_pressure_pa / PA_PER_BAR
                    })
                    .dashed(),
                ),
        )
}

fn plots_of_forces(run: &Run, stack: ChartStack) -> ChartStack {
    let curves = Curves(run);
    let curve = |name, role, value| curves.of(name, role, value);
    let friction = |row: &Row| f64::from(row.command.estimate[2]);
    let disturbance = |row: &Row| f64::from(row.command.estimate[3]);
    stack.panel(
        panel("Forces", "force", "N")
            .series(curve("friction", Role::Recorded, |row| {
                row.truth.friction_n
            }))
            .series(curve("friction, observer", Role::Improved, friction))
            .series(curve("disturbance, observer", Role::Refitted, disturbance)),
    )
}
