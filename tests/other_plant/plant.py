"""A simulated servo-pneumatic axis, written from the physics dossier alone.

The gas is a network of nodes (chambers, tube cells, supply, exhaust) that hold mass and internal energy; every flow
takes mass and enthalpy from one node and gives both to another, so both are conserved by construction. The two ideal
reservoirs are nodes that are refilled after each step, and what they needed is booked. Tubes are finite volumes with
the inertia and wall friction of the gas between two cells. The carriage slides on LuGre friction, with the bristle
solved exactly at a frozen speed (the dossier A.6).

Position is measured from mid-stroke, +x enlarges chamber A, pressures are absolute, all units SI.
Neglected: the momentum that gas carries along a tube, heat conducted between nodes, real-gas effects.
`check.py` measures conservation, step halving and the agreement with the equations of the dossier.
"""

from math import exp, pi, sin, sqrt, tanh
from typing import NamedTuple

import numpy as np
from numba import njit

# Numpy's error model: no branch for a division by zero, which validated numbers cannot cause.
compiled = njit(cache=True, error_model="numpy")

GAMMA = 1.4
GAS_CONSTANT = 287.0
HEAT_CAPACITY_V = GAS_CONSTANT / (GAMMA - 1.0)
HEAT_CAPACITY_P = GAMMA * HEAT_CAPACITY_V
FLOW_CONSTANT = sqrt(GAMMA / GAS_CONSTANT * (2.0 / (GAMMA + 1.0)) ** ((GAMMA + 1.0) / (GAMMA - 1.0)))
AMBIENT_PA = 101325.0
AMBIENT_K = 293.15
AIR_VISCOSITY_PA_S = 1.82e-5  # at 293 K

ROW_S = 1e-3
STEPS_PER_ROW = 50  # 20 us: a quarter of the shortest time in the plant, sound through a tube cell of 30 mm
CONTROL_FORGET = ROW_S / 0.15  # the controller takes the pressure difference of the last 0.15 s as the load
COMMAND_STEP_V = 10.0 / 4095.0  # 12-bit converter over 0-10 V
PLENUM_M3 = 3e-5  # between valve and silencer, dossier P11: about 20 cm3
TANK_W_K = 4.0  # a tank and a plenum of metal: gas follows the wall within a second
PLENUM_W_K = 0.5
TUBE_W_M2K = 60.0  # fast gas in a narrow tube; the upper half of dossier P13
STOP_N_M, STOP_NS_M = 2e6, 2e3  # dossier M11: 1e6 to 1e7 N/m
REST_FORGET_M = 1e-4  # a contact is renewed after sliding a few asperities
MOUNT_LAG_S = 4e-3

TUBE_CELLS = 5
CHAMBER_A, CHAMBER_B, SUPPLY, EXHAUST, REGULATOR, AMBIENT, POCKET, TUBE_A = range(8)
TUBE_B = TUBE_A + TUBE_CELLS
NODES = TUBE_B + TUBE_CELLS


