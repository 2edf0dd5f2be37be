//! Settings as a whole, with a flash that loses its power.

use super::record::{Content, RecordFault, encode, encode_content};
use super::slots::{
    LEAST_SLOT_BYTES, Origin, PROGRAM_UNIT_BYTES, Slot, SlotStorage, Slots, StorageFault,
    StoreFault,
};
use super::transfer::{self, Answer, LONGEST_CHUNK, Transfer, Verdict, read_answer};
use super::{Connection, Settings, SettingsFault, Thermal, Wiring};
use crate::fault::Fault;
use crate::tick::NotAtRest;
use model_core::controller::Controller;
use model_core::paper;
use model_core::valve::{TABLE_CAPACITY, TableFault};
use std::vec::Vec;

const DT_S: f32 = 1e-3;

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }
    fn share(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 24) as f32
    }
}

/// Possible settings, every number another.
pub(super) fn random_settings(seed: u32) -> Settings {
    let mut random = Random(u64::from(seed));
    let mut settings = Settings::built_in();
    let mut vary = |value: &mut f32| *value *= 0.9 + 0.2 * random.share();
    vary(&mut settings.carriage.mass_kg);
    vary(&mut settings.chamber_a.dead_volume_m3);
    vary(&mut settings.chamber_b.dead_volume_m3);
    vary(&mut settings.friction.coulomb_n);
    vary(&mut settings.friction.bristle_stiffness_n_per_m);
    vary(&mut settings.valve.null_v);
    for area in &mut settings.valve.supply_areas_m2 {
        *area *= 1.0 + 0.1 * seed as f32;
    }
    settings.chamber_b.leak_laminar_kg_per_s_pa2 = 3e-16 * random.share();
    settings.friction_terms.constant_force_n = random.share() - 0.5;
    for gain in [
        &mut settings.controller.position_per_s,
        &mut settings.controller.observer_edge_per_s,
        &mut settings.controller.move_jerk_m_per_s3,
    ] {
        *gain *= 0.9 + 0.2 * random.share();
    }
    vary_effects(&mut settings, &mut random);
    settings.sensors.pressure_a_pa.lowest -= 1e5 * random.share();
    if seed % 3 == 2 {
        settings.sensors.velocity_m_per_s = None;
    }
    if seed % 3 == 1 {
        settings.chambers.thermal = Thermal::Polytropic {
            expansion_index: 1.0 + random.share() / 4.0,
            compression_index: 1.18,
            reference_pressure_pa: 7e5,
        };
    }
    settings
}

/// About half of the left-out physics, in strengths that are seen.
fn vary_effects(settings: &mut Settings, random: &mut Random) {
    let gas = &mut settings.pneumatic_effects;
    let motion = &mut settings.mechanical_effects;
    (motion.buffer_low_m, motion.buffer_high_m) = (-0.24, 0.24);
    gas.separate_exhausts = random.share() > 0.5;
    for (number, usual) in [
        (&mut gas.piston_leak_laminar_kg_per_s_pa2, 3e-16),
        (&mut gas.piston_leak_orifice_m2, 1e-7),
        (&mut gas.tank_volume_m3, 2e-3),
        (&mut gas.silencer_area_m2, 2e-5),
        (&mut gas.cushion_length_m, 0.02),
        (&mut gas.throttle_a_m2, 8e-6),
        (&mut gas.throttle_b_m2, 5e-6),
        (&mut gas.heat_density_exponent, 0.7),
        (&mut gas.heat_flow_w_per_m2_k, 40.0),
        (&mut gas.wall_offset_k, 8.0),
        (&mut gas.wall_heat_capacity_j_per_k, 2e3),
        (&mut gas.wall_outer_w_per_k, 0.5),
        (&mut motion.position_sine, 0.2),
        (&mut motion.position_slope_per_m, -0.5),
        (&mut motion.zone_share, 0.4),
        (&mut motion.direction_asymmetry, 0.1),
        (&mut motion.dwell_rise_n, 15.0),
        (&mut motion.load_mass_kg, 0.8),
        (&mut motion.load_stiffness_n_per_m, 2e5),
        (&mut motion.load_gap_m, 1e-4),
        (&mut motion.buffer_stiffness_n_per_m, 1e5),
        (&mut motion.buffer_damping_n_s_per_m, 100.0),
        (&mut motion.unknown_force_n[3], 4.0),
        (&mut motion.drag_n_s2_per_m2, 40.0),
        (&mut motion.pitch_sine_n, 4.0),
        (&mut motion.trailing_n, 7.0),
    ] {
        let share = random.share();
        if share > 0.5 {
            *number = usual * share;
        }
    }
}

