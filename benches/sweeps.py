#!/usr/bin/env python3
"""Compares the throughput of `trackside sweep` with that of fmpy and multiprocessing: variants of the double lane change in each.

usage: sweeps.py [--variants N] [--peer-variants N] [--jobs N] [--rounds N] [--program trackside] [--venv DIR]
       sweeps.py --leak [--variants N] [--program trackside]
       sweeps.py --scaling [--variants N] [--rounds N] [--program trackside]

Each variant has another mass, other grip and another seed. Both sides run the same three FMUs with the same start values, exchange the
same values at the same 1,000 steps, add noise of the same width to four signals, and judge the same five checks. Both take turns,
and the table has medians of wall time. fmpy may run fewer variants: its time is then scaled, which is said. What fmpy does not do and
trackside does: isolate FMUs that crash, check units, write a table and a page. `--venv DIR` makes an environment with fmpy there.

`--leak` runs all variants in one worker, and prints the memory of its processes after a tenth of them and at the end.
`--scaling` runs them in one worker and in two, by turns, with the plan, the table and the page, and prints how much faster two are.
"""

import argparse
import csv
import json
import math
import multiprocessing
import os
import random
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from environment import environment

ROOT = Path(__file__).resolve().parent.parent
STEP, STEPS = 0.01, 1000
V = 80.0 / 3.6
# What the sensors add: signal of the plant, input of the estimator, standard deviation.
NOISE = [
    ("v_x", "v_x_meas", 0.05),
    ("v_y", "v_y_meas", 0.01),
    ("r", "r_meas", 0.01),
    ("a_y", "a_y_meas", 0.1),
]
ESTIMATE = ["v_x", "v_y", "r", "xi_x", "xi_y", "xi_psi"]
COMMAND = ["F_x", "delta"]
VARIED = ["plant.body.m", "plant.tire_f.D", "plant.tire_r.D"]


def variants(count):
    """Values and seed of each variant, the same on both sides."""
    chance = random.Random(1)
    one = lambda seed: [chance.gauss(780.0, 40.0), *(chance.uniform(0.8, 1.8) for _ in "fr"), seed]
    return [one(1 + index) for index in range(count)]


def reference(t):
    """Heading [rad], yaw rate [rad/s] and lane [m] that are wanted at a time [s]."""
    psi, r = 0.0, 0.0
    lane = 3.5 * (min(max((t - 2.0) / 1.6, 0.0), 1.0) - min(max((t - 4.9) / 1.6, 0.0), 1.0))
    for start, sign in ((2.0, 1.0), (4.9, -1.0)):
        if start <= t < start + 1.6:
            turn = 2.0 * math.pi * 0.625 * (t - start)
            psi += sign * 0.0984375 * (1.0 - math.cos(turn))
            r += sign * 0.3865632 * math.sin(turn)
            lane -= sign * 0.5570423 * math.sin(turn)
    return psi, r, lane


class Node:
    """An instance of an FMU, its inputs and outputs by value references."""

    def __init__(self, unpacked, inputs, outputs):
        from fmpy.fmi2 import FMU2Slave

        about, folder = unpacked
        self.references = {it.name: it.valueReference for it in about.modelVariables}
        self.inputs = [self.references[name] for name in inputs]
        self.outputs = [self.references[name] for name in outputs]
        identifier = about.coSimulation.modelIdentifier
        self.slave = FMU2Slave(
            guid=about.guid, unzipDirectory=folder, modelIdentifier=identifier, instanceName="n"
        )
        self.slave.instantiate()

    def begin(self, start, given):
        """From a reset to the first outputs."""
        self.slave.reset()
        for name, value in start.items():
            give = self.slave.setInteger if isinstance(value, int) else self.slave.setReal
            give([self.references[name]], [value])
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()
        self.slave.setReal(self.inputs, given)
        self.slave.exitInitializationMode()
        return self.slave.getReal(self.outputs)

    def step(self, tick, given):
        """Outputs after a step with these inputs."""
        self.slave.setReal(self.inputs, given)
        self.slave.doStep(tick * STEP, STEP)
        return self.slave.getReal(self.outputs)


NODES = {}


def load(fmus):
    """The three FMUs of a worker: unpacked and loaded once."""
    from fmpy import extract, read_model_description

    unpacked = {it: (read_model_description(path), extract(path)) for it, path in fmus.items()}
    measured = [name for name, _, _ in NOISE]
    NODES["plant"] = Node(unpacked["plant"], COMMAND, [*measured, "psi", "Y"])
    taken = [name for _, name, _ in NOISE]
    NODES["estimator"] = Node(unpacked["estimator"], [*taken, *COMMAND], ESTIMATE)
    wanted = ["v_ref", "r_ref", "psi_ref", "psi"]
    NODES["controller"] = Node(unpacked["controller"], [*wanted, *ESTIMATE], COMMAND)