class Plant(NamedTuple):
    """True numbers of a rig; below the line the left-out physics, each neutral by default."""

    supply_pressure_pa: float
    null_v: float
    feeds_a_sign: float  # +1: a command above null feeds A
    critical_ratio: float
    laminar_ratio: float
    stroke_m: float
    bore_m: float
    area_m2: float
    dead_volume_a_m3: float
    dead_volume_b_m3: float
    heat_charging_w_m2k: float
    heat_discharging_w_m2k: float
    mass_kg: float
    viscous_ns_m: float
    coulomb_n: float
    static_n: float
    stribeck_m_s: float
    bristle_stiffness_n_m: float
    bristle_damping_ns_m: float
    tank_volume_m3: float
    # valve-command
    delay_s: float = 0.0
    hysteresis_v: float = 0.0
    slew_v_s: float = 0.0
    spool_hz: float = 0.0
    spool_damping: float = 0.0
    hum_v: float = 0.0
    hum_hz: float = 50.0
    compression_v: float = 0.0
    # valve-flow, supply, exhaust
    tube_length_m: float = 0.0
    tube_diameter_m: float = 0.004
    flow_force_1_pa: float = 0.0
    area_loss_ratio: float = 0.0
    area_loss_s: float = 1.0
    feed_area_m2: float = 0.0
    supply_pulse_pa: float = 0.0
    supply_pulse_hz: float = 0.0
    silencer_area_m2: float = 0.0
    exhaust_pulse_pa: float = 0.0
    exhaust_pulse_hz: float = 0.0
    # chambers
    piston_leak_m2: float = 0.0
    chamber_leak_a_m2: float = 0.0
    chamber_leak_b_m2: float = 0.0
    heat_density_exponent: float = 0.0
    heat_flow_w_m2k: float = 0.0
    wall_excess_k: float = 0.0
    cushion_length_m: float = 0.0
    cushion_area_m2: float = 0.0
    pocket_volume_m3: float = 0.0
    pocket_area_m2: float = 0.0
    # force-balance
    friction_per_mean_n_pa: float = 0.0
    friction_per_difference_n_pa: float = 0.0
    position_ratio: float = 0.0
    position_wavelength_m: float = 1.0
    position_phase_rad: float = 0.0
    direction_ratio: float = 0.0
    dwell_n: float = 0.0
    dwell_s: float = 1.0
    warm_up_ratio: float = 0.0
    warm_up_m: float = 1.0
    external_force_n: float = 0.0
    load_mass_kg: float = 0.0
    load_stiffness_n_m: float = 0.0
    load_damping_ns_m: float = 0.0
    load_gap_m: float = 0.0
    cable_n: float = 0.0
    bumper_n_m: float = 0.0
    bumper_start_m: float = 0.0
    brake_ns_m: float = 0.0
    brake_peak_m_s: float = 1.0
    # sensors
    gauge_lag_s: float = 0.0
    gauge_offset_a_pa: float = 0.0
    gauge_offset_b_pa: float = 0.0
    gauge_bow_a_pa: float = 0.0
    gauge_ringing_hz: float = 0.0
    position_skew_s: float = 0.0
    velocity_filter_s: float = 0.0
    scale_error_m: float = 0.0
    scale_period_m: float = 1.0
    mount_stiffness_n_m: float = 0.0


class Control(NamedTuple):
    """The simple controller: position, speed and pressure feedback over a dead-zone jump."""

    null_v: float
    feeds_a_sign: float
    position_v_m: float
    speed_v_s_m: float
    pressure_v_pa: float
    dead_zone_v: float
    tolerance_m: float


STATE_FIELDS = (
    "time_s x v bristle rest warm load_x load_v played slewed spool spool_rate area_loss throughput "
    "read_a read_a_rate read_b read_b_rate read_v mount mount_rate slow_difference_pa "
    "booked_kg booked_j heat_j gas_work_j friction_j stop_j"
)
STATE = np.dtype([(name, "f8") for name in STATE_FIELDS.split()])


@compiled
def swing(amplitude, frequency_hz, time_s):
    """A sine, free of cost where there is none."""
    return amplitude * sin(2.0 * pi * frequency_hz * time_s) if amplitude != 0.0 else 0.0


@compiled
def flow_ratio(r, critical, laminar):
    """Flow over choked flow, dossier A.1."""
    if r <= critical:
        return 1.0
    q = (min(r, laminar) - critical) / (1.0 - critical)
    ellipse = sqrt(1.0 - q * q)
    return ellipse if r < laminar else ellipse * (1.0 - r) / (1.0 - laminar)


@compiled
def orifice_kg_s(plant, area_m2, p, k, source, sink):
    """Mass flow from one node to another, negative when it runs back; A.1 and A.2."""
    if area_m2 == 0.0:
        return 0.0
    up, down = (source, sink) if p[source] >= p[sink] else (sink, source)
    r = p[down] / p[up]
    discharge = 0.8153 + 0.0933 * r - 0.1038 * r * r
    choked = area_m2 * discharge * FLOW_CONSTANT * p[up] / sqrt(k[up])
    flow = choked * flow_ratio(r, plant.critical_ratio, plant.laminar_ratio)
    return flow if up == source else -flow


@compiled
def move_gas(mass, energy, k, flow_kg_s, source, sink, dt_s):
    """Carries mass and the enthalpy of the upstream gas across a path."""
    if flow_kg_s == 0.0:
        return
    moved = flow_kg_s * dt_s
    enthalpy = moved * HEAT_CAPACITY_P * (k[source] if flow_kg_s >= 0.0 else k[sink])
    mass[source] -= moved
    mass[sink] += moved
    energy[source] -= enthalpy
    energy[sink] += enthalpy


