"""Runs the baselines on the case folders of a trial."""

import sys
import traceback
from pathlib import Path

import grey_box
import sparse_regression
from case_folder import write_verdict


def main() -> None:
    root = Path(sys.argv[1])
    for folder in sorted(path.parent for path in root.glob("*/rig.toml")):
        for baseline in (sparse_regression, grey_box):
            if (folder / f"{baseline.NAME}.json").exists():
                continue
            try:
                verdict = baseline.diagnose(folder)
            except (ValueError, FloatingPointError, ArithmeticError):
                traceback.print_exc()
                continue
            write_verdict(folder, baseline.NAME, verdict)
            print(f"{folder.name} {baseline.NAME}: {verdict['sentence']} ({verdict['seconds']:.0f} s)", flush=True)


if __name__ == "__main__":
    main()
