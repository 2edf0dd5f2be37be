//! The gas in the chambers: its temperature and its volume.

pub mod dead_volume;
pub mod gas_temperature;
pub mod variable_heat_transfer;
pub mod wall_temperature;

use super::scene::Scene;

/// Whether the law is of chambers behind a valve that the rig lets exchange heat: what differs from
/// a declared exchange is asked only there.
fn exchanges_heat(scene: &Scene<'_>) -> bool {
    let chambers = scene.rig.chambers.as_ref();
    let declared = chambers.and_then(|chambers| chambers.heat_transfer_charging_w_m2k);
    scene.is_behind_valve() && declared.is_some()
}