@compiled
def warm_gas(s, energy, k, node, conductance_w_k, wall_k, dt_s):
    """Heat from a wall."""
    heat = conductance_w_k * (wall_k - k[node]) * dt_s
    energy[node] += heat
    s.heat_j += heat


@compiled
def pin(s, mass, energy, volume, node, pressure_pa):
    """Refills an ideal reservoir and books what it took."""
    full_kg = pressure_pa * volume[node] / (GAS_CONSTANT * AMBIENT_K)
    full_j = pressure_pa * volume[node] / (GAMMA - 1.0)
    s.booked_kg += full_kg - mass[node]
    s.booked_j += full_j - energy[node]
    mass[node], energy[node] = full_kg, full_j


@compiled
def pin_reservoirs(plant, s, mass, energy, volume):
    """The regulator and the room; supply and exhaust too unless they are starved or throttled."""
    supply = plant.supply_pressure_pa + swing(plant.supply_pulse_pa, plant.supply_pulse_hz, s.time_s)
    # Another machine vents into the same manifold: half-waves.
    exhaust = AMBIENT_PA + max(0.0, swing(plant.exhaust_pulse_pa, plant.exhaust_pulse_hz, s.time_s))
    pin(s, mass, energy, volume, REGULATOR, supply)
    pin(s, mass, energy, volume, AMBIENT, AMBIENT_PA)
    if plant.feed_area_m2 == 0.0:
        pin(s, mass, energy, volume, SUPPLY, supply)
    if plant.silencer_area_m2 == 0.0:
        pin(s, mass, energy, volume, EXHAUST, exhaust)


@compiled
def gas_state(mass, energy, volume, p, k, all_nodes):
    """Pressure and temperature of every node, of the tubes' where there are tubes."""
    for node in range(NODES if all_nodes else TUBE_A):
        p[node] = (GAMMA - 1.0) * energy[node] / volume[node]
        k[node] = energy[node] / (mass[node] * HEAT_CAPACITY_V)


@compiled
def set_chamber_volumes(plant, s, volume):
    """Geometry (4)."""
    volume[CHAMBER_A] = plant.dead_volume_a_m3 + plant.area_m2 * (0.5 * plant.stroke_m + s.x)
    volume[CHAMBER_B] = plant.dead_volume_b_m3 + plant.area_m2 * (0.5 * plant.stroke_m - s.x)


@compiled
def set_volumes(plant, s, volume):
    """Volumes of all nodes at the piston's place."""
    set_chamber_volumes(plant, s, volume)
    volume[SUPPLY] = plant.tank_volume_m3
    volume[EXHAUST] = PLENUM_M3
    volume[REGULATOR] = volume[AMBIENT] = 1e-3  # refilled each step: any size does
    volume[POCKET] = max(plant.pocket_volume_m3, 1e-5)
    # Without a tube its cells are idle; they keep a volume so that every node has a state.
    cell = max(plant.tube_length_m, 0.1) / TUBE_CELLS * 0.25 * pi * plant.tube_diameter_m**2
    volume[TUBE_A:] = cell


@compiled
def move_spool(plant, s, command_v, dt_s):
    """From the delayed command to the opening, positive where A is fed."""
    hum = swing(plant.hum_v, plant.hum_hz, s.time_s)
    wanted = plant.feeds_a_sign * (command_v + hum - plant.null_v)
    if plant.compression_v > 0.0:
        wanted = plant.compression_v * tanh(wanted / plant.compression_v)
    half = 0.5 * plant.hysteresis_v
    s.played = min(max(s.played, wanted - half), wanted + half)
    change = s.played - s.slewed
    if plant.slew_v_s > 0.0:
        change = min(max(change, -plant.slew_v_s * dt_s), plant.slew_v_s * dt_s)
    s.slewed += change
    if plant.spool_hz == 0.0:
        s.spool, s.spool_rate = s.slewed, 0.0
        return
    omega = 2.0 * pi * plant.spool_hz
    s.spool_rate += dt_s * (omega * omega * (s.slewed - s.spool) - 2.0 * plant.spool_damping * omega * s.spool_rate)
    s.spool += dt_s * s.spool_rate


@compiled
def throttled(area_m2, needle_m2):
    """Two orifices in a row, by their areas."""
    return area_m2 * needle_m2 / sqrt(area_m2 * area_m2 + needle_m2 * needle_m2)


