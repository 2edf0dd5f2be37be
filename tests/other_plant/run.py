"""Runs `pneuma diagnose` on case folders and judges its verdicts: `python run.py DIR --pneuma PATH`.

Right is:
- effects of the list: `named`, all true effects first and no false one above a probability of one half; with a weak
  truth also `ambiguous`, if every true effect is among the effects or alternatives;
- an effect on no list: `unknown`, one of its places among the located ones;
- healthy, or immaterial effects only: `nothing-missing`.
"""

import argparse
import json
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

GROUPS = ("single", "late", "pair", "unlisted", "healthy", "dirty")
LIKELY = 0.5
CONFIDENT = 0.9
TIME_LIMIT_S = 3600


@dataclass
class Outcome:
    """A judged case."""

    name: str
    truth: dict
    verdict: dict
    seconds: float

    @property
    def likely(self) -> list[str]:
        """Effects that the verdict holds more likely than not."""
        return [e["effect"] for e in self.verdict.get("effects", []) if e["probability"] > LIKELY]

    @property
    def said(self) -> str:
        """The verdict's kind."""
        return self.verdict.get("verdict", "failed")

    @property
    def right(self) -> bool:
        """Whether the verdict is what the truth asks for."""
        if self.truth["effects"]:
            return self.named_right() or self.ambiguous_right()
        if self.truth["unlisted"]:
            located = {entry["place"] for entry in self.verdict.get("located", [])}
            true_places = {place for places in self.truth["places"].values() for place in places}
            return self.said == "unknown" and bool(located & true_places)
        return self.said == "nothing-missing"

    def named_right(self) -> bool:
        """All true effects first, no false one likely."""
        true = set(self.truth["effects"])
        listed = [e["effect"] for e in self.verdict.get("effects", [])]
        return self.said == "named" and set(listed[: len(true)]) == true and set(self.likely) <= true

    def ambiguous_right(self) -> bool:
        """A weak truth that is among what the recordings cannot tell apart."""
        offered = {e["effect"] for e in self.verdict.get("effects", [])}
        offered |= {name for names in self.verdict.get("alternatives", []) for name in names}
        return self.said == "ambiguous" and self.truth["strength"] == "weak" and set(self.truth["effects"]) <= offered

    @property
    def confidently_wrong(self) -> bool:
        """A wrong verdict with a false effect held nearly certain."""
        true = set(self.truth["effects"])
        return not self.right and any(
            e["probability"] > CONFIDENT and e["effect"] not in true for e in self.verdict.get("effects", [])
        )

    @property
    def false_alarm(self) -> bool:
        """Something named or unknown where nothing material is missing."""
        return self.truth["group"] in ("healthy", "dirty") and self.said in ("named", "ambiguous", "unknown")

    @property
    def held_out_ratio(self) -> float | None:
        """Held-out error of the improved over the refitted model, of the worst signal."""
        fit = self.verdict.get("fit", {})
        refitted = (fit.get("refitted") or {}).get("held_out") or {}
        improved = (fit.get("improved") or {}).get("held_out") or {}
        ratios = [improved[s] / refitted[s] for s in refitted if improved.get(s) is not None and refitted[s]]
        return max(ratios, default=None)


def diagnose(folder: Path, pneuma: Path) -> float:
    """Runs the tool on a case; returns its seconds. Its complaints are kept beside the verdict."""
    train = [path.name for path in sorted(folder.glob("train-*.csv"))]
    held = [path.name for path in sorted(folder.glob("held-*.csv"))]
    command = [str(pneuma), "diagnose", "--rig", "rig.toml", "--train", *train, "--held-out", *held]
    started = time.monotonic()
    with (folder / "diagnose.log").open("w") as log:
        try:
            subprocess.run(
                [*command, "--json", "verdict.json"],
                cwd=folder, stdout=log, stderr=log, timeout=TIME_LIMIT_S, check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            log.write(f"stopped after {TIME_LIMIT_S} s\n")
    return time.monotonic() - started


def judge(folder: Path, pneuma: Path, again: bool) -> Outcome:
    """The verdict of a case, made if it is missing."""
    path = folder / "verdict.json"
    if again:
        path.unlink(missing_ok=True)
    seconds = None if path.exists() else diagnose(folder, pneuma)
    truth = json.loads((folder / "truth.json").read_text())
    verdict = json.loads(path.read_text()) if path.exists() else {}
    return Outcome(folder.name, truth, verdict, seconds if seconds is not None else verdict.get("seconds", 0.0))


def line(outcome: Outcome) -> str:
    """One case in a line."""
    truth = outcome.truth
    wrong = "+".join(truth["effects"] or truth["unlisted"] or truth["immaterial"]) or "healthy"
    effects = ", ".join(f"{e['effect']} {e['probability']:.2f}" for e in outcome.verdict.get("effects", []))
    ratio = outcome.held_out_ratio
    return (
        f"{outcome.name}  {wrong} ({truth['group']}, {truth['strength']}, {truth['begins']})  ->  {outcome.said}: "
        f"{effects or '-'}  {'right' if outcome.right else 'WRONG'}  {outcome.seconds:.0f} s  "
        f"held-out {'-' if ratio is None else f'{ratio:.2f}'}"
    )


def row(label: str, outcomes: list[Outcome]) -> str:
    """A row of the table."""
    right = sum(outcome.right for outcome in outcomes)
    confident = sum(outcome.confidently_wrong for outcome in outcomes)
    alarms = sum(outcome.false_alarm for outcome in outcomes)
    failed = sum(outcome.said == "failed" for outcome in outcomes)
    share = f"{100 * right / len(outcomes):.0f} %" if outcomes else "-"
    return f"| {label} | {len(outcomes)} | {right} | {share} | {confident} | {alarms} | {failed} |"


def table(outcomes: list[Outcome]) -> str:
    """Totals by group and by strength."""
    lines = [
        "| cases | number | right | share | confident (>0.9) but wrong | false alarms | no verdict |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [row(group, [o for o in outcomes if o.truth["group"] == group]) for group in GROUPS]
    for strength in ("weak", "medium", "strong"):
        lines.append(row(strength, [o for o in outcomes if o.truth["strength"] == strength]))
    return "\n".join([*lines, row("all", outcomes)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", type=Path, metavar="DIR")
    parser.add_argument("--pneuma", type=Path, required=True)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--only", default="*", metavar="GLOB")
    parser.add_argument("--again", action="store_true", help="also where there is a verdict.json")
    arguments = parser.parse_args()
    folders = sorted(path.parent for path in arguments.cases.glob(f"{arguments.only}/truth.json"))
    outcomes = []
    with ThreadPoolExecutor(arguments.jobs) as pool:
        for outcome in pool.map(lambda folder: judge(folder, arguments.pneuma.resolve(), arguments.again), folders):
            print(line(outcome), flush=True)
            outcomes.append(outcome)
    print("\n" + table(outcomes))


if __name__ == "__main__":
    main()
