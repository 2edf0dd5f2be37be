//! Speed of the sums that every fit waits for, and of a whole small fit.
// The macros of criterion write an undocumented function.
#![allow(missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use host_sim::fit::{NormalEquations, Options, Parameter, RowWeighting, solve};
use std::hint::black_box;

/// Rows of one measurement: a second of recording at 10 kHz.
const ROWS: u32 = 10_000;

fn rows(parameters: usize) -> Vec<(f64, Vec<f64>)> {
    let row = |index: u32| {
        let phase = f64::from(index) * 0.01;
        let gradient = (0..parameters).map(|place| (phase * (place as f64 + 1.0)).sin());
        (phase.cos(), gradient.collect())
    };
    (0..ROWS).map(row).collect()
}

fn bench_add_row(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("add_row");
    group.throughput(Throughput::Elements(u64::from(ROWS)));
    for parameters in [10, 40] {
        let rows = rows(parameters);
        group.bench_function(BenchmarkId::from_parameter(parameters), |bencher| {
            bencher.iter(|| {
                let mut equations = NormalEquations::new(parameters, RowWeighting::Squares);
                for (residual, gradient) in black_box(&rows) {
                    equations.add_row(*residual, gradient);
                }
                equations
            });
        });
    }
    group.finish();
}

fn bench_fit(criterion: &mut Criterion) {
    let mut decay = |b: &[f64], equations: &mut NormalEquations| {
        for index in 0..1000_u32 {
            let time = f64::from(index) * 0.01;
            let falling = (-b[1] * time).exp();
            let target = 3.0 * (-0.6 * time).exp() + 0.01 * (37.0 * time).sin();
            equations.add_row(b[0] * falling - target, &[falling, -b[0] * time * falling]);
        }
    };
    let parameters = [Parameter::new(1.0), Parameter::new(1.0)];
    criterion.bench_function("fit/decay_1000_rows", |bencher| {
        bencher.iter(|| solve(&mut decay, black_box(&parameters), &Options::default()));
    });
}

criterion_group!(benches, bench_add_row, bench_fit);
criterion_main!(benches);
