"""The units of `pneuma fmu`, checked and stepped by FMPy; run by `units.rs` in their folder."""

import shutil
import unittest

import numpy as np
from fmpy import extract, instantiate_fmu, read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

TICK_S = 1e-3
KINDS = ["plant", "controller", "observer"]
SENSORS = ["position_m", "pressure_a_pa", "pressure_b_pa", "supply_pressure_pa", "velocity_m_per_s"]
WISH = ["reference_position_m", "reference_velocity_m_per_s", "reference_acceleration_m_per_s2"]


class Unit:
    """A unit of either standard, by the names of its variables."""

    def __init__(self, file, **parameters):
        self.description = read_model_description(file)
        self.folder = extract(file)
        self.version = self.description.fmiVersion[0]
        self.fmu = instantiate_fmu(self.folder, self.description, "CoSimulation")
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.inputs = {v.name for v in self.description.modelVariables if v.causality == "input"}
        for name, value in parameters.items():
            self.set(name.replace("__", "."), value)
        if self.version == "2":
            self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def _is_real(self, name):
        return self.variables[name].type in ("Real", "Float64")

    def set(self, name, value):
        reference = [self.variables[name].valueReference]
        if self.version == "2":
            setter = self.fmu.setReal if self._is_real(name) else self.fmu.setInteger
        else:
            setter = self.fmu.setFloat64 if self._is_real(name) else self.fmu.setInt32
        setter(reference, [value])

    def get(self, name):
        reference = [self.variables[name].valueReference]
        if self.version == "2":
            getter = self.fmu.getReal if self._is_real(name) else self.fmu.getInteger
        else:
            getter = self.fmu.getFloat64 if self._is_real(name) else self.fmu.getInt32
        return getter(reference)[0]

    def step(self, time):
        self.fmu.doStep(currentCommunicationPoint=time, communicationStepSize=TICK_S)

    def close(self):
        self.fmu.terminate()
        self.fmu.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)