@compiled
def table_areas(table, opening_v):
    """Supply and exhaust area, linear between the table's points and constant beyond."""
    last = table.shape[1] - 1
    if opening_v >= table[0, last]:
        return table[1, last], table[2, last]
    i = 1
    while table[0, i] <= opening_v:
        i += 1
    part = (opening_v - table[0, i - 1]) / (table[0, i] - table[0, i - 1])
    fed = table[1, i - 1] + part * (table[1, i] - table[1, i - 1])
    return fed, table[2, i - 1] + part * (table[2, i] - table[2, i - 1])


@compiled
def port_areas(plant, table, s, fed_drop_pa):
    """Areas supply-A, A-exhaust, supply-B, B-exhaust at the spool's place."""
    # Jet forces pull the spool shut in proportion to the drop over its edge.
    opening = s.spool / (1.0 + plant.flow_force_1_pa * max(fed_drop_pa, 0.0))
    fed, vented = table_areas(table, abs(opening))
    shut_fed, shut_vented = table[1, 0], table[2, 0]
    left = 1.0 - plant.area_loss_ratio * s.area_loss
    if opening >= 0.0:
        return fed * left, shut_vented, shut_fed, vented * left
    return shut_fed, vented * left, fed * left, shut_vented


@compiled
def cushioned(plant, area_m2, room_m):
    """An exhaust area within a cushion's length of the end it protects."""
    if plant.cushion_length_m == 0.0 or room_m > plant.cushion_length_m:
        return area_m2
    return throttled(area_m2, plant.cushion_area_m2)


@compiled
def valve_step(plant, table, s, mass, energy, p, k, port_a, port_b, dt_s):
    """Flows through the four edges of the spool."""
    fed_port = port_a if s.spool >= 0.0 else port_b
    supply_a, a_exhaust, supply_b, b_exhaust = port_areas(plant, table, s, p[SUPPLY] - p[fed_port])
    a_exhaust = cushioned(plant, a_exhaust, 0.5 * plant.stroke_m + s.x)
    b_exhaust = cushioned(plant, b_exhaust, 0.5 * plant.stroke_m - s.x)
    fill_a = orifice_kg_s(plant, supply_a, p, k, SUPPLY, port_a)
    vent_a = orifice_kg_s(plant, a_exhaust, p, k, port_a, EXHAUST)
    fill_b = orifice_kg_s(plant, supply_b, p, k, SUPPLY, port_b)
    vent_b = orifice_kg_s(plant, b_exhaust, p, k, port_b, EXHAUST)
    move_gas(mass, energy, k, fill_a, SUPPLY, port_a, dt_s)
    move_gas(mass, energy, k, vent_a, port_a, EXHAUST, dt_s)
    move_gas(mass, energy, k, fill_b, SUPPLY, port_b, dt_s)
    move_gas(mass, energy, k, vent_b, port_b, EXHAUST, dt_s)
    s.throughput = abs(fill_a) + abs(vent_a) + abs(fill_b) + abs(vent_b)
    return fill_a - vent_a, fill_b - vent_b


@compiled
def wall_drag_1_s(flow_kg_s, density_kg_m3, diameter_m):
    """Pressure lost to the wall per metre and unit of flow, as a rate: laminar or Blasius, the larger."""
    section = 0.25 * pi * diameter_m**2
    speed = abs(flow_kg_s) / (density_kg_m3 * section)
    laminar = 32.0 * AIR_VISCOSITY_PA_S / (density_kg_m3 * diameter_m**2)
    reynolds = density_kg_m3 * speed * diameter_m / AIR_VISCOSITY_PA_S
    return laminar if reynolds < 1187.0 else 0.158 * reynolds**-0.25 * speed / diameter_m  # equal at 1187


