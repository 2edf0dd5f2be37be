"""Work against precision: the axis' step beside CVODE with a right-hand side in C.

    apt-get install libsundials-dev
    python3 tests/baselines/work_precision/run.py [--sundials PREFIX] [--step PROGRAM]

builds both programs, runs them in turn and writes the last section of docs/benchmarks.md.
"""

import argparse
import datetime
import os
import pathlib
import subprocess
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]
DOCUMENT = ROOT / "docs" / "benchmarks.md"
HEADING = "## Work against precision"
LIBRARIES = ["cvode", "nvecserial", "sunlinsoldense", "sunmatrixdense", "generic"]
SCENARIOS = {
    "step": "command to 4 V and held, 0.4 s",
    "held": "sine of 0.9 V at 1 Hz, held over each millisecond, 1 s",
    "smooth": "the same sine, smooth, 1 s",
}
ACCURACIES_M = [100e-6, 10e-6, 5e-6, 2e-6, 1e-6, 1e-7, 1e-8]
ROUNDS = 3


def build_cvode(prefix, folder):
    program = folder / "cvode"
    library = f"{prefix}/lib/x86_64-linux-gnu"
    flags = ["-O3", "-march=x86-64-v3", f"-I{prefix}/include", f"-I{library}/openmpi/include", f"-L{library}"]
    links = [f"-l:libsundials_{name}.a" for name in LIBRARIES] + ["-lm"]
    subprocess.run(["gcc", *flags, "-o", program, HERE / "cvode.c", *links], check=True)
    return program


def build_step():
    command = ["cargo", "build", "--release", "-p", "model-core", "--example", "work_precision"]
    subprocess.run(command, check=True, cwd=ROOT)
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    return target / "release" / "examples" / "work_precision"


def rows(program, scenario, reference):
    """(setting, error in m, time in s) per line; the best time of each."""
    best = {}
    for _ in range(ROUNDS):
        answer = subprocess.run([program, scenario, reference], check=True, capture_output=True, text=True)
        for line in answer.stdout.splitlines():
            setting, error, time = line.split()[:3]
            known = best.get(setting, (float(error), float("inf")))
            best[setting] = (float(error), min(known[1], float(time)))
    return [(setting, *row) for setting, row in best.items()]


def cheapest(found, accuracy):
    enough = [row for row in found if row[1] <= accuracy]
    return min(enough, key=lambda row: row[2], default=None)


def shown(row, unit):
    if row is None:
        return "not reached"
    setting, error, time = row
    return f"{1e3 * time:.3f} ms ({1e6 * error:.2g} µm, {unit.format(setting)})"


def table(ours, theirs):
    lines = ["| to | step of the axis | CVODE | CVODE's time to ours |", "|---:|---:|---:|---:|"]
    for accuracy in ACCURACIES_M:
        mine, other = cheapest(ours, accuracy), cheapest(theirs, accuracy)
        ratio = f"{other[2] / mine[2]:.2g}" if mine and other else ""
        mine, other = shown(mine, "{} steps/ms"), shown(other, "tolerance {}")
        lines.append(f"| {1e6 * accuracy:g} µm | {mine} | {other} | {ratio} |")
    return lines


def processor():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":")[1].strip()
    return "unknown"


def main():
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--sundials", default="/usr", help="where SUNDIALS is installed")
    options.add_argument("--step", help="the example work_precision of model-core, if it is built already")
    options = options.parse_args()
    lines = [
        HEADING,
        "",
        "Written by `tests/baselines/work_precision/run.py`; do not edit.",
        "",
        "How long the paper's axis takes in f64 until the largest error of its position, at every millisecond, is",
        "under so much; for each program the fastest of its settings that reaches it, best of 45 runs. CVODE",
        "(SUNDIALS 6.4, BDF, dense Newton, the Jacobian by differences) has its right-hand side in C, both are",
        "built for the same processor. Its run at a tolerance of 1e-12 is the reference. A command that jumps",
        "makes CVODE begin anew at every millisecond, as its manual asks for. In brackets what was reached.",
        "",
        f"- processor: {processor()}",
        f"- date: {datetime.date.today()}",
    ]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        solver = build_cvode(options.sundials, folder)
        step = options.step or build_step()
        for scenario, title in SCENARIOS.items():
            reference = folder / scenario
            theirs = rows(solver, scenario, reference)
            ours = rows(step, scenario, reference)
            lines += ["", f"### {title[0].upper()}{title[1:]}", "", *table(ours, theirs)]
    text = DOCUMENT.read_text()
    kept = text.split(HEADING)[0].rstrip()
    DOCUMENT.write_text(kept + "\n\n" + "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
