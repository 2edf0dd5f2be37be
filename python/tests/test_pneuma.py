"""The package as a user of Python meets it. The small axis of the tutorial is its world."""

import ast
import contextlib
import io
import json
import os
import subprocess
import tempfile
import threading
import unittest
from pathlib import Path

import numpy as np
import pandas as pd

import pneuma

ROOT = Path(__file__).resolve().parents[2]
AXIS = ROOT / "host-sim/fixtures/leaking-axis"


def rig():
    return pneuma.Rig.read(AXIS / "rig.toml")


def recordings(*names):
    return [pneuma.Recording.read(AXIS / f"{name}.csv", rig()) for name in names]


class Bench(unittest.TestCase):
    def test_a_force_bench_gives_the_friction_that_was_put_in(self):
        text = """format = "rig/1"
[signals]
t = { column = "t", unit = "s" }
x = { column = "x", unit = "m" }
force = { column = "force", unit = "N" }
"""
        rows = np.arange(4000)
        speeds = np.repeat([0.002, -0.005, 0.01, -0.03, 0.06, -0.1], len(rows))
        time_s = np.arange(len(speeds)) * 1e-3
        noise = np.random.default_rng(1)
        position = np.cumsum(speeds) * 1e-3 + noise.normal(0, 2e-6, len(speeds))
        friction = 20 * np.sign(speeds) + 60 * speeds
        force = noise.normal(0, 0.2, len(speeds)) - friction
        bench = pneuma.recording(time_s, {"x": position, "force": force})
        found = pneuma.identify("friction", pneuma.Rig.parse(text, "bench.toml"), bench)
        numbers = {one["key"]: (one["value"], one["deviation"]) for one in found.data["numbers"]}
        for key, true in {"friction.coulomb_N": 20.0, "friction.viscous_Ns_m": 60.0}.items():
            value, deviation = numbers[key]
            self.assertLess(abs(value - true), 5 * deviation + 0.02 * true, key)
        with self.assertRaises(pneuma.PneumaError) as caught:
            pneuma.identify("spol", rig(), recordings("train-1"))
        self.assertIn("spool", str(caught.exception))


class Files(unittest.TestCase):
    def test_a_recording_is_the_same_from_a_file_and_from_arrays(self):
        (read,) = recordings("train-1")
        signals = {name: read[name] for name in read.signals}
        made = pneuma.recording(read.time_s, signals, name="train-1.csv")
        self.assertEqual(len(read), len(made))
        for name in read.signals:
            np.testing.assert_array_equal(read[name], made[name])
        frame = pd.DataFrame({"t": read.time_s} | signals)
        framed = pneuma.recording(frame, name="train-1.csv")
        self.assertEqual(pneuma.inspect(rig(), framed).json, pneuma.inspect(rig(), made).json)

    def test_a_file_of_another_program_is_the_same_recording(self):
        fixtures = ROOT / "data-files/fixtures"
        text = pneuma.Recording.read(fixtures / "run.csv", rig())
        for name in ("run-zstd.parquet", "run-v73.mat", "run.mf4", "run.xlsx"):
            read = pneuma.Recording.read(fixtures / name, rig())
            np.testing.assert_array_equal(read["p_a"], text["p_a"])
        columns = pneuma.tables(fixtures / "run.h5")["rig/run 1"]
        self.assertIn(("x_m", "m", 400), [(one.name, one.unit, one.rows) for one in columns])

    def test_what_cannot_be_used_says_where(self):
        with self.assertRaises(pneuma.PneumaError) as caught:
            pneuma.Rig.parse('format = "rig/1"\n[valve]\nnull_V = "five"\n', "my.toml")
        error = caught.exception
        self.assertEqual((error.file, error.line, error.key), ("my.toml", 3, "valve.null_V"))
        self.assertTrue(error.expected and "\n" not in str(error))
        with self.assertRaises(pneuma.PneumaError) as caught:
            pneuma.Recording.read(AXIS / "truth.json", rig())
        self.assertIn("truth.json", caught.exception.file)
        for time_s, signals in (([0.0, 0.0], {"x": [1.0, 2.0]}), ([0.0, 1.0], {"x": [1.0]}), ([0.0, 1.0], {"q": [1.0, 2.0]})):
            with self.assertRaises(pneuma.PneumaError):
                pneuma.recording(time_s, signals)

    def test_a_signal_that_arrays_lack_is_named(self):
        (read,) = recordings("train-1")
        signals = {name: read[name] for name in read.signals if name != "p_b"}
        made = pneuma.recording(read.time_s, signals, name="made")
        works = (
            lambda: pneuma.inspect(rig(), made),
            lambda: pneuma.compare(rig(), [made]),
            lambda: pneuma.fit(rig(), [made], [read]),
            lambda: pneuma.diagnose(rig(), [read], [made]),
        )
        for work in works:
            with self.assertRaises(pneuma.PneumaError) as caught:
                work()
            self.assertIn("made: p_b", str(caught.exception))