/// Settings with as many points as there may be.
pub(super) fn full_settings() -> Settings {
    let mut settings = random_settings(1);
    let column = |scale: f32| {
        (0..TABLE_CAPACITY)
            .map(|point| point as f32 * scale)
            .collect()
    };
    settings.valve.openings_v = column(0.1);
    settings.valve.supply_areas_m2 = column(1e-7);
    settings.valve.exhaust_areas_m2 = column(1.1e-7);
    settings
}

#[test]
fn val_built_in_settings_are_the_paper_s_axis() {
    let axis = Settings::built_in().axis(DT_S).expect("they are possible");
    assert_eq!(axis, paper::axis::<f32>());
}

#[test]
fn prop_the_controller_is_built_with_the_gains_of_the_settings() {
    use model_core::controller::Gains;
    let mut settings = Settings::built_in();
    let axis = settings.axis(DT_S).expect("they are possible");
    assert_eq!(settings.try_build(DT_S), Ok(Controller::new(axis)));
    settings.controller.force_per_s = 150.0;
    settings.controller.move_velocity_m_per_s = 0.3;
    let mut gains = Gains::standard();
    gains.force_per_s = 150.0;
    gains.motion.velocity_m_per_s = 0.3;
    let expected = Controller::with_gains(axis, gains);
    assert_eq!(settings.try_build(DT_S), Ok(expected));
}

#[test]
fn prop_new_settings_end_a_fault_of_settings_and_no_other_that_stands() {
    use crate::control_task::ControlTask;
    use crate::fault::Fault;
    let controller = || random_settings(1).try_build(DT_S).expect("it is possible");
    for (fault, is_left) in [
        (Fault::SettingsDamaged, true),
        (Fault::SettingsImpossible, true),
        (Fault::ClockFailed, false),
    ] {
        let mut task = ControlTask::new(Settings::built_in().try_build(DT_S).expect("as well"));
        task.recall(fault.at(0));
        assert!(!task.acknowledge(), "{fault:?} stands");
        assert_eq!(
            task.replace_controller(controller(), &Connection::standard(Wiring::Checked)),
            Ok(())
        );
        assert_eq!(task.latched(), Some(fault.at(0)), "somebody has to see it");
        assert_eq!(task.acknowledge(), is_left, "{fault:?}");
    }
}

#[test]
fn prop_every_number_is_judged_by_its_name() {
    let mut count = 0;
    Settings::built_in().visit(&mut |_| count += 1);
    assert!(count > 96, "{count}");
    let build = |change: &dyn Fn(&mut Settings)| {
        let mut settings = Settings::built_in();
        change(&mut settings);
        settings.try_build(DT_S).err()
    };
    assert_eq!(
        build(&|one| one.carriage.mass_kg = 0.0),
        Some(SettingsFault::NonPositive("carriage.mass_kg"))
    );
    assert_eq!(
        build(&|one| one.carriage.mass_kg = f32::NAN),
        Some(SettingsFault::NotFinite("carriage.mass_kg"))
    );
    assert_eq!(
        build(&|one| one.chamber_b.dead_volume_m3 = f32::INFINITY),
        Some(SettingsFault::NotFinite("chamber_b.dead_volume_m3"))
    );
    let beyond = build(&|one| one.ambient.pressure_pa = 1.0);
    assert_eq!(
        beyond.map(|fault| fault.field()),
        Some("ambient.pressure_pa")
    );
    assert_eq!(
        build(&|one| one.valve.openings_v[1] = 0.0),
        Some(SettingsFault::Table(
            "valve.supply_areas_m2",
            TableFault::OpeningNotRising(1)
        ))
    );
    assert_eq!(
        build(&|one| one.valve.exhaust_areas_m2[2] = 0.0),
        Some(SettingsFault::Table(
            "valve.exhaust_areas_m2",
            TableFault::AreaNotRising(2)
        ))
    );
    let field = |change: &dyn Fn(&mut Settings)| build(change).map(|fault| fault.field());
    assert_eq!(
        field(&|one| one.friction_terms.coulomb_n = -21.0),
        Some("friction_terms.coulomb_n")
    );
    assert_eq!(
        field(&|one| one.valve.laminar_pressure_ratio = 0.28),
        Some("valve.laminar_pressure_ratio")
    );
    assert_eq!(
        field(&|one| one.command_path.delay_s = 0.063),
        Some("command_path.delay_s"),
        "longer than the line of past commands"
    );
    assert_eq!(field(&|one| one.command_path.delay_s = 0.061), None);
    assert_eq!(
        field(&|one| one.mechanical_effects.load_mass_kg = 1.95),
        Some("mechanical_effects.load_mass_kg"),
        "more than its share of the moving mass"
    );
    assert_eq!(
        field(&|one| one.mechanical_effects.dwell_rise_n = -1e3),
        Some("mechanical_effects.dwell_rise_n")
    );
    assert_eq!(
        field(&|one| {
            one.mechanical_effects.buffer_stiffness_n_per_m = 1e5;
            one.mechanical_effects.buffer_low_m = 0.01;
        }),
        Some("mechanical_effects.buffer_low_m")
    );
    assert_eq!(
        field(&|one| one.pneumatic_effects.tank_volume_m3 = -1e-3),
        Some("pneumatic_effects.tank_volume_m3")
    );
    assert_eq!(
        field(&|one| one.controller.position_per_s = 0.0),
        Some("controller.position_per_s")
    );
    assert_eq!(
        field(&|one| one.controller.observer_motion_per_s = 1001.0),
        Some("controller.observer_motion_per_s"),
        "beyond the rate of the tick"
    );
    assert_eq!(
        field(&|one| one.controller.lead_s = 0.063),
        Some("controller.lead_s"),
        "longer than the line of forces that are not due yet"
    );
    for dt_s in [0.0, -1e-3, f32::NAN, 1.0] {
        assert!(Settings::built_in().try_build(dt_s).is_err());
    }
}

