#!/usr/bin/env python3
"""Measures what recordings cost: the limit handling, 5,000 signals, a chain of three FMUs, and one of 455 with 5,005 values, each with and without.

usage: recordings.py [--fmu Feedthrough.fmu] [--rounds N] [--program trackside]

Run it in the workspace, with a release build. All ways take turns; the table has medians of the time that the report of a run has, without building, of the processor time of
the whole program, and of its largest memory. The chains need the FMU `Feedthrough` of the Reference FMUs for FMI 2.0; without it there are none.
"""

import argparse
import json
import statistics
import subprocess
import tempfile
from pathlib import Path

from processes import measured

LENGTHS = {"chain of 3": (3, 300_000), "chain of 455": (455, 1_000)}
LIMIT = Path("scenarios/limit_handling.toml")
# Packages of the limit handling, and the archives that they are packed into.
PACKAGES = {"plant-fmu": "plant.fmu", "estimator": "estimator.fmu", "controller": "controller.fmu"}
NOTHING = '\n[record]\nexcept = ["*"]\n'


def chain(fmu, nodes, steps, more):
    """Instances in a row, each of which gives the next one its number."""
    text = f"[time]\nstep = 0.1\nstop = {steps / 10}\n{more}"
    for place in range(nodes):
        text += f'\n[[fmu]]\nname = "n{place}"\npath = "{fmu}"\nunconnected = "start"\n'
    for place in range(nodes - 1):
        output, taken = "Float64_continuous_output", "Float64_continuous_input"
        text += f'\n[[connect]]\nfrom = "n{place}.{output}"\nto = "n{place + 1}.{taken}"\n'
    return text


def signals(more):
    """5,000 sines over 1,000 steps."""
    text = f"[time]\nstep = 0.01\nstop = 10.0\n{more}"
    for place in range(5_000):
        wave = f"{{ amplitude = {1 + place % 7}.0, frequency = {0.1 + 0.001 * place:.3f} }}"
        text += f'\n[[signal]]\nname = "s.x{place}"\nsine = {wave}\n'
    return text


def packed_limit_handling(program, folder):
    """The scenario on packed FMUs: a run with crates would count the processor time of cargo."""
    subprocess.run([program, "pack", "--out", folder / "fmu", *PACKAGES], check=True, capture_output=True)
    text = LIMIT.read_text()
    for package, archive in PACKAGES.items():
        text = text.replace(f'crate = "{package}"', f'path = "fmu/{archive}"')
    return text


def limit_handling(text, more):
    """The scenario without checks; without its view, too, if nothing is recorded that this could show."""
    drive, judged = text.split("\n[[check]]", 1)
    return drive + (more or "\n[view" + judged.split("\n[view", 1)[1])


def measure(program, scenario, replay, out):
    """Time that the run took [s], processor time of the program [s], and its largest memory [MB]."""
    processor, _, memory = measured([program, "run", scenario, "--rerun", replay, "--out", out])
    return json.loads((out / "report.json").read_text())["wall_seconds"], processor, memory


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--fmu", type=Path)
    arguments.add_argument("--rounds", type=int, default=7)
    arguments.add_argument("--program", default="target/release/trackside")
    options = arguments.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        compare(options, Path(folder))


def compare(options, folder):
    """The table of all ways."""
    packed = packed_limit_handling(options.program, folder)
    texts = {"limit_handling": lambda more: limit_handling(packed, more), "5,000 signals": signals}
    if options.fmu:
        fmu = options.fmu.resolve()
        for name, (nodes, steps) in LENGTHS.items():
            texts[name] = lambda more, nodes=nodes, steps=steps: chain(fmu, nodes, steps, more)
    ways = []
    for name, text in texts.items():
        ways += [(name, "nothing", text(NOTHING), "off"), (name, "run.mcap", text(""), "off")]
        # Hours of one number are no replay.
        if name != "chain of 3":
            ways += [(name, "run.mcap, run.rrd", text(""), "save")]
    rounds = [[] for _ in ways]
    for _ in range(options.rounds):
        for place, (_, _, text, replay) in enumerate(ways):
            scenario = folder / f"{place}.toml"
            scenario.write_text(text)
            rounds[place].append(measure(options.program, scenario, replay, folder / str(place)))
    first = {}
    print(f"{'run':15} {'recordings':18} {'wall':>10} {'':12} {'processor':>10} {'':12} {'memory':>8}  files")
    for place, (run, what, _, _) in enumerate(ways):
        wall, processor, memory = (statistics.median(column) for column in zip(*rounds[place]))
        least = first.setdefault(run, (wall, processor))
        ratios = [f"{took / of:.2f} times" for took, of in zip((wall, processor), least)]
        files = [folder / str(place) / name for name in ("run.mcap", "run.rrd")]
        sizes = ", ".join(f"{file.stat().st_size / 1e6:.2f} MB" for file in files if file.exists())
        times = f"{wall * 1e3:7.0f} ms {ratios[0]:12} {processor * 1e3:7.0f} ms {ratios[1]:12}"
        print(f"{run:15} {what:18} {times} {memory:5.0f} MB  {sizes}")


if __name__ == "__main__":
    main()
