//! Time of one step of each law on the host: ratios between laws and scalars.
//! Cycles on the chip are counted there, not here.
#![allow(missing_docs, reason = "criterion's macros make public functions")]

use criterion::{Criterion, criterion_group, criterion_main};
use model_core::axis::{Axis, AxisInputs, AxisState, ValveDrive};
use model_core::chamber::{ChamberFlow, ChamberState};
use model_core::friction::Acting;
use model_core::paper;
use model_core::real::{Dual, Real};
use model_core::valve::GasState;
use std::hint::black_box;

fn gas<R: Real>(pressure_pa: f64) -> GasState<R> {
    GasState {
        pressure_pa: R::from_f64(pressure_pa),
        temperature_k: R::from_f64(paper::AMBIENT_TEMPERATURE_K),
    }
}

/// The axis in a slow relay about the middle: valve open, sliding friction.
fn bench_axis<R: Real>(criterion: &mut Criterion, name: &str) {
    let axis: Axis<R> = black_box(paper::axis());
    let start = R::from_f64(5.25e5);
    let kelvin = R::from_f64(paper::AMBIENT_TEMPERATURE_K);
    let mut state = AxisState::at_rest(R::ZERO, start, start, kelvin, R::from_f64(5.0));
    let mut command_v = R::from_f64(5.8);
    criterion.bench_function(name, |bencher| {
        bencher.iter(|| {
            let x = state.carriage.position_m.value;
            if x > R::from_f64(0.05) {
                command_v = R::from_f64(4.2);
            } else if x < R::from_f64(-0.05) {
                command_v = R::from_f64(5.8);
            }
            let inputs = AxisInputs {
                command_v,
                supply_pressure_pa: R::from_f64(paper::SUPPLY_PRESSURE_PA),
            };
            axis.step(&mut state, black_box(&inputs));
        });
    });
    assert!(state.is_finite());
}

fn bench_flow<R: Real>(criterion: &mut Criterion, name: &str) {
    let law = black_box(paper::axis::<R>().pneumatics.law);
    let area_m2 = R::from_f64(1e-5);
    let (up, down) = (gas::<R>(7e5), gas::<R>(5e5));
    criterion.bench_function(name, |bencher| {
        bencher.iter(|| law.flow(black_box(area_m2), black_box(up), black_box(down)));
    });
}

fn bench_friction<R: Real>(criterion: &mut Criterion, name: &str) {
    let axis: Axis<R> = black_box(paper::axis());
    let (velocity, deflection) = (R::from_f64(0.01), R::from_f64(2e-5));
    let (drive_n, dt_s) = (R::from_f64(30.0), R::from_f64(1e-3));
    criterion.bench_function(name, |bencher| {
        bencher.iter(|| {
            let acting = |_, _| Acting {
                levels: axis.friction,
                drive_n,
            };
            axis.carriage.bristle.step_with_mass(
                acting,
                axis.carriage.mass_kg,
                black_box(velocity),
                black_box(deflection),
                dt_s,
            )
        });
    });
}

/// One chamber with its two paths open.
fn bench_chamber<R: Real>(criterion: &mut Criterion, name: &str) {
    let axis: Axis<R> = black_box(paper::axis());
    let chamber = axis.pneumatics.chamber_a;
    let drive = ValveDrive {
        areas: axis.valve.areas(R::from_f64(6.0)),
        supply: gas::<R>(7e5),
    };
    let (ambient, law) = (axis.pneumatics.ambient, axis.pneumatics.law);
    let start = ChamberState::new(R::from_f64(5e5), R::from_f64(290.0));
    let (from_m, to_m) = (R::from_f64(0.01), R::from_f64(0.0105));
    let dt_s = R::from_f64(1e-3);
    let flow = |gas: GasState<R>| {
        let filling = law.flow(drive.areas.supply_a_m2, drive.supply, gas);
        let emptying = law.flow(drive.areas.exhaust_a_m2, gas, ambient);
        ChamberFlow::NONE
            .with(
                filling.mass_flow_kg_per_s,
                filling.slope_2_kg_per_s_pa,
                drive.supply.temperature_k,
                gas.temperature_k,
            )
            .with(
                -emptying.mass_flow_kg_per_s,
                -emptying.slope_1_kg_per_s_pa,
                ambient.temperature_k,
                gas.temperature_k,
            )
    };
    criterion.bench_function(name, |bencher| {
        bencher.iter(|| {
            let mut state = black_box(start);
            let stroke = chamber.stroke(black_box(from_m), to_m);
            chamber.step(&mut state, &stroke, flow, dt_s);
            state
        });
    });
}

fn bench_laws(criterion: &mut Criterion) {
    bench_axis::<f32>(criterion, "axis step f32");
    bench_axis::<f64>(criterion, "axis step f64");
    bench_flow::<f32>(criterion, "flow law f32");
    bench_flow::<f64>(criterion, "flow law f64");
    bench_friction::<f32>(criterion, "friction step f32");
    bench_friction::<f64>(criterion, "friction step f64");
    bench_chamber::<f32>(criterion, "chamber step f32");
    bench_chamber::<f64>(criterion, "chamber step f64");
    bench_chamber::<Dual<8>>(criterion, "chamber step Dual<8>");
}

criterion_group!(laws, bench_laws);
criterion_main!(laws);
