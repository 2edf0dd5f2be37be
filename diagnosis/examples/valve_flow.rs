//! How far `identify valve-flow` is from the truth on drawn axes of another plant, in per cent, and in
//! stated deviations: `cargo run --release -p diagnosis --example valve_flow FROM TO`.

use diagnosis::valve_flow::{ValveFlow, measure};
use grey_box::laws::Track;
use grey_box::recording::Recording;
use grey_box::rig::Rig;
use truth_plant::{Kind, Nature, Request, Truth};

const OPENINGS_V: [f64; 9] = [0.0, 0.4, 0.5, 0.8, 1.3, 2.0, 2.5, 3.6, 4.3];

fn main() {
    let seeds: Vec<u64> = std::env::args()
        .skip(1)
        .filter_map(|seed| seed.parse().ok())
        .collect();
    for nature in [Nature::Laboratory, Nature::ShopFloor] {
        for seed in seeds[0]..seeds[1] {
            let request = Request::new(seed, Kind::Nothing).with_nature(nature);
            let (truth, valve) = measured(&request);
            line(seed, &truth, &valve);
        }
    }
}

fn measured(request: &Request) -> (Truth, ValveFlow) {
    let case = request.draw();
    let rig = Rig::parse(&case.rig_toml, "rig.toml").expect("a rig");
    let read = |(name, text): &(String, String)| {
        Recording::read_from(text.as_bytes(), name, None, &rig.signals).expect("a recording")
    };
    let recordings: Vec<Recording> = case.train.iter().map(read).collect();
    let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
    (request.truth(), measure(&rig, &tracks).expect("a valve"))
}

fn line(seed: u64, truth: &Truth, valve: &ValveFlow) {
    let of = |name: &str| truth.plant[name];
    let dead = ["V0a", "V0b"].map(of);
    let off = [0, 1].map(|side| 100.0 * (valve.dead_volume_m3[side] / dead[side] - 1.0));
    print!(
        "{seed} null {:+.1} mV b {:+.3} dead {:+.1} {:+.1} % |",
        1e3 * (valve.null_v - of("null")),
        valve.critical_pressure_ratio - of("b"),
        off[0],
        off[1]
    );
    for opening_v in OPENINGS_V {
        let free_v: f64 = (opening_v - of("ovl")).max(0.0);
        let true_m2 = of("Aleak") + of("Amax") * (free_v / of("span")).powf(of("shape")).tanh();
        let above = valve
            .points
            .partition_point(|point| point.opening_v <= opening_v)
            .min(valve.points.len() - 1)
            .max(1);
        let (from, to) = (valve.points[above - 1], valve.points[above]);
        let along =
            ((opening_v - from.opening_v) / (to.opening_v - from.opening_v)).clamp(0.0, 1.0);
        for path in [0, 1] {
            let at = |of: &dyn Fn(usize) -> f64| of(0) + along * (of(1) - of(0));
            let area = at(&|end| [from, to][end].area_m2[path]);
            let sd = at(&|end| [from, to][end].deviation_m2[path]);
            let true_m2 = if path == 1 {
                true_m2 * of("asym")
            } else {
                true_m2
            };
            print!(
                " {:+.1}({:.1})",
                100.0 * (area / true_m2 - 1.0),
                100.0 * sd / area
            );
        }
    }
    println!();
}