@compiled
def tube_step(plant, s, mass, energy, volume, p, k, flows, first, chamber, dt_s):
    """Advances the gas between the cells of one tube; returns the flow into the chamber."""
    cell_m = plant.tube_length_m / TUBE_CELLS
    section = 0.25 * pi * plant.tube_diameter_m**2
    conductance = TUBE_W_M2K * pi * plant.tube_diameter_m * cell_m
    for i in range(TUBE_CELLS):
        here = first + i
        ahead = here + 1 if i + 1 < TUBE_CELLS else chamber
        upstream = here if flows[i] >= 0.0 else ahead
        drag = wall_drag_1_s(flows[i], mass[upstream] / volume[upstream], plant.tube_diameter_m)
        flows[i] = (flows[i] + dt_s * section / cell_m * (p[here] - p[ahead])) / (1.0 + dt_s * drag)
        move_gas(mass, energy, k, flows[i], here, ahead, dt_s)
        warm_gas(s, energy, k, here, conductance, AMBIENT_K, dt_s)
    return flows[TUBE_CELLS - 1]


@compiled
def side_paths(plant, s, mass, energy, p, k, dt_s):
    """Leaks, the pocket, the feed of the tank and the silencer; returns net flows into A and B."""
    across = orifice_kg_s(plant, plant.piston_leak_m2, p, k, CHAMBER_A, CHAMBER_B)
    out_a = orifice_kg_s(plant, plant.chamber_leak_a_m2, p, k, CHAMBER_A, AMBIENT)
    out_b = orifice_kg_s(plant, plant.chamber_leak_b_m2, p, k, CHAMBER_B, AMBIENT)
    pocket = orifice_kg_s(plant, plant.pocket_area_m2, p, k, CHAMBER_A, POCKET)
    feed = orifice_kg_s(plant, plant.feed_area_m2, p, k, REGULATOR, SUPPLY)
    silenced = orifice_kg_s(plant, plant.silencer_area_m2, p, k, EXHAUST, AMBIENT)
    move_gas(mass, energy, k, across, CHAMBER_A, CHAMBER_B, dt_s)
    move_gas(mass, energy, k, out_a, CHAMBER_A, AMBIENT, dt_s)
    move_gas(mass, energy, k, out_b, CHAMBER_B, AMBIENT, dt_s)
    move_gas(mass, energy, k, pocket, CHAMBER_A, POCKET, dt_s)
    move_gas(mass, energy, k, feed, REGULATOR, SUPPLY, dt_s)
    move_gas(mass, energy, k, silenced, EXHAUST, AMBIENT, dt_s)
    if plant.feed_area_m2 > 0.0:
        warm_gas(s, energy, k, SUPPLY, TANK_W_K, AMBIENT_K, dt_s)
    if plant.silencer_area_m2 > 0.0:
        warm_gas(s, energy, k, EXHAUST, PLENUM_W_K, AMBIENT_K, dt_s)
    return -across - out_a - pocket, across - out_b


@compiled
def chamber_heat(plant, s, mass, energy, volume, k, node, net_kg_s, dt_s):
    """Wall exchange of a chamber, A.4 and, with density and flow, P13."""
    dead = plant.dead_volume_a_m3 if node == CHAMBER_A else plant.dead_volume_b_m3
    length = (volume[node] - dead) / plant.area_m2
    surface = 2.0 * plant.area_m2 + pi * plant.bore_m * length
    h = plant.heat_charging_w_m2k if net_kg_s >= 0.0 else plant.heat_discharging_w_m2k
    if plant.heat_density_exponent > 0.0:
        # The reference is the gas at half the supply pressure, about where the engineer's h was measured.
        density_ratio = mass[node] / volume[node] * GAS_CONSTANT * AMBIENT_K / (0.5 * plant.supply_pressure_pa)
        h = plant.heat_discharging_w_m2k * density_ratio**plant.heat_density_exponent
        h += plant.heat_flow_w_m2k * (abs(net_kg_s) / 1e-3) ** 0.8
    warm_gas(s, energy, k, node, h * surface, AMBIENT_K + plant.wall_excess_k, dt_s)


@compiled
def dry_friction_n(plant, s, p_a, p_b):
    """The level g(v) of A.6 with its left-out dependences, M1 to M5."""
    added = plant.friction_per_mean_n_pa * (0.5 * (p_a + p_b) - AMBIENT_PA)
    added += plant.friction_per_difference_n_pa * abs(p_a - p_b)
    stribeck = exp(-((s.v / plant.stribeck_m_s) ** 2))
    level = plant.coulomb_n + added + (plant.static_n - plant.coulomb_n + plant.dwell_n * s.rest) * stribeck
    if plant.position_ratio > 0.0:
        phase = 2.0 * pi * s.x / plant.position_wavelength_m + plant.position_phase_rad
        level *= 1.0 + plant.position_ratio * sin(phase)
    level *= 1.0 + plant.direction_ratio * np.sign(s.v)
    return level * (1.0 - plant.warm_up_ratio * s.warm)