#[test]
fn prop_what_passes_the_judgement_never_steps_to_infinity() {
    use model_core::axis::{AxisInputs, AxisState};
    for seed in 0..50 {
        let axis = random_settings(seed).axis(DT_S).expect("it is possible");
        let mut state = AxisState::at_rest(0.0, 5e5, 5e5, 293.15, 5.0);
        for tick in 0..200 {
            let command_v = if tick % 20 < 10 { 0.0 } else { 10.0 };
            let supply_pressure_pa = 7e5;
            axis.step(
                &mut state,
                &AxisInputs {
                    command_v,
                    supply_pressure_pa,
                },
            );
        }
        assert!(state.is_finite(), "{seed}");
    }
}

/// What is accepted is stepped: by the axis and by the controller, full to one side and the other.
fn stays_finite(settings: &Settings) -> bool {
    use model_core::axis::{AxisInputs, AxisState};
    use model_core::controller::Measurements;
    use model_core::reference::Reference;
    let (Ok(axis), Ok(controller)) = (settings.axis(DT_S), settings.try_build(DT_S)) else {
        return true;
    };
    let mut state = AxisState::at_rest(0.0, 5e5, 5e5, 293.15, 5.0);
    let mut measured = Measurements {
        position_m: 0.0,
        velocity_m_per_s: 0.0,
        pressure_a_pa: 5e5,
        pressure_b_pa: 5e5,
        supply_pressure_pa: 7e5,
    };
    let mut memory = controller.begin(&measured);
    (0..60).all(|tick| {
        let inputs = AxisInputs {
            command_v: if tick % 20 < 10 { 0.0 } else { 10.0 },
            supply_pressure_pa: 7e5,
        };
        axis.step(&mut state, &inputs);
        measured.position_m = 1e-3 * (tick % 7) as f32;
        let reference = Reference {
            position_m: 1e-3,
            velocity_m_per_s: 0.1,
            acceleration_m_per_s2: 1.0,
        };
        let action = controller.track(&mut memory, &measured, &reference);
        let mut estimates = action.estimate.to_array().into_iter();
        state.is_finite() && action.command_v.is_finite() && estimates.all(f32::is_finite)
    })
}

/// A number of a few bits that is written somewhere into sound settings.
fn changed(content: &[u8], place: usize, number: f32) -> Option<Settings> {
    let mut content = content.to_vec();
    let written = content.get_mut(place..place + 4)?;
    written.copy_from_slice(&number.to_le_bytes());
    super::record::decode_content(&content)
}