def variant(row):
    """Whether each check passes, of one variant."""
    *values, seed = row
    gauss = random.Random(seed).gauss
    noisy = lambda moved: [value + gauss(0.0, std) for value, (_, _, std) in zip(moved, NOISE)]
    plant, estimator, controller = (NODES[it] for it in ("plant", "estimator", "controller"))
    varied = {name.removeprefix("plant."): value for name, value in zip(VARIED, values)}
    command = [0.0, 0.0]
    moved = plant.begin({"start.v_x": V, **varied}, command)
    estimate = estimator.begin({"start.v_x": V}, [*noisy(moved), *command])
    psi, r, lane = reference(0.0)
    command = controller.begin({"mode": 1}, [V, r, psi, moved[4], *estimate])
    lane_kept = heading_kept = speed_kept = ends = True
    hardest = 0.0
    for tick in range(STEPS):
        moved = plant.step(tick, command)
        estimate = estimator.step(tick, [*noisy(moved), *command])
        t = (tick + 1) * STEP
        psi, r, lane = reference(t)
        command = controller.step(tick, [V, r, psi, moved[4], *estimate])
        v_x, _, yaw_rate, a_y, heading, Y = moved
        lane_kept &= t < 2.0 or abs(Y - lane) < 0.5
        heading_kept &= abs(heading - psi) < 0.05
        speed_kept &= abs(v_x - V) < 0.5
        hardest = max(hardest, abs(a_y))
        ends &= t < 9.0 or (abs(heading) < 0.01 and abs(yaw_rate) < 0.05)
    return lane_kept, heading_kept, speed_kept, hardest > 8.0, ends


