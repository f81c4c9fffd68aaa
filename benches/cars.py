#!/usr/bin/env python3
"""Compares what a step of our cars costs with the cars of CommonRoad's package, which are written in Python.

usage: cars.py [--rounds N] [--substep PROGRAM] [--venv DIR]

PROGRAM is the built example: cargo build --release -p vehicle --example substep. Both sides take turns; the table has medians
of processor time. A step is one of the classical Runge-Kutta method, so four calls of the derivatives. `--venv DIR` makes an
environment for commonroad-vehicle-models there, with pip; without it this Python is used.

CommonRoad's single-track drift model (STD) has two wheels that spin on a Magic Formula with combined slip, its multi-body
model (MB) four of them under a body that rolls and pitches.
"""

import argparse
import re
import statistics
import subprocess
import sys
import time
from pathlib import Path

from environment import environment

PACKAGE = "commonroad-vehicle-models==3.0.2"
# The line of `substep` for each car, and CommonRoad's car beside it.
PAIRS = [("single track on MF 6.1, every option", "STD"), ("dual track on MF 6.2, with roll and pitch", "MB")]
STEPS = 2000


def ours(program):
    """Cost of a step [us] of each car, by the beginning of its line."""
    lines = subprocess.run([program], check=True, capture_output=True, text=True).stdout
    found = {}
    for name, _ in PAIRS:
        line = re.search(rf"^{re.escape(name)}.*: (\d+) ns a sub-step", lines, re.M)
        if not line:
            sys.exit(f"{program}: expected a line that begins with `{name}`, found\n{lines}")
        found[name] = float(line[1]) / 1000
    return found


def commonroad():
    """Cost of a step [us] of each of CommonRoad's cars, at 30 m/s in a gentle bend."""
    from vehiclemodels.init_mb import init_mb
    from vehiclemodels.init_std import init_std
    from vehiclemodels.parameters_vehicle2 import parameters_vehicle2
    from vehiclemodels.vehicle_dynamics_mb import vehicle_dynamics_mb
    from vehiclemodels.vehicle_dynamics_std import vehicle_dynamics_std

    car, step, demand = parameters_vehicle2(), 1e-3, [0.0, 0.5]
    first = [0.0, 0.0, 0.03, 30.0, 0.0, 0.0, 0.0]
    cars = {
        "STD": (vehicle_dynamics_std, init_std(first, car)),
        "MB": (vehicle_dynamics_mb, init_mb(first, car)),
    }
    found = {}
    for name, (rates, state) in cars.items():
        # A function of the package may write into the state that it is given.
        slope = lambda x: rates(list(x), demand, car)
        ahead = lambda x, f, h: [a + h * b for a, b in zip(x, f)]
        begin = time.process_time()
        for _ in range(STEPS):
            k1 = slope(state)
            k2 = slope(ahead(state, k1, step / 2))
            k3 = slope(ahead(state, k2, step / 2))
            k4 = slope(ahead(state, k3, step))
            state = [
                x + step / 6 * (a + 2 * b + 2 * c + d)
                for x, a, b, c, d in zip(state, k1, k2, k3, k4)
            ]
        found[name] = (time.process_time() - begin) / STEPS * 1e6
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--substep", default="target/release/examples/substep")
    parser.add_argument("--venv")
    arguments = parser.parse_args()
    if arguments.venv:
        python = environment(arguments.venv, [PACKAGE])
        again = [python, __file__, "--rounds", str(arguments.rounds), "--substep", arguments.substep]
        sys.exit(subprocess.run(again).returncode)
    if not Path(arguments.substep).exists():
        sys.exit(f"{arguments.substep} is not there: cargo build --release -p vehicle --example substep")
    rounds = [(ours(arguments.substep), commonroad()) for _ in range(arguments.rounds)]
    for name, other in PAIRS:
        mine = statistics.median(it[0][name] for it in rounds)
        theirs = statistics.median(it[1][other] for it in rounds)
        print(f"{name}: {mine:.2f} us a step; {other} of CommonRoad: {theirs:.0f} us, {theirs / mine:.0f} times as much")


if __name__ == "__main__":
    main()