@compiled
def friction_force_n(plant, s, p_a, p_b, dt_s):
    """LuGre: bristle exact at a frozen speed, its mean rate for the damping."""
    level = dry_friction_n(plant, s, p_a, p_b)
    settled = level * np.sign(s.v) / plant.bristle_stiffness_n_m
    fading = exp(-plant.bristle_stiffness_n_m * abs(s.v) * dt_s / level)
    # At rest the bristle holds: nothing to settle towards.
    bristle = settled + (s.bristle - settled) * fading if s.v != 0.0 else s.bristle
    rate = (bristle - s.bristle) / dt_s
    s.bristle = bristle
    s.rest += dt_s * ((1.0 - s.rest) / plant.dwell_s - s.rest * abs(s.v) / REST_FORGET_M)
    s.warm += dt_s * abs(s.v) / plant.warm_up_m * (1.0 - s.warm)
    brake = plant.brake_ns_m / (1.0 + (s.v / plant.brake_peak_m_s) ** 2)
    return (
        plant.bristle_stiffness_n_m * bristle + plant.bristle_damping_ns_m * rate + (plant.viscous_ns_m + brake) * s.v
    )


@compiled
def outside_force_n(plant, s):
    """What pushes against +x from outside: weight, cable, bumper."""
    along = 0.5 + s.x / plant.stroke_m
    cable = plant.cable_n * along * (0.4 + tanh(s.v / 5e-3))
    return plant.external_force_n + cable + plant.bumper_n_m * max(0.0, s.x - plant.bumper_start_m)


@compiled
def stop_force_n(plant, s):
    """The hard ends of the stroke, against +x."""
    over = abs(s.x) - 0.5 * plant.stroke_m
    if over <= 0.0:
        return 0.0
    return STOP_N_M * over * np.sign(s.x) + STOP_NS_M * s.v


@compiled
def load_force_n(plant, s, dt_s):
    """Moves the load on its spring and play; returns its pull against +x (M8, M9)."""
    apart = s.x - s.load_x
    half = 0.5 * plant.load_gap_m
    if plant.load_mass_kg == 0.0 or abs(apart) < half:
        s.load_x += dt_s * s.load_v
        return 0.0
    force = plant.load_stiffness_n_m * (apart - half * np.sign(apart)) + plant.load_damping_ns_m * (s.v - s.load_v)
    s.load_v += dt_s * force / plant.load_mass_kg
    s.load_x += dt_s * s.load_v
    return force


@compiled
def carriage_step(plant, s, p_a, p_b, dt_s):
    """Newton's law (8); speed first, then place."""
    friction = friction_force_n(plant, s, p_a, p_b, dt_s)
    stop = stop_force_n(plant, s)
    load = load_force_n(plant, s, dt_s)
    net = (p_a - p_b) * plant.area_m2 - friction - stop - load - outside_force_n(plant, s)
    before = s.v
    s.v += dt_s * net / (plant.mass_kg - plant.load_mass_kg)
    moved = 0.5 * (before + s.v) * dt_s
    s.x += moved
    s.friction_j += friction * moved
    s.stop_j += stop * moved


@compiled
def squeeze(s, energy, volume, node, before_m3):
    """Work of the piston on a chamber, second order in the change of volume."""
    change = volume[node] - before_m3
    work = (GAMMA - 1.0) * energy[node] / (before_m3 + 0.5 * change) * change
    energy[node] -= work
    s.gas_work_j += work


@compiled
def gauge_step(plant, reading, rate, true_pa, dt_s):
    """A pressure sensor's own dynamics."""
    if plant.gauge_ringing_hz > 0.0:
        omega = 2.0 * pi * plant.gauge_ringing_hz
        rate += dt_s * omega * (omega * (true_pa - reading) - 0.3 * rate)  # damping ratio 0.15
        return reading + dt_s * rate, rate
    if plant.gauge_lag_s > 0.0:
        return reading + (true_pa - reading) * (1.0 - exp(-dt_s / plant.gauge_lag_s)), 0.0
    return true_pa, 0.0


