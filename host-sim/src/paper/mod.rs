//! The paper, experiment by experiment: its figures by its own numbers, and its procedure from
//! bench recordings to a predicted step response.
//!
//! * `valve.rs`, `gas.rs`, `friction.rs`, `axis.rs`: figures 2 to 14, of the rig file `paper.toml` and
//!   the model; what the paper's text says is marked, what it does not say is an assumption
//! * `procedure.rs`: experiments on a virtual bench, one rig file out, step responses predicted and
//!   "measured", and what the procedure leaves out, found by the diagnosis
//! * `page.rs`: all of it on one page
//!
//! No curve here was read off a figure of the paper: where a figure has points of measurements, the
//! page has the model's curve.

mod axis;
mod friction;
mod gas;
mod page;
mod procedure;
mod valve;

pub use page::page;
pub use procedure::{LeftOut, Procedure, Response, Step, procedure};

use bench::Picture;

use crate::rig::Rig;

/// One figure of the paper.
pub struct Figure {
    /// Its number or numbers in the paper.
    pub number: &'static str,
    /// What it shows.
    pub title: &'static str,
    /// What the paper's text says of it, with its numbers.
    pub says: &'static str,
    /// What the text does not say and is taken here.
    pub assumed: &'static str,
    /// The pictures.
    pub pictures: Vec<Picture>,
}

/// The rig file of the paper's axis.
pub const RIG: &str = include_str!("../../rigs/paper.toml");

/// The paper's axis.
///
/// # Panics
/// Never: a test reads the file.
pub fn rig() -> Rig {
    Rig::parse(RIG, "paper.toml").unwrap_or_default()
}

/// Figures 2 to 14.
///
/// # Errors
/// If the axis cannot be simulated.
pub fn figures() -> Result<Vec<Figure>, String> {
    let rig = rig();
    let mut figures = valve::figures(&rig)?;
    figures.extend(gas::figures(&rig)?);
    figures.extend(friction::figures(&rig));
    figures.push(axis::figure(&rig)?);
    Ok(figures)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_the_figures_of_the_paper_have_their_numbers() {
        assert_eq!(rig().value("friction.coulomb_N"), Some(20.2));
        let figures = figures().expect("figures");
        let numbers: Vec<&str> = figures.iter().map(|one| one.number).collect();
        let all = [
            "2", "3", "4", "5", "6", "7", "8", "9", "10, 11", "(9)", "12, 13", "14",
        ];
        assert_eq!(numbers, all);
        for figure in &figures {
            assert!(!figure.pictures.is_empty(), "figure {}", figure.number);
            for picture in &figure.pictures {
                for curve in &picture.curves {
                    let finite = curve
                        .points
                        .iter()
                        .all(|(x, y)| x.is_finite() && y.is_finite());
                    assert!(
                        finite && curve.points.len() > 1,
                        "{}: {}",
                        picture.title,
                        curve.name
                    );
                }
            }
        }
    }
}
