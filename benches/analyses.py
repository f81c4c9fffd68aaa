#!/usr/bin/env python3
"""Measures what analyses take: processor time and wall time of runs with them, less those of the same runs without.

usage: analyses.py [--rounds N] [--program trackside] [NAME...]

Run it in the workspace, with a release build. Runs with and without an analysis take turns; the table has the medians, and the
page is part of each. The packages of `crate` are built before the first round.
"""

import argparse
import statistics
import tempfile
from pathlib import Path

from processes import measured

ROOT = Path(__file__).resolve().parent.parent
# Name: scenario, and its tables that all runs are without.
ANALYSES = {
    "closed loop, 104 s at 100 Hz": ("closed_loop_identification.toml", ["validation", "check"]),
    "tires from driving, 40 s at 500 Hz": ("tires_from_driving.toml", ["check"]),
}


def scenario(file, tables):
    without = ", ".join(f'{table} = ["*"]' for table in tables)
    return f'extends = "{ROOT / "scenarios" / file}"\nwithout = {{ {without} }}\n'


def measure(program, path, out):
    """Processor time and wall time of a run [s]; a result that is doubtful took as long."""
    return measured([program, "run", path, "--rerun", "off", "--out", out], passes=(0, 4))[:2]


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--rounds", type=int, default=5)
    arguments.add_argument("--program", default="target/release/trackside")
    arguments.add_argument("names", nargs="*", metavar="NAME")
    options = arguments.parse_args()
    # In the workspace, whose packages the scenarios name.
    (ROOT / "target").mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(dir=ROOT / "target") as folder:
        folder = Path(folder)
        for name, (file, judges) in ANALYSES.items():
            if options.names and not any(wanted in name for wanted in options.names):
                continue
            paths = []
            for kind, tables in (("with", judges), ("less", [*judges, "analysis"])):
                paths.append(folder / f"{kind}.toml")
                paths[-1].write_text(scenario(file, tables))
                measure(options.program, paths[-1], folder / kind)
            rounds = [[measure(options.program, path, folder / path.stem) for path in paths] for _ in range(options.rounds)]
            processor, wall = (
                statistics.median(whole[kind] - less[kind] for whole, less in rounds) for kind in (0, 1)
            )
            print(f"{name:36} {processor:6.2f} s of processor time, {wall:6.2f} s", flush=True)


if __name__ == "__main__":
    main()