/// Numbers so small that what divides by them is infinite mean nothing, or are refused.
#[test]
fn prop_numbers_next_to_nothing_are_refused_or_neutral() {
    for settings in [Settings::built_in(), random_settings(1), random_settings(5)] {
        let content = encode_content(&settings).expect("it fits");
        for place in 0..content.len() {
            for tiny in [1e-38_f32, 1e-36, 1e-30, 1e-20, 1e-12, 1e-9] {
                let Some(settings) = changed(&content, place, tiny) else {
                    continue;
                };
                assert!(
                    stays_finite(&settings),
                    "{tiny} at byte {place}: {settings:?}"
                );
            }
        }
    }
}

/// Numbers of any size, some at once.
fn any_accepted_settings_stay_finite(count: u64) {
    let content = encode_content(&random_settings(4)).expect("it fits");
    let mut random = Random(7);
    for trial in 0..count {
        let mut content = content.to_vec();
        for _ in 0..1 + random.next() % 3 {
            let place = (random.next() as usize) % (content.len() - 4);
            let exponent = -30.0 + 40.0 * random.share();
            let sign = if random.next().is_multiple_of(4) {
                -1.0
            } else {
                1.0
            };
            let number = sign * 10.0_f32.powf(exponent);
            content[place..place + 4].copy_from_slice(&number.to_le_bytes());
        }
        if let Some(settings) = super::record::decode_content(&content) {
            assert!(stays_finite(&settings), "trial {trial}: {settings:?}");
        }
    }
}

