"""Sparse regression of the nominal model's residual on physical terms (pysindy)."""

import sys
import time
import warnings
from pathlib import Path

import numpy as np
import pysindy

from case_folder import Rig, recordings, smooth, write_verdict
from model import friction_n, orifice_kg_s, port_areas, volumes

NAME = "sparse-regression"
# Part of the residual's energy that a term must explain to be told.
TOLD_PART = 0.05
MOVING_M_S = 0.01


def chamber_terms(rig, one, side):
    """Residual of a chamber's mass balance, kg/s, and what may explain it."""
    dt = float(np.median(np.diff(one.t)))
    ambient_pa, ambient_k = rig["environment.pressure_Pa"], rig["environment.temperature_K"]
    gas, gamma = rig["gas.gas_constant_J_kgK"], rig["gas.gamma"]
    b, laminar = rig["valve.critical_pressure_ratio"], rig["valve.laminar_pressure_ratio"]
    p_a, p_b, u = smooth(one.p_a, dt), smooth(one.p_b, dt), one.u
    own, other = (p_a, p_b) if side == "a" else (p_b, p_a)
    volume = volumes(rig, one.x)[side == "b"]
    area = rig[f"cylinder.area_{side}_m2"] * (1.0 if side == "a" else -1.0)
    rate = smooth(one.p_a if side == "a" else one.p_b, dt, 1)
    supply_pa = rig["supply.pressure_Pa"]
    feeds_a = 1.0 if rig["valve.feeds_a_when"] == "above-null" else -1.0
    opening = (u - rig["valve.null_V"]) * feeds_a * (1.0 if side == "a" else -1.0)
    def flow(opening_v, supply=supply_pa, exhaust=ambient_pa, temperature=ambient_k):
        fed, vented = port_areas(rig, opening_v)
        return orifice_kg_s(fed, supply, own, temperature, temperature, b, laminar) - orifice_kg_s(
            vented, own, exhaust, temperature, temperature, b, laminar
        )
    nominal = flow(opening)
    stored = (volume * rate / gamma + own * area * one.v) / (gas * ambient_k)
    slope = np.gradient(u, dt)
    sensitivity = (flow(opening + 0.02) - flow(opening - 0.02)) / 0.04
    turn = 1.0 if side == "a" else -1.0
    terms = {
        "valve-delay": -sensitivity * turn * feeds_a * smooth(slope, dt),
        "valve-hysteresis": -sensitivity * turn * feeds_a * np.sign(smooth(slope, dt)),
        "valve.null_V": sensitivity,
        "valve.area": nominal,
        "piston-leakage": other - own,
        "chamber-leakage": ambient_pa - own,
        "supply-droop": flow(opening, supply=0.99 * supply_pa) - nominal,
        "exhaust-back-pressure": flow(opening, exhaust=1.05 * ambient_pa) - nominal,
        "wall-temperature": np.ones_like(own),
        "pressure-sensor-lag": volume * smooth(rate, dt, 1) / (gamma * gas * ambient_k),
        "dead-volume": rate,
    }
    return stored - nominal, terms


def force_terms(rig, one):
    """Residual of the force balance, N, and what may explain it."""
    dt = float(np.median(np.diff(one.t)))
    ambient_pa = rig["environment.pressure_Pa"]
    area_a, area_b = rig["cylinder.area_a_m2"], rig["cylinder.area_b_m2"]
    p_a, p_b = smooth(one.p_a, dt), smooth(one.p_b, dt)
    acceleration = smooth(one.x, dt, 2, 31)
    v = smooth(one.x, dt, 1, 31)
    pushed = (p_a - ambient_pa) * area_a - (p_b - ambient_pa) * area_b
    residual = rig["carriage.mass_kg"] * acceleration - pushed + friction_n(rig, v)
    moving = np.abs(v) > MOVING_M_S
    sign = np.sign(v)
    terms = {
        "constant-force": np.ones_like(v),
        "friction.coulomb_N": sign,
        "viscous-friction": v,
        "carriage.mass_kg": acceleration,
        "pressure-dependent-friction": sign * (p_a + p_b - 2.0 * ambient_pa),
        "position-dependent-friction": sign * np.cos(2.0 * np.pi * one.x / 0.1),
        "position-dependent-friction ": sign * np.sin(2.0 * np.pi * one.x / 0.1),
        "load-compliance": smooth(acceleration, dt, 1),
    }
    return residual[moving], {name: term[moving] for name, term in terms.items()}


def sparse(residual, terms):
    """Part of the energy explained by each term that the regression keeps, and in all."""
    names = list(terms)
    library = np.column_stack([terms[name] for name in names])
    scale = np.sqrt(np.mean(library**2, axis=0)) + 1e-300
    size = np.sqrt(np.mean(residual**2)) + 1e-300
    library, target = library / scale, residual[:, None] / size
    optimiser = pysindy.STLSQ(threshold=0.1, alpha=1e-3, normalize_columns=False)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        optimiser.fit(library, target)
    weights = np.ravel(optimiser.coef_)
    explained = 1.0 - np.mean((target[:, 0] - library @ weights) ** 2)
    parts = {name.strip(): float(weight**2) for name, weight in zip(names, weights) if weight != 0.0}
    return parts, float(explained), float(size)


def diagnose(folder: Path) -> dict:
    """The verdict on a case folder."""
    begin = time.process_time()
    rig = Rig(folder)
    train = recordings(folder, rig, "train-*.csv")
    found = []
    for place in ("chamber-a", "chamber-b", "force-balance"):
        parts = [
            force_terms(rig, one) if place == "force-balance" else chamber_terms(rig, one, place[-1])
            for one in train
        ]
        residual = np.concatenate([part[0] for part in parts])
        terms = {name: np.concatenate([part[1][name] for part in parts]) for name in parts[0][1]}
        kept, explained, _ = sparse(residual, terms)
        found += [
            (part, explained, name, place)
            for name, part in kept.items()
            if part > TOLD_PART and "." not in name
        ]
    found.sort(reverse=True)
    effects = []
    for part, explained, name, place in found:
        if all(name != effect["effect"] for effect in effects):
            probability = max(0.0, min(1.0, explained))
            effects.append({"effect": name, "places": [effect_place(name, place)], "probability": probability})
    return {
        "verdict": "named" if effects else "nothing-missing",
        "sentence": "terms kept: " + ", ".join(effect["effect"] for effect in effects),
        "effects": effects,
        "seconds": time.process_time() - begin,
    }


def effect_place(effect, equation):
    """Where an effect sits, if not in the equation that showed it."""
    places = {
        "valve-delay": "valve-command",
        "valve-hysteresis": "valve-command",
        "supply-droop": "supply",
        "exhaust-back-pressure": "exhaust",
        "pressure-sensor-lag": "sensor.p_" + equation[-1],
    }
    return places.get(effect, equation)


if __name__ == "__main__":
    write_verdict(Path(sys.argv[1]), NAME, diagnose(Path(sys.argv[1])))