@compiled
def sensor_step(plant, s, p_a, p_b, dt_s):
    """States of the sensors and of what they are mounted on."""
    s.read_a, s.read_a_rate = gauge_step(plant, s.read_a, s.read_a_rate, p_a, dt_s)
    s.read_b, s.read_b_rate = gauge_step(plant, s.read_b, s.read_b_rate, p_b, dt_s)
    follow = 1.0 if plant.velocity_filter_s == 0.0 else 1.0 - exp(-dt_s / plant.velocity_filter_s)
    s.read_v += follow * (s.v - s.read_v)
    if plant.mount_stiffness_n_m > 0.0:
        yielded = (p_a - p_b) * plant.area_m2 / plant.mount_stiffness_n_m
        s.mount_rate = (yielded - s.mount) / MOUNT_LAG_S
        s.mount += dt_s * s.mount_rate


@compiled
def step(plant, table, s, mass, energy, volume, flows, p, k, command_v, dt_s):
    """One sub-step of the whole axis; pressures and temperatures are those at its end."""
    move_spool(plant, s, command_v, dt_s)
    port_a, port_b = (TUBE_A, TUBE_B) if plant.tube_length_m > 0.0 else (CHAMBER_A, CHAMBER_B)
    net_a, net_b = valve_step(plant, table, s, mass, energy, p, k, port_a, port_b, dt_s)
    if plant.tube_length_m > 0.0:
        net_a = tube_step(plant, s, mass, energy, volume, p, k, flows[0], TUBE_A, CHAMBER_A, dt_s)
        net_b = tube_step(plant, s, mass, energy, volume, p, k, flows[1], TUBE_B, CHAMBER_B, dt_s)
    side_a, side_b = side_paths(plant, s, mass, energy, p, k, dt_s)
    chamber_heat(plant, s, mass, energy, volume, k, CHAMBER_A, net_a + side_a, dt_s)
    chamber_heat(plant, s, mass, energy, volume, k, CHAMBER_B, net_b + side_b, dt_s)
    carriage_step(plant, s, p[CHAMBER_A], p[CHAMBER_B], dt_s)
    before_a, before_b = volume[CHAMBER_A], volume[CHAMBER_B]
    set_chamber_volumes(plant, s, volume)
    squeeze(s, energy, volume, CHAMBER_A, before_a)
    squeeze(s, energy, volume, CHAMBER_B, before_b)
    pin_reservoirs(plant, s, mass, energy, volume)
    # Ice grows with the air that passed; 1 g/s is a brisk stroke.
    s.area_loss += dt_s / plant.area_loss_s * (min(s.throughput / 1e-3, 1.0) - s.area_loss)
    s.time_s += dt_s
    gas_state(mass, energy, volume, p, k, plant.tube_length_m > 0.0)
    sensor_step(plant, s, p[CHAMBER_A], p[CHAMBER_B], dt_s)


@compiled
def gauge_pa(plant, reading_pa, offset_pa, bow_pa):
    """Offset and bow of a gauge: the bow is zero at both ends of its 0-10 bar."""
    span = reading_pa / 1e6
    return reading_pa + offset_pa + 4.0 * bow_pa * span * (1.0 - span)


@compiled
def sample(plant, s, p, noise, seen, rows, row):
    """What the converters see at a row: p_a, p_b, p_s, x, v with noise, before rounding."""
    scale = 2.0 * pi / plant.scale_period_m
    seen[row, 0] = s.x - s.mount + plant.scale_error_m * sin(scale * s.x)
    seen[row, 1] = s.read_v * (1.0 + plant.scale_error_m * scale * np.cos(scale * s.x)) - s.mount_rate
    late = max(row - plant.position_skew_s / ROW_S, 0.0)
    earlier = int(late)
    part = late - earlier
    rows[row, 0] = gauge_pa(plant, s.read_a, plant.gauge_offset_a_pa, plant.gauge_bow_a_pa)
    rows[row, 1] = gauge_pa(plant, s.read_b, plant.gauge_offset_b_pa, 0.0)
    rows[row, 2] = p[SUPPLY]
    for i in range(2):
        rows[row, 3 + i] = seen[earlier, i] + part * (seen[min(earlier + 1, row), i] - seen[earlier, i])
    rows[row] += noise[row]


