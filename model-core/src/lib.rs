//! The laws of a servo-pneumatic axis: a proportional valve, two chambers, a
//! carriage with friction, and the axis as their sum.
//!
//! The equations are those of Meng, Tao, Chen, Ban, "Modeling of a Pneumatic
//! System for High-Accuracy Position Control", FPM 2011; the number in
//! parentheses behind a law is the paper's. What the paper leaves out stands
//! in [`left_out`], one file per effect, each switched off by its neutral value.
//!
//! | room | law |
//! |---|---|
//! | [`gas`] | ideal gas, the constant C1 of the flow law |
//! | [`valve`] | flow through an orifice (1), (2), area tables, the inverse |
//! | [`chamber`] | volumes (4), heat (5), full balance (3), reduced model (6), stop method (7) |
//! | [`friction`] | LuGre (9), (10), (11) |
//! | [`carriage`] | motion (8) |
//! | [`pneumatics`] | both chambers with what lies between them and the valve |
//! | [`axis`] | the sum of them |
//! | [`observer`] | the axis' laws corrected by the sensors; valve edges and friction learned |
//! | [`feedforward`] | the inverse flow map: which command makes the force change so fast |
//! | [`mod@reference`] | reference motions, and the way onto one that jumps |
//! | [`controller`] | position loop over force loop, friction fed forward, rest |
//! | [`left_out`] | physics that the paper leaves out |
//! | [`paper`] | the paper's parameter values, in one place |
//! | [`real`], [`math`] | the scalar: `f32`, `f64`, dual numbers; functions with the same bits everywhere |
//!
//! Every law is `Params` + `State` + a total step: no panic, no allocation,
//! the time step `dt_s` a value. A NaN that goes in comes out as NaN, and
//! [`axis::AxisState::is_finite`] tells. Laws take signals, not each other, so
//! that each can be driven by a recorded signal in place of its neighbour.
#![no_std]

pub mod axis;
pub mod carriage;
pub mod chamber;
pub mod controller;
pub mod feedforward;
pub mod friction;
pub mod gas;
pub mod left_out;
pub mod math;
pub mod observer;
pub mod paper;
pub mod pneumatics;
pub mod real;
pub mod reference;
pub mod valve;

/// The example of the README runs.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