class Units(unittest.TestCase):
    def each(self):
        for version in "23":
            for kind in KINDS:
                with self.subTest(kind=kind, version=version):
                    yield kind, f"{kind}-{version}.fmu"

    def test_val_the_validator_has_no_remark(self):
        for _, file in self.each():
            self.assertEqual(validate_fmu(file), [])

    def test_val_units_and_starts_come_from_the_rig(self):
        for _, file in self.each():
            variables = {v.name: v for v in read_model_description(file).modelVariables}
            mass = variables["carriage.mass_kg"]
            self.assertEqual((float(mass.start), mass.unit, mass.causality), (2.0, "kg", "parameter"))
            tube = variables["effects.tube-line.length_m"]
            self.assertEqual((float(tube.start), tube.unit), (0.0, "m"))

    def test_val_the_tool_of_others_steps_it(self):
        for kind, file in self.each():
            result = simulate_fmu(file, stop_time=0.05, step_size=TICK_S, output_interval=TICK_S)
            self.assertGreater(len(result), 49)
            for name in result.dtype.names:
                self.assertTrue(np.isfinite(result[name].astype(float)).all(), (kind, name))

    def test_val_coupled_they_give_the_loop_of_the_host_to_the_byte(self):
        rows = np.loadtxt("loop.txt")
        for version in "23":
            with self.subTest(version=version):
                start = {"plant__start_m": rows[0, 9], "plant__seed": 7}
                plant = Unit(f"plant-{version}.fmu", **start)
                controller = Unit(f"controller-{version}.fmu")
                for tick, row in enumerate(rows):
                    shown = [plant.get(name) for name in SENSORS]
                    self.assertEqual(shown, list(row[3:8]), f"tick {tick}")
                    self.assertEqual(plant.get("true_position_m"), row[9], f"tick {tick}")
                    for name, value in zip(SENSORS, shown):
                        controller.set(name, value)
                    for name, value in zip(WISH, row[:3]):
                        controller.set(name, value)
                    plant.set("command_v", controller.get("command_v"))
                    for unit in (plant, controller):
                        unit.step(tick * TICK_S)
                    self.assertEqual(controller.get("command_v"), row[8], f"tick {tick}")
                self.assertEqual(controller.get("fault"), 0)
                for unit in (plant, controller):
                    unit.close()

    def test_val_the_observer_follows_the_axis(self):
        plant, observer = Unit("plant-2.fmu"), Unit("observer-2.fmu")
        worst_pa = 0.0
        for tick in range(800):
            # A swing of the valve, open loop.
            command_v = 5.0 + 0.6 * np.sin(2 * np.pi * 2.0 * tick * TICK_S)
            for name in SENSORS:
                observer.set(name, plant.get(name))
            for unit in (plant, observer):
                unit.set("command_v", command_v)
            true_pa = plant.get("true_pressure_a_pa")
            for unit in (plant, observer):
                unit.step(tick * TICK_S)
            worst_pa = max(worst_pa, abs(observer.get("estimated_pressure_a_pa") - true_pa))
        # The gauge's noise and steps are 250 and 244 Pa; the axis moves by hundreds of kPa a second.
        self.assertLess(worst_pa, 2000.0)
        for unit in (plant, observer):
            unit.close()

    def test_val_an_effect_is_a_parameter(self):
        places = []
        for length_m in (0.0, 2.0):
            tube = {"effects__tube-line__length_m": length_m, "effects__tube-line__diameter_m": 0.004}
            plant = Unit("plant-2.fmu", **(tube if length_m else {}))
            plant.set("command_v", 6.0)
            for tick in range(300):
                plant.step(tick * TICK_S)
            places.append(plant.get("true_position_m"))
            plant.close()
        # Two metres of tube hold the load back.
        self.assertGreater(places[0] - places[1], 1e-3)

    def test_val_a_parameter_holds_after_the_first_tick(self):
        for name, key, value in [
            ("moving_mass_kg", "carriage.mass_kg", 5.0),
            ("regulator_pressure_pa", "supply.pressure_Pa", 5e5),
        ]:
            plant = Unit("plant-3.fmu", **{key.replace(".", "__"): value})
            self.assertEqual(plant.get(name), value)
            plant.step(0.0)
            if name == "regulator_pressure_pa":
                self.assertLess(plant.get("true_supply_pressure_pa"), 5.001e5)
            plant.close()

    def test_val_a_force_and_the_supply_are_inputs(self):
        plant = Unit("plant-3.fmu")
        plant.set("push_n", 200.0)
        plant.set("regulator_pressure_pa", 400000.0)
        for tick in range(200):
            plant.step(tick * TICK_S)
        self.assertGreater(plant.get("true_position_m"), 1e-3)
        self.assertLess(plant.get("true_supply_pressure_pa"), 400001.0)
        plant.close()

    def test_prop_a_state_is_taken_and_brought_back(self):
        plant = Unit("plant-2.fmu")
        plant.set("command_v", 6.0)

        def run(begin):
            for tick in range(begin, begin + 50):
                plant.step(tick * TICK_S)
            return [plant.get(name) for name in SENSORS + ["true_position_m"]]

        run(0)
        state = plant.fmu.getFMUState()
        first = run(50)
        plant.fmu.setFMUState(state)
        self.assertEqual(run(50), first)
        plant.fmu.freeFMUState(state)
        plant.close()

    def test_prop_what_cannot_be_is_refused(self):
        plant = Unit("plant-2.fmu")
        for name, value in [
            ("moving_mass_kg", -1.0),
            ("command_v", float("nan")),
            ("carriage.mass_kg", 2.5),
            ("position_m", 0.0),
        ]:
            with self.assertRaises(Exception, msg=name):
                plant.set(name, value)
        with self.assertRaises(Exception):
            plant.fmu.doStep(currentCommunicationPoint=0.0, communicationStepSize=2.5e-3)
        plant.step(0.0)
        plant.close()
        with self.assertRaises(Exception):
            Unit("plant-2.fmu", **{"effects__tube-line__length_m": -1.0})


if __name__ == "__main__":
    unittest.main()
