"""The nominal model: valve, chambers, forces, as the rig file describes them."""

import numpy as np

FLOW_CONSTANT = 0.0404184  # sqrt(gamma/R (2/(gamma+1))^((gamma+1)/(gamma-1))), air


def flow_ratio(r, b, laminar):
    """Flow over choked flow: ISO 6358's ellipse, linear near no drop."""
    ellipse = np.sqrt(np.clip(1.0 - ((np.clip(r, b, laminar) - b) / (1.0 - b)) ** 2, 0.0, 1.0))
    return np.where(r <= laminar, ellipse, ellipse * (1.0 - r) / (1.0 - laminar))


def orifice_kg_s(area_m2, from_pa, to_pa, from_k, to_k, b, laminar):
    """Mass flow through an orifice, either way."""
    up, down = np.maximum(from_pa, to_pa), np.minimum(from_pa, to_pa)
    temperature = np.where(from_pa >= to_pa, from_k, to_k)
    r = down / up
    discharge = 0.8153 + 0.0933 * r - 0.1038 * r * r
    size = area_m2 * discharge * FLOW_CONSTANT * up / np.sqrt(temperature) * flow_ratio(r, b, laminar)
    return np.where(from_pa >= to_pa, size, -size)


def port_areas(rig, opening_v, stretch=1.0, supply=1.0, exhaust=1.0):
    """Areas to supply and exhaust of a port, opened to supply above zero."""
    nodes = np.asarray(rig["valve.opening_V"]) * stretch
    fed = np.interp(np.abs(opening_v), nodes, rig["valve.supply_area_m2"]) * supply
    vented = np.interp(np.abs(opening_v), nodes, rig["valve.exhaust_area_m2"]) * exhaust
    shut_fed = rig["valve.supply_area_m2"][0] * supply
    shut_vented = rig["valve.exhaust_area_m2"][0] * exhaust
    opens = opening_v > 0.0
    return np.where(opens, fed, shut_fed), np.where(opens, shut_vented, vented)


def volumes(rig, x, dead_a=None, dead_b=None):
    """Volumes of both chambers."""
    from_end_a = x + 0.5 * rig["cylinder.stroke_m"] if rig["cylinder.position_zero"] == "mid-stroke" else x
    a = (dead_a or rig["cylinder.dead_volume_a_m3"]) + rig["cylinder.area_a_m2"] * from_end_a
    b = (dead_b or rig["cylinder.dead_volume_b_m3"]) + rig["cylinder.area_b_m2"] * (
        rig["cylinder.stroke_m"] - from_end_a
    )
    return a, b


def friction_n(rig, v):
    """Sliding friction over velocity."""
    coulomb, static = rig["friction.coulomb_N"], rig["friction.static_N"]
    stribeck = rig["friction.stribeck_velocity_m_s"]
    level = coulomb + (static - coulomb) * np.exp(-((v / stribeck) ** 2))
    return np.sign(v) * level + rig["friction.viscous_Ns_m"] * v
