//! Axes that record the same motion every night while one thing in them goes wrong.
//!
//! An axis is a rig of the shop floor; its engineer's rig file is the usual one. Each night it makes
//! the motion of its first training recording, five seconds at 500 Hz, in the weather of that day.

use crate::case::Case;
use crate::plant::Physics;
use crate::plant::mechanics::Load;
use crate::plant::network::Silencer;
use crate::plant::valve::Play;
use crate::{Kind, Nature, Request};

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A leak past the piston that grows.
    SlowLeak,
    /// Seals that grow dry: friction rises.
    SealWear,
    /// A valve that begins to stick.
    ValveSticking,
    /// A silencer that clogs.
    CloggingSilencer,
    /// A gauge whose zero drifts.
    GaugeDrift,
    /// A load that comes loose.
    LooseningLoad,
    /// A supply that sags.
    SupplySag,
    /// Another valve from one night on: null and areas of its own.
    SwappedValve,
}

impl Fault {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::SlowLeak,
        Self::SealWear,
        Self::ValveSticking,
        Self::CloggingSilencer,
        Self::GaugeDrift,
        Self::LooseningLoad,
        Self::SupplySag,
        Self::SwappedValve,
    ];

    /// Puts it into a plant, so many times as large as an engineer would just care about.
    fn put_into(self, physics: &mut Physics, size: f64) {
        let (network, mechanics) = (&mut physics.network, &mut physics.mechanics);
        match self {
            Self::SlowLeak => network.piston_leak.orifice_m2 += 2.5e-8 * size,
            Self::SealWear => {
                mechanics.friction.coulomb_n *= 1.0 + 0.15 * size;
                mechanics.friction.static_n *= 1.0 + 0.15 * size;
            }
            Self::ValveSticking => {
                physics.command.plays = vec![Play {
                    width_v: 0.03 * size,
                    weight: 1.0,
                }];
            }
            Self::CloggingSilencer => {
                // From three times the valve's area down to less than it.
                network.silencer = Some(Silencer {
                    volume_m3: 2e-5,
                    area_m2: 3.5e-5 / size.max(0.2),
                });
            }
            Self::GaugeDrift => physics.sensors.pressure_offset_pa[0] += 3e3 * size,
            Self::LooseningLoad => {
                let mass_kg = 0.5 * mechanics.mass_kg;
                mechanics.load = Some(Load {
                    mass_kg,
                    stiffness_n_per_m: 2e5,
                    damping_n_s_per_m: 2.0 * 0.1 * (2e5 * 0.5 * mass_kg).sqrt(),
                    gap_m: 0.2e-3 * size,
                    guide_n: 0.0,
                });
            }
            Self::SupplySag => network.supply.pressure_pa *= 1.0 - 0.03 * size,
            Self::SwappedValve => {
                physics.areas.null_v += 0.02 * size;
                let wider = 1.0 + 0.05 * size;
                physics
                    .areas
                    .supply_m2
                    .iter_mut()
                    .for_each(|area_m2| *area_m2 *= wider);
            }
        }
    }
}

/// The weather of a night.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weather {
    /// Temperature of the hall.
    pub ambient_k: f64,
    /// The supply over what it is set to.
    pub supply: f64,
}

/// An axis.
#[derive(Clone, Debug)]
pub struct Axis {
    request: Request,
    case: Case,
}

impl Axis {
    /// Drawn from a seed, healthy.
    pub fn draw(seed: u64) -> Self {
        let request = Request::new(seed, Kind::Nothing)
            .with_nature(Nature::ShopFloor)
            .with_noise(1.0);
        Self {
            case: request.draw(),
            request,
        }
    }

    /// What its engineer believes.
    pub fn rig_toml(&self) -> &str {
        &self.case.rig_toml
    }

    /// The recording of a night.
    pub fn night(&self, night: u32, weather: Weather, fault: Option<(Fault, f64)>) -> String {
        self.request.night(night, |physics| {
            physics.network.ambient.temperature_k = weather.ambient_k;
            physics.network.supply.pressure_pa *= weather.supply;
            if let Some((fault, size)) = fault.filter(|(_, size)| *size > 0.0) {
                fault.put_into(physics, size);
            }
        })
    }
}