#[test]
fn prop_whatever_is_accepted_stays_finite() {
    any_accepted_settings_stay_finite(20_000);
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn prop_a_million_settings_stay_finite() {
    any_accepted_settings_stay_finite(1_000_000);
}

#[test]
fn prop_effects_at_the_ends_of_their_ranges_never_step_to_infinity() {
    use model_core::axis::{AxisInputs, AxisState};
    type Change = fn(&mut Settings);
    let changes: [Change; 16] = [
        |one| one.pneumatic_effects.piston_leak_laminar_kg_per_s_pa2 = 1e-9,
        |one| one.pneumatic_effects.piston_leak_orifice_m2 = 1e-3,
        |one| one.pneumatic_effects.tank_volume_m3 = 1e-12,
        |one| one.pneumatic_effects.silencer_area_m2 = 1e-9,
        |one| {
            one.pneumatic_effects.silencer_area_m2 = 0.1;
            one.pneumatic_effects.silencer_volume_m3 = 0.0;
        },
        |one| {
            one.pneumatic_effects.cushion_length_m = 2.0;
            one.pneumatic_effects.cushion_needle_m2 = 1e-9;
        },
        |one| {
            one.pneumatic_effects.throttle_a_m2 = 1e-9;
            one.pneumatic_effects.throttle_b_m2 = 0.1;
        },
        |one| one.pneumatic_effects.heat_density_exponent = 4.0,
        |one| {
            one.pneumatic_effects.wall_heat_capacity_j_per_k = 1e-3;
            one.pneumatic_effects.wall_outer_w_per_k = 1e6;
            one.pneumatic_effects.wall_offset_k = -100.0;
        },
        |one| one.mechanical_effects.position_curvature_per_m2 = 1e4,
        |one| {
            one.mechanical_effects.position_cosine = -10.0;
            one.mechanical_effects.position_wavelength_m = 1e-3;
        },
        |one| {
            one.mechanical_effects.zone_share = 100.0;
            one.mechanical_effects.zone_length_m = 1e-3;
        },
        |one| one.mechanical_effects.direction_asymmetry = -0.95,
        |one| {
            one.mechanical_effects.dwell_rise_n = 1e5;
            one.mechanical_effects.dwell_time_constant_s = 1e-3;
        },
        |one| {
            one.mechanical_effects.load_mass_kg = 0.95 * one.carriage.mass_kg;
            one.mechanical_effects.load_stiffness_n_per_m = 1e10;
            one.mechanical_effects.load_damping_n_s_per_m = 1e7;
            one.mechanical_effects.load_gap_m = 0.1;
        },
        |one| {
            one.mechanical_effects.buffer_stiffness_n_per_m = 1e10;
            one.mechanical_effects.buffer_damping_n_s_per_m = 1e7;
        },
    ];
    for (number, change) in changes.into_iter().enumerate() {
        for tube_m in [0.0, 0.5] {
            let mut settings = Settings::built_in();
            settings.tube.length_m = tube_m;
            change(&mut settings);
            let axis = settings.axis(DT_S).expect("it is possible");
            let mut state = AxisState::at_rest(0.1, 5e5, 5e5, 293.15, 5.0);
            for tick in 0..1000 {
                let inputs = AxisInputs {
                    command_v: if tick % 50 < 25 { 0.0 } else { 10.0 },
                    supply_pressure_pa: 7e5,
                };
                axis.step(&mut state, &inputs);
            }
            assert!(state.is_finite(), "change {number}: {state:?}");
        }
    }
}

const SLOT_BYTES: usize = LEAST_SLOT_BYTES + 64;

const WORD_BYTES: usize = 4;

/// Two sectors of flash. Erasing sets the bits of a sector, in no order;
/// programming clears bits, word by word. When the power goes, the operation
/// under way is torn: any of its bits may have changed.
#[derive(Clone)]
struct Flash {
    slots: [[u8; SLOT_BYTES]; 2],
    steps_until_power_is_lost: Option<usize>,
    random: u64,
    refuses: bool,
}

#[derive(PartialEq)]
enum Power {
    On,
    Failing,
    Off,
}

impl Flash {
    fn blank() -> Self {
        Self {
            slots: [[0xFF; SLOT_BYTES]; 2],
            steps_until_power_is_lost: None,
            random: 0,
            refuses: false,
        }
    }

    fn power(&mut self) -> Power {
        match &mut self.steps_until_power_is_lost {
            None => Power::On,
            Some(0) => Power::Off,
            Some(left) => {
                *left -= 1;
                if *left == 0 {
                    Power::Failing
                } else {
                    Power::On
                }
            }
        }
    }

    /// Takes on the wanted bytes, or some of their bits when the power fails.
    fn write(&mut self, slot: Slot, offset: usize, wanted: &[u8]) -> Result<(), StorageFault> {
        let power = self.power();
        let mut random = Random(self.random);
        let bytes = &mut self.slots[slot as usize][offset..offset + wanted.len()];
        for (byte, wanted) in bytes.iter_mut().zip(wanted) {
            *byte ^= (*byte ^ wanted)
                & match power {
                    Power::On => 0xFF,
                    Power::Failing => random.next() as u8,
                    Power::Off => 0,
                };
        }
        if power == Power::On {
            Ok(())
        } else {
            Err(StorageFault)
        }
    }
}

impl SlotStorage for Flash {
    fn bytes(&self, slot: Slot) -> &[u8] {
        &self.slots[slot as usize]
    }

    fn erase(&mut self, slot: Slot) -> Result<(), StorageFault> {
        self.write(slot, 0, &[0xFF; SLOT_BYTES])
    }

    fn program(&mut self, slot: Slot, offset: usize, bytes: &[u8]) -> Result<(), StorageFault> {
        assert!(
            offset.is_multiple_of(PROGRAM_UNIT_BYTES)
                && bytes.len().is_multiple_of(PROGRAM_UNIT_BYTES)
        );
        if self.refuses {
            return Err(StorageFault);
        }
        for (place, word) in bytes.chunks(WORD_BYTES).enumerate() {
            let at = offset + place * WORD_BYTES;
            let present = &self.slots[slot as usize][at..at + WORD_BYTES];
            let cleared: Vec<u8> = present.iter().zip(word).map(|(a, b)| a & b).collect();
            self.write(slot, at, &cleared)?;
        }
        Ok(())
    }
}

fn start(flash: Flash) -> (Slots<Flash>, Controller<f32>, Origin) {
    let (slots, mut start) = Slots::start(flash);
    let controller = start.build(DT_S).expect("a tick of 1 ms");
    (slots, controller, start.origin)
}

fn content_of(settings: &Settings) -> Content {
    encode_content(settings).expect("it fits")
}

/// A board that starts, stores and is switched off.
fn stored(flash: Flash, settings: &Settings) -> (Flash, Result<(), StoreFault>) {
    let (mut slots, _, _) = start(flash);
    if slots.prepare().is_err() {
        return (slots.into_storage(), Err(StoreFault::Storage));
    }
    let outcome = slots.store(&content_of(settings));
    (slots.into_storage(), outcome)
}

#[test]
fn prop_the_newest_settings_are_taken() {
    let (_, _, origin) = start(Flash::blank());
    assert_eq!(origin, Origin::NeverSet);
    let mut flash = Flash::blank();
    for seed in 0..7 {
        let settings = random_settings(seed);
        let outcome;
        (flash, outcome) = stored(flash, &settings);
        assert_eq!(outcome, Ok(()));
        let (_, controller, origin) = start(flash.clone());
        let slot = if seed % 2 == 0 {
            Slot::First
        } else {
            Slot::Second
        };
        assert_eq!(origin, Origin::Slot(slot));
        assert_eq!(Ok(controller), settings.try_build(DT_S));
    }
}

#[test]
fn prop_the_newest_is_known_when_the_numbers_go_round() {
    let (old, new) = (random_settings(1), random_settings(2));
    let mut flash = Flash::blank();
    let write = |slot: &mut [u8; SLOT_BYTES], sequence, settings| {
        let record = encode(sequence, settings).expect("it fits");
        slot[..record.len()].copy_from_slice(&record);
    };
    write(&mut flash.slots[0], u32::MAX, &old);
    write(&mut flash.slots[1], 0, &new);
    let (_, controller, origin) = start(flash);
    assert_eq!(origin, Origin::Slot(Slot::Second));
    assert_eq!(Ok(controller), new.try_build(DT_S));
}

#[test]
fn prop_power_lost_at_any_step_leaves_settings() {
    let (old, new) = (random_settings(1), random_settings(2));
    let (flash, outcome) = stored(Flash::blank(), &random_settings(0));
    assert_eq!(outcome, Ok(()));
    let (flash, outcome) = stored(flash, &old);
    assert_eq!(outcome, Ok(()));
    let old_controller = old.try_build(DT_S).expect("it is possible");
    let new_controller = new.try_build(DT_S).expect("it is possible");
    let mut was_completed = false;
    for steps in 1.. {
        for random in 0..64 {
            let mut failing = flash.clone();
            failing.steps_until_power_is_lost = Some(steps);
            failing.random = random;
            let (mut after, outcome) = stored(failing, &new);
            after.steps_until_power_is_lost = None;
            let (_, controller, origin) = start(after.clone());
            assert!(origin.is_of_this_rig(), "{steps} steps: {origin:?}");
            let is_new = controller == new_controller;
            assert!(is_new || controller == old_controller, "{steps} steps");
            assert!(is_new || outcome.is_err(), "{steps} steps");
            was_completed |= outcome.is_ok();
            // And the board goes on from there.
            let (after, outcome) = stored(after, &new);
            assert_eq!(outcome, Ok(()), "{steps} steps");
            assert!(start(after).1 == new_controller);
        }
        if was_completed {
            assert!(steps > 50, "{steps}");
            break;
        }
    }
    assert!(was_completed);
}

#[test]
fn prop_both_slots_bad_give_the_built_in_settings_and_say_so() {
    let (flash, _) = stored(Flash::blank(), &random_settings(0));
    let (mut flash, _) = stored(flash, &random_settings(1));
    flash.slots[0][100] ^= 1;
    let (_, _, origin) = start(flash.clone());
    assert_eq!(origin, Origin::Slot(Slot::Second), "one is enough");
    let (mut newest_bad, _) = stored(Flash::blank(), &random_settings(0));
    (newest_bad, _) = stored(newest_bad, &random_settings(1));
    newest_bad.slots[1][200] ^= 1;
    let (_, controller, origin) = start(newest_bad);
    assert_eq!(origin, Origin::Older(Slot::First, RecordFault::Crc));
    assert_eq!(origin.finding(), Some(Fault::SettingsDamaged.at(1)));
    assert_eq!(Ok(controller), random_settings(0).try_build(DT_S));
    flash.slots[1][200] ^= 1;
    let (_, controller, origin) = start(flash.clone());
    assert_eq!(origin, Origin::Damaged(RecordFault::Crc));
    assert!(!origin.is_of_this_rig());
    assert_eq!(Ok(controller), Settings::built_in().try_build(DT_S));
    let (flash, outcome) = stored(flash, &random_settings(5));
    assert_eq!(outcome, Ok(()), "it can be mended");
    assert!(start(flash).2.is_of_this_rig());
}

#[test]
fn prop_impossible_settings_in_a_slot_are_not_used() {
    let mut settings = random_settings(0);
    settings.carriage.mass_kg = -1.0;
    let (flash, outcome) = stored(Flash::blank(), &settings);
    assert_eq!(outcome, Ok(()));
    let (_, controller, origin) = start(flash);
    let fault = SettingsFault::NonPositive("carriage.mass_kg");
    assert_eq!(origin, Origin::Impossible(fault));
    assert_eq!(Ok(controller), Settings::built_in().try_build(DT_S));
}

#[test]
fn prop_a_second_storing_waits_for_a_start() {
    let (mut slots, _, _) = start(stored(Flash::blank(), &random_settings(0)).0);
    assert_eq!(slots.store(&content_of(&random_settings(1))), Ok(()));
    let outcome = slots.store(&content_of(&random_settings(2)));
    assert_eq!(outcome, Err(StoreFault::NotErased));
    let (_, controller, _) = start(slots.into_storage());
    assert_eq!(Ok(controller), random_settings(1).try_build(DT_S));
}

#[test]
fn prop_a_void_of_the_wiring_outlasts_the_power() {
    let checked = |seed| Settings {
        wiring: Wiring::Checked,
        ..random_settings(seed)
    };
    let wiring = |flash: &Flash| Slots::start(flash.clone()).1.connection().wiring;
    let (flash, _) = stored(Flash::blank(), &checked(0));
    assert_eq!(wiring(&flash), Wiring::Checked);
    for steps in 1..=2 * PROGRAM_UNIT_BYTES {
        for random in 0..32 {
            let mut failing = flash.clone();
            failing.steps_until_power_is_lost = Some(steps);
            failing.random = random;
            let (mut slots, _) = Slots::start(failing);
            let outcome = slots.void_wiring();
            let mut after = slots.into_storage();
            after.steps_until_power_is_lost = None;
            // Cut off it may not have begun; whatever is left of it counts.
            let is_untouched = after.slots == flash.slots;
            assert_eq!(wiring(&after) == Wiring::Checked, is_untouched, "{steps}");
            assert!(outcome.is_err() || !is_untouched, "{steps}");
            // The settings are there all the same, and the mark is made only once.
            assert!(start(after.clone()).2.is_of_this_rig());
            let (mut slots, _) = Slots::start(after);
            assert_eq!(slots.void_wiring(), Ok(()));
            assert_eq!(wiring(&slots.into_storage()), Wiring::Unchecked);
        }
    }
    // New settings, of an axis that was checked since, end it.
    let (mut slots, _) = Slots::start(flash);
    assert_eq!(slots.void_wiring(), Ok(()));
    let (flash, outcome) = stored(slots.into_storage(), &checked(1));
    assert_eq!(outcome, Ok(()));
    assert_eq!(wiring(&flash), Wiring::Checked);
}

/// A board at one end of a wire.
struct Board {
    transfer: Transfer,
    slots: Slots<Flash>,
    at_rest: bool,
    in_use: Option<Controller<f32>>,
}

impl Board {
    fn new() -> Self {
        Self {
            transfer: Transfer::new(DT_S),
            slots: start(Flash::blank()).0,
            at_rest: true,
            in_use: None,
        }
    }

    fn serve(&mut self, payload: &[u8]) -> (Verdict, std::string::String) {
        let (at_rest, in_use) = (self.at_rest, &mut self.in_use);
        let install = |controller, _: &Connection| {
            if at_rest {
                *in_use = Some(controller);
                Ok(())
            } else {
                Err(NotAtRest)
            }
        };
        let answer = self.transfer.serve(payload, &mut self.slots, install);
        let answer = answer.expect("it is about settings");
        let Answer {
            kind,
            verdict,
            field,
            ..
        } = read_answer(&answer).expect("it is an answer");
        assert_eq!(kind, payload[0]);
        (verdict, field.into())
    }

    fn send(&mut self, settings: &Settings) -> Vec<Verdict> {
        let content = encode_content(settings).expect("it fits");
        let mut verdicts = std::vec![self.serve(&transfer::begin(&content)).0];
        let mut offset = 0;
        while let Some(chunk) = transfer::chunk(&content, offset) {
            verdicts.push(self.serve(&chunk).0);
            offset += LONGEST_CHUNK;
        }
        verdicts
    }
}

#[test]
fn prop_what_is_sent_is_used_and_kept() {
    let mut board = Board::new();
    let settings = full_settings();
    let verdicts = board.send(&settings);
    assert!(verdicts.len() > 4 && verdicts.iter().all(|one| *one == Verdict::Taken));
    assert_eq!(board.in_use, None, "not before the commit");
    assert_eq!(board.serve(&transfer::commit()).0, Verdict::Taken);
    let controller = settings.try_build(DT_S).expect("it is possible");
    assert_eq!(board.in_use, Some(controller));
    assert_eq!(board.serve(&transfer::commit()).0, Verdict::Taken, "again");
    let (_, kept, _) = start(board.slots.into_storage());
    assert_eq!(kept, controller);
}

#[test]
fn prop_a_refused_transfer_leaves_all_as_it_was() {
    let is_untouched = |board: Board| {
        let (_, _, origin) = start(board.slots.into_storage());
        board.in_use.is_none() && origin == Origin::NeverSet
    };
    let commit = transfer::commit();

    let mut moving = Board::new();
    moving.at_rest = false;
    moving.send(&random_settings(0));
    assert_eq!(moving.serve(&commit).0, Verdict::NotAtRest);
    assert!(is_untouched(moving));

    let mut settings = random_settings(0);
    settings.carriage.mass_kg = 0.0;
    let mut impossible = Board::new();
    impossible.send(&settings);
    let answer = impossible.serve(&commit);
    assert_eq!(answer, (Verdict::Impossible, "carriage.mass_kg".into()));
    assert!(is_untouched(impossible));

    let content = encode_content(&random_settings(0)).expect("it fits");
    let mut early = Board::new();
    assert_eq!(early.serve(&commit).0, Verdict::NotBegun);
    let first = transfer::chunk(&content, 0).expect("it is there");
    assert_eq!(early.serve(&first).0, Verdict::NotBegun);
    early.serve(&transfer::begin(&content));
    early.serve(&first);
    let later = transfer::chunk(&content, 2 * LONGEST_CHUNK).or(transfer::chunk(&content, 201));
    let later = later.expect("it is there");
    assert_eq!(early.serve(&later).0, Verdict::WrongOffset);
    assert_eq!(early.serve(&first).0, Verdict::Taken, "sent again");
    assert_eq!(early.serve(&commit).0, Verdict::Incomplete);
    assert_eq!(early.serve(&[commit[0], 9]).0, Verdict::Malformed);
    assert!(is_untouched(early));

    let mut damaged = content.clone();
    damaged[30] ^= 4;
    let mut board = Board::new();
    board.serve(&transfer::begin(&content));
    for offset in (0..damaged.len()).step_by(LONGEST_CHUNK) {
        board.serve(&transfer::chunk(&damaged, offset).expect("it is there"));
    }
    assert_eq!(board.serve(&commit).0, Verdict::WrongCrc);
    assert!(is_untouched(board));
}

#[test]
fn prop_announcements_of_another_version_or_too_long_are_refused() {
    let mut board = Board::new();
    let mut other = transfer::begin(&encode_content(&random_settings(0)).expect("it fits"));
    let mut long = other.clone();
    other[1] = 77;
    long[4] = 0xFF;
    assert_eq!(board.serve(&other).0, Verdict::WrongVersion);
    assert_eq!(board.serve(&long).0, Verdict::TooLong);
    assert_eq!(board.serve(&other[..5]).0, Verdict::Malformed);
}

#[test]
fn prop_in_use_but_not_stored_is_said() {
    let mut board = Board::new();
    board.send(&random_settings(0));
    assert_eq!(board.serve(&transfer::commit()).0, Verdict::Taken);
    board.send(&random_settings(1));
    let spare_was_blank = board.serve(&transfer::commit()).0;
    assert_eq!(spare_was_blank, Verdict::Taken);
    board.send(&random_settings(2));
    assert_eq!(board.serve(&transfer::commit()).0, Verdict::InUseNotErased);
    assert_eq!(board.in_use, random_settings(2).try_build(DT_S).ok());

    let mut refusing = Board::new();
    let mut flash = Flash::blank();
    flash.refuses = true;
    refusing.slots = start(flash).0;
    refusing.send(&random_settings(0));
    assert_eq!(
        refusing.serve(&transfer::commit()).0,
        Verdict::InUseNotStored
    );
}

/// What is only tried is in use, and neither slot has it.
#[test]
fn prop_what_is_tried_out_is_not_stored() {
    let mut board = Board::new();
    board.send(&random_settings(0));
    assert_eq!(board.serve(&transfer::commit()).0, Verdict::Taken);
    for number in 1..4 {
        board.send(&random_settings(number));
        assert_eq!(board.serve(&transfer::try_out()).0, Verdict::Taken);
        assert_eq!(board.in_use, random_settings(number).try_build(DT_S).ok());
    }
    board.send(&random_settings(9));
    assert_eq!(
        board.serve(&transfer::commit()).0,
        Verdict::Taken,
        "there was room"
    );
}

#[test]
fn prop_other_frames_are_left_to_others() {
    let mut board = Board::new();
    for kind in [0x02, 0x10, 0x23, 0x30] {
        let answer = board
            .transfer
            .serve(&[kind, 0, 0], &mut board.slots, |_, _| Ok(()));
        assert_eq!(answer, None);
    }
}