def fmpy(arguments):
    """Time [s] and share of the variants that pass, by a pool of processes. What is loaded once is in the time, as in a sweep."""
    fmus = dict(zip(("plant", "estimator", "controller"), arguments.fmus))
    rows = variants(arguments.variants)
    begin = time.perf_counter()
    with multiprocessing.Pool(arguments.jobs, load, (fmus,)) as pool:
        found = pool.map(variant, rows, chunksize=max(1, len(rows) // (8 * arguments.jobs)))
    seconds = time.perf_counter() - begin
    print(json.dumps({"seconds": seconds, "share": statistics.mean(all(it) for it in found)}))


def written(arguments, folder, count):
    """A scenario with all its FMUs in a folder of its own, with so many variants; and the paths of its FMUs."""
    with open(folder / "variants.csv", "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*VARIED, "seed"])
        writer.writerows(variants(count))
    base = ROOT / "scenarios" / "double_lane_change.toml"
    text = f'extends = {json.dumps(str(base))}\n[sweep]\ndesign = "list"\nlist = "variants.csv"\n'
    (folder / "case.toml").write_text(text)
    plan = folder / "plan"
    # The crates of the FMUs are found, and built, from the workspace.
    command = [arguments.program, "sweep", "plan", folder / "case.toml", "--out", plan]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if ended.returncode:
        sys.exit(f"trackside sweep plan: {ended.stderr}")
    names = ("plant", "estimator", "controller")
    found = {path.stem: path for path in (plan / "scenario").rglob("*.fmu")}
    fmus = [next(path for stem, path in found.items() if stem.startswith(it)) for it in names]
    return plan / "scenario" / "case.toml", fmus


def sweep(arguments, case, out):
    """Starts a sweep."""
    words = ["sweep", case, "--out", out, "--jobs", str(arguments.jobs)]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([arguments.program, *words], **quiet)


def ended(process):
    """Waits for a sweep; checks that fail are results."""
    said = process.communicate()[1]
    if process.returncode not in (0, 1):
        sys.exit(f"trackside sweep: {said}")


def trackside(arguments, case, out):
    """Time [s] of the whole command, table and page too, and the share of the variants that pass."""
    begin = time.perf_counter()
    ended(sweep(arguments, case, out))
    seconds = time.perf_counter() - begin
    return seconds, json.loads((out / "sweep.json").read_text())["share"]


def peer(python, arguments, fmus):
    """Time [s] and share of fmpy, in a process of its own."""
    words = ["--variants", str(arguments.peer_variants), "--jobs", str(arguments.jobs), "--fmus"]
    command = [python, os.path.abspath(__file__), *words, *map(str, fmus)]
    said = subprocess.run(command, capture_output=True, text=True)
    if said.returncode:
        sys.exit(f"fmpy: {said.stderr}")
    found = json.loads(said.stdout.splitlines()[-1])
    return found["seconds"], found["share"]


def compare(arguments, folder):
    """Both by turns."""
    case, fmus = written(arguments, folder, arguments.variants)
    python = environment(arguments.venv, ["fmpy"])
    counts = {"trackside sweep": arguments.variants, "fmpy": arguments.peer_variants}
    found = {name: [] for name in counts}
    for number in range(arguments.rounds):
        found["trackside sweep"].append(trackside(arguments, case, folder / f"out{number}"))
        found["fmpy"].append(peer(python, arguments, fmus))
    print(f"{arguments.jobs} processes, median of {arguments.rounds} rounds, wall time")
    print(f"{'program':16} {'variants':>9} {'seconds':>9} {'variants/s':>11} {'passed':>8}")
    rates = {}
    for name, count in counts.items():
        seconds = statistics.median(seconds for seconds, _ in found[name])
        rates[name] = count / seconds
        share = found[name][-1][1]
        print(f"{name:16} {count:9} {seconds:9.2f} {rates[name]:11.2f} {share:8.3f}")
    if arguments.peer_variants < arguments.variants:
        whole = arguments.variants / rates["fmpy"]
        print(f"fmpy ran the first {arguments.peer_variants}; all would take it {whole:.1f} s")
    print(f"ratio: {rates['trackside sweep'] / rates['fmpy']:.1f}")


def memory(process):
    """Resident memory [kB] of the processes below one, by their numbers."""
    found, open_ones = {}, [str(process)]
    while open_ones:
        number = open_ones.pop()
        try:
            tasks = Path(f"/proc/{number}/task").iterdir()
            children = [it for task in tasks for it in (task / "children").read_text().split()]
            lines = [Path(f"/proc/{it}/status").read_text().splitlines() for it in children]
        except (FileNotFoundError, ProcessLookupError):
            continue
        for child, status in zip(children, lines):
            resident = [line.split()[1] for line in status if line.startswith("VmRSS")]
            found |= {child: int(it) for it in resident}
        open_ones += children
    return found


def leak(arguments, folder):
    """Memory of the one worker after a tenth of the variants and at the end, by time: variants take equally long."""
    arguments.jobs = 1
    case, _ = written(arguments, folder, arguments.variants)
    process = sweep(arguments, case, folder / "out")
    seen = []
    begin = time.perf_counter()
    while process.poll() is None:
        seen.append((time.perf_counter() - begin, memory(process.pid)))
        time.sleep(0.05)
    ended(process)
    seen = [(moment, found) for moment, found in seen if found]
    if not seen:
        sys.exit("leak: no worker was seen; ask for more variants")
    workers = {number for _, found in seen for number in found}
    print(f"{arguments.variants} variants in {seen[-1][0]:.1f} s, {len(workers)} processes below the program in all")
    early = next(it for it in seen if it[0] >= 0.1 * seen[-1][0])
    for name, (moment, found) in (("a tenth", early), ("the end", seen[-1])):
        sizes = ", ".join(f"{kb / 1024:.1f} MB" for kb in sorted(found.values(), reverse=True))
        print(f"{name}, after {moment:.1f} s: {sizes}")


def scaling(arguments, folder):
    """One worker and two by turns."""
    case, _ = written(arguments, folder, arguments.variants)
    ratios = []
    for number in range(arguments.rounds):
        seconds = []
        for arguments.jobs in (1, 2):
            seconds.append(trackside(arguments, case, folder / f"out{number}_{arguments.jobs}")[0])
        ratios.append(seconds[0] / seconds[1])
    told = ", ".join(f"{ratio:.2f}" for ratio in sorted(ratios))
    print(f"{arguments.variants} variants: two workers {statistics.median(ratios):.2f} times faster than one ({told})")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--variants", type=int)
    parser.add_argument("--peer-variants", type=int)
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--program", default="target/release/trackside", type=os.path.abspath)
    parser.add_argument("--venv")
    parser.add_argument("--leak", action="store_true")
    parser.add_argument("--scaling", action="store_true")
    parser.add_argument("--fmus", nargs=3, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    arguments.variants = arguments.variants or (20_000 if arguments.leak else 1000)
    arguments.peer_variants = arguments.peer_variants or arguments.variants
    if arguments.fmus:
        fmpy(arguments)
        return
    with tempfile.TemporaryDirectory() as folder:
        (leak if arguments.leak else scaling if arguments.scaling else compare)(arguments, Path(folder))


if __name__ == "__main__":
    main()