@compiled
def command_of(control, s, measured, reference):
    """The controller's command at a row, on the converter's steps."""
    error = reference[0] - measured[3]
    wanted = reference[2] + control.position_v_m * error
    wanted += control.speed_v_s_m * (reference[1] - 0.3 * measured[4])
    difference_pa = measured[0] - measured[1]
    s.slow_difference_pa += CONTROL_FORGET * (difference_pa - s.slow_difference_pa)
    wanted -= control.pressure_v_pa * (difference_pa - s.slow_difference_pa)
    if reference[1] == 0.0 and reference[2] == 0.0 and abs(error) < control.tolerance_m:
        wanted = 0.0
    wanted += control.dead_zone_v * tanh(wanted / 0.05)
    command = control.null_v + control.feeds_a_sign * wanted
    return round(min(max(command, 0.0), 10.0) / COMMAND_STEP_V) * COMMAND_STEP_V


@compiled
def advance(
    plant, control, table, state, gas, flows, reference, noise, commands, seen, rows, first, last, replay, steps
):
    """Runs rows first to last; with `replay` on the commands as they stand."""
    s = state[0]
    mass, energy = gas[0], gas[1]
    volume, p, k = np.empty(NODES), np.empty(NODES), np.empty(NODES)
    set_volumes(plant, s, volume)
    gas_state(mass, energy, volume, p, k, True)
    dt_s = ROW_S / steps
    for row in range(first, last):
        sample(plant, s, p, noise, seen, rows, row)
        if not replay:
            commands[row] = command_of(control, s, rows[row], reference[row])
        for i in range(steps):
            since = row + i / steps - plant.delay_s / ROW_S
            command_v = commands[max(int(np.floor(since + 1e-9)), 0)]
            step(plant, table, s, mass, energy, volume, flows, p, k, command_v, dt_s)


@compiled
def fill(plant, state, gas, pressure_pa):
    """All nodes at ambient temperature: chambers and lines at one pressure, reservoirs at theirs."""
    volume = np.empty(NODES)
    set_volumes(plant, state[0], volume)
    pressure = np.full(NODES, pressure_pa)
    pressure[SUPPLY] = pressure[REGULATOR] = plant.supply_pressure_pa
    pressure[EXHAUST] = pressure[AMBIENT] = AMBIENT_PA
    gas[0] = pressure * volume / (GAS_CONSTANT * AMBIENT_K)
    gas[1] = pressure * volume / (GAMMA - 1.0)


class Axis:
    """An axis at rest that can be run, copied and run again."""

    def __init__(self, plant: Plant, x_m: float):
        start_pa = 0.6 * plant.supply_pressure_pa  # near the balance of a leaking spool at null
        self.state = np.zeros(1, STATE)
        self.state["x"] = self.state["load_x"] = x_m
        self.state["read_a"] = self.state["read_b"] = start_pa
        self.gas = np.empty((2, NODES))
        self.flows = np.zeros((2, TUBE_CELLS))
        fill(plant, self.state, self.gas, start_pa)

    def copy(self) -> "Axis":
        """The same axis, to be run on its own."""
        twin = Axis.__new__(Axis)
        twin.state, twin.gas, twin.flows = self.state.copy(), self.gas.copy(), self.flows.copy()
        return twin

    def keep_pressures(self, old: Plant, new: Plant) -> None:
        """Refills the nodes for a plant with other volumes, at the same pressures and temperatures."""
        before, after = np.empty(NODES), np.empty(NODES)
        set_volumes(old, self.state[0], before)
        set_volumes(new, self.state[0], after)
        self.gas *= after / before

    def run(self, plant, control, table, record, first, last, replay=False, steps=STEPS_PER_ROW) -> None:
        """Runs some rows of a record in place."""
        advance(
            plant, control, table, self.state, self.gas, self.flows, record.reference, record.noise,
            record.commands, record.seen, record.rows, first, last, replay, steps,
        )  # fmt: skip


class Record:
    """Reference, noise, commands and samples of one recording."""

    def __init__(self, reference: np.ndarray, noise: np.ndarray):
        self.reference, self.noise = reference, noise
        self.commands = np.empty(len(reference))
        self.seen = np.empty((len(reference), 2))
        self.rows = np.empty((len(reference), 5))

    def copy(self) -> "Record":
        """The same record, to be overwritten."""
        twin = Record(self.reference, self.noise)
        twin.commands, twin.seen, twin.rows = self.commands.copy(), self.seen.copy(), self.rows.copy()
        return twin
