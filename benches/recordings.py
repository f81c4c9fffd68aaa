#!/usr/bin/env python3
"""Measures what recordings cost: a chain of three FMUs, and the limit handling, each with and without.

usage: recordings.py [--fmu Feedthrough.fmu] [--rounds N] [--program trackside]

Run it in the workspace, with a release build. All ways take turns; the table has medians of the time that the report of a run
has: without building. The chain needs the FMU `Feedthrough` of the Reference FMUs for FMI 2.0; without it there is only the limit handling.
"""

import argparse
import json
import statistics
import subprocess
import tempfile
from pathlib import Path

STEPS = 300_000
LIMIT = Path("scenarios/limit_handling.toml")
NOTHING = '\n[record]\nexcept = ["*"]\n'


def chain(fmu, more):
    """Three instances in a row, each of which gives the next one its number."""
    text = f"[time]\nstep = 0.1\nstop = {STEPS / 10}\n{more}"
    for place in range(3):
        text += f'\n[[fmu]]\nname = "n{place}"\npath = "{fmu}"\nunconnected = "start"\n'
    for place in range(2):
        output, taken = "Float64_continuous_output", "Float64_continuous_input"
        text += f'\n[[connect]]\nfrom = "n{place}.{output}"\nto = "n{place + 1}.{taken}"\n'
    return text


def limit_handling(more):
    """The scenario without checks; without its replay, too, if nothing is recorded that this could show."""
    if more:
        return LIMIT.read_text().split("\n[[check]]")[0].split("\n[view")[0] + more
    return f'extends = "{LIMIT.resolve()}"\nwithout = {{ check = ["*"] }}\n'


def measure(program, scenario, replay, out):
    """Time that the run took [s]."""
    command = [program, "run", scenario, "--rerun", replay, "--out", out]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return json.loads((out / "report.json").read_text())["wall_seconds"]


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--fmu", type=Path)
    arguments.add_argument("--rounds", type=int, default=7)
    arguments.add_argument("--program", default="target/release/trackside")
    options = arguments.parse_args()
    folder = Path(tempfile.mkdtemp(dir=LIMIT.parent.parent / "target"))
    ways = []
    if options.fmu:
        fmu = options.fmu.resolve()
        ways += [("chain", "nothing", chain(fmu, NOTHING), "off"), ("chain", "run.mcap", chain(fmu, ""), "off")]
    ways += [("limit_handling", "nothing", limit_handling(NOTHING), "off")]
    ways += [("limit_handling", "run.mcap", limit_handling(""), "off")]
    ways += [("limit_handling", "run.mcap, run.rrd", limit_handling(""), "save")]
    times = [[] for _ in ways]
    for _ in range(options.rounds):
        for place, (_, _, text, replay) in enumerate(ways):
            scenario = folder / f"{place}.toml"
            scenario.write_text(text)
            times[place].append(measure(options.program, scenario, replay, folder / str(place)))
    first = {}
    for place, (run, what, _, _) in enumerate(ways):
        took = statistics.median(times[place])
        first.setdefault(run, took)
        each = f"{took / STEPS * 1e6:.2f} us a step" if run == "chain" else f"{took * 1e3:.0f} ms"
        files = [folder / str(place) / name for name in ("run.mcap", "run.rrd")]
        sizes = ", ".join(f"{file.stat().st_size / 1e6:.2f} MB" for file in files if file.exists())
        ratio = f"{took / first[run]:.2f} times"
        print(f"{run:15} {what:18} {each:15} {ratio:11} {sizes}")


if __name__ == "__main__":
    main()