class Work(unittest.TestCase):
    def test_a_diagnosis_is_the_program_s_to_the_byte(self):
        train, held_out = recordings("train-1"), recordings("held-out")
        stages = []
        verdict = pneuma.diagnose(rig(), train, held_out, progress=stages.append)
        self.assertEqual(verdict.verdict, "named")
        self.assertEqual(verdict.effects[0].effect, json.loads(verdict.json)["effects"][0]["effect"])
        self.assertIn("finding", str(verdict))
        self.assertTrue(any("chambers" in stage for stage in stages))
        self.assertTrue(verdict.report().lower().startswith("<!doctype html>"))
        self.assertIn("<iframe", verdict._repr_html_())
        effect = f"effects.{verdict.effects[0].effect}"
        self.assertIn(f"[{effect}]", verdict.improved_rig.to_toml())
        program = os.environ.get("PNEUMA_PROGRAM")
        self.assertTrue(program, "PNEUMA_PROGRAM names the program to compare with")
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "verdict.json"
            command = [program, "diagnose", "--rig", AXIS / "rig.toml", "--train", AXIS / "train-1.csv", "--held-out", AXIS / "held-out.csv", "--json", out]
            subprocess.run(command, check=True, capture_output=True)
            self.assertEqual(out.read_text().strip(), verdict.json.strip())

    def test_inspect_compare_fit(self):
        (train,) = recordings("train-1")
        inspection = pneuma.inspect(rig(), train)
        self.assertEqual(inspection.rows, len(train))
        compared = pneuma.compare(rig(), train)
        self.assertGreaterEqual(len(compared), 2)
        fitted = pneuma.fit(rig(), train, free=["valve.null_V"])
        self.assertIsInstance(fitted.improved_rig.value("valve.null_V"), float)
        with self.assertRaises(AttributeError):
            inspection.rowz
        with self.assertRaises(pneuma.PneumaError):
            pneuma.fit(rig(), train, free=["valve.nul_V"])

    def test_other_threads_run_and_an_exception_in_progress_ends_the_work(self):
        class Stop(Exception):
            pass

        def stop(stage):
            if "each effect alone" in stage:
                raise Stop(stage)

        ran = threading.Event()
        threading.Timer(0.05, ran.set).start()
        with self.assertRaises(Stop):
            pneuma.diagnose(rig(), recordings("train-1"), progress=stop)
        self.assertTrue(ran.is_set())

    def test_a_scenario_is_simulated(self):
        columns = pneuma.simulate(ROOT / "host-sim/scenarios/sine.toml")
        lengths = {len(values) for values in columns.values()}
        self.assertEqual(len(lengths), 1)
        self.assertGreater(np.ptp(columns["x_m"]), 1e-3)


class Steps(unittest.TestCase):
    def test_the_board_s_controller_moves_the_plant(self):
        known = pneuma.Rig.read(ROOT / "host-sim/rigs/paper.toml")
        plant, controller = pneuma.Plant(known, start_m=0.0), pneuma.Controller(known)
        way_m, time_s = 0.02, 0.4
        for tick in range(1000):
            part = min(1.0, max(0.0, (tick - 50) * 1e-3 / time_s))
            smooth = part**3 * (10 - 15 * part + 6 * part**2)
            speed = 30 * part**2 * (1 - part) ** 2 / time_s
            rise = 60 * part * (1 - part) * (1 - 2 * part) / time_s**2
            code, state, fault, _ = controller.tick(plant.sample(), way_m * smooth, way_m * speed, way_m * rise)
            self.assertEqual(fault, 0, state)
            plant.advance(code)
        self.assertAlmostEqual(plant.truth()["x"], way_m, delta=1e-4)


class Notebook(unittest.TestCase):
    def test_the_tour_runs_from_top_to_bottom(self):
        """But for its diagnosis, of parts of its recordings: the whole ones are a test's above."""
        notebook = json.loads((ROOT / "python/tour.ipynb").read_text())
        code = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
        self.assertGreater(len(code), 4)
        before, world, said = os.getcwd(), {}, io.StringIO()
        os.chdir(ROOT / "python")
        try:
            with contextlib.redirect_stdout(said):
                for cell in code:
                    exec(compile(cell, "tour.ipynb", "exec"), world)
                    world["train"] = [one.part(0, 2500) for one in world["train"][:1]]
        finally:
            os.chdir(before)
        self.assertEqual(world["verdict"].verdict, "named")
        self.assertLess(abs(world["error_mm"]), 0.1)
        self.assertIn("finding", said.getvalue())


class Package(unittest.TestCase):
    def test_the_stubs_name_what_is_there(self):
        stub = ast.parse((ROOT / "python/pneuma/_pneuma.pyi").read_text())
        said = {}
        for one in stub.body:
            if isinstance(one, (ast.ClassDef, ast.FunctionDef)):
                members = [m.name for m in getattr(one, "body", []) if isinstance(m, ast.FunctionDef)]
                fields = [m.target.id for m in getattr(one, "body", []) if isinstance(m, ast.AnnAssign)]
                said[one.name] = {name for name in members + fields if not name.startswith("__")}
        module = pneuma._pneuma
        public = lambda thing: {name for name in dir(thing) if not name.startswith("_")}
        self.assertEqual(set(said), public(module))
        for name, members in said.items():
            # What exceptions inherit, and attributes that each one gets, stand in no class.
            if name != "PneumaError" and isinstance(getattr(module, name), type):
                self.assertEqual(members, public(getattr(module, name)), name)

    def test_everything_public_says_what_it_is(self):
        for name in pneuma.__all__:
            self.assertTrue(getattr(pneuma, name).__doc__, name)
        source = Path(pneuma.__file__).read_text()
        for function in ast.parse(source).body:
            if isinstance(function, ast.FunctionDef) and not function.name.startswith("_"):
                self.assertIsNotNone(function.returns, function.name)


if __name__ == "__main__":
    unittest.main()
