#!/usr/bin/env python3
"""Compares the throughput of `trackside sweep` with that of fmpy and multiprocessing: variants of the double lane change in each.

usage: sweeps.py [--variants N] [--peer-variants N] [--jobs N] [--rounds N] [--program trackside] [--venv DIR]
       sweeps.py --leak [--variants N] [--program trackside]

Each variant has another mass, other grip and another seed. Both sides run the same three FMUs with the same start values, exchange the
same values at the same 1,000 steps, add noise of the same width to four signals, and judge the same five checks. Both take turns,
and the table has medians of wall time. fmpy may run fewer variants: its time is then scaled, which is said. What fmpy does not do and
trackside does: isolate FMUs that crash, check units, write a table and a page. `--venv DIR` makes an environment with fmpy there.

`--leak` runs all variants in one worker, and prints the memory of its processes after a tenth of them and at the end.
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
import venv
from pathlib import Path

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
    one = lambda seed: [chance.gauss(780.0, 40.0), *(chance.uniform(1.2, 1.8) for _ in "fr"), seed]
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
        names, values = list(start), list(start.values())
        self.slave.setReal([self.references[name] for name in names], values)
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
    command = controller.begin({}, [V, r, psi, moved[4], *estimate])
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
