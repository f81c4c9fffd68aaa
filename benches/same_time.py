#!/usr/bin/env python3
"""Compares two FMUs in one process with one or both in processes of their own, which step at the same time: wall time, nothing recorded.

usage: same_time.py PROGRAM [--times 20,50,100,200,500] [--rounds N] [--coupling gauss_seidel|jacobi]

Each FMU does the same work in each step; a loop in this process measures how much of it takes the wanted time [us]. The three ways take turns, and each
is a whole run less one of a single step. The table has medians of the rounds. It needs a C compiler.
"""

import argparse
import ctypes
import statistics
import subprocess
import tempfile
import time
import zipfile
from pathlib import Path

HERE = Path(__file__).parent
STEP = 0.01
# Each run takes about this time on one core [s].
LENGTH = 2.0
DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="busy" guid="{busy}">
  <CoSimulation modelIdentifier="busy" canHandleVariableCommunicationStepSize="true"/>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="x" valueReference="1" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="rounds" valueReference="2" causality="parameter" variability="fixed"><Integer start="1"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2" dependencies=""/></Outputs>
    <InitialUnknowns><Unknown index="2" dependencies=""/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""


def build(folder):
    """The library and the FMU."""
    library = folder / "busy.so"
    command = ["cc", "-O2", "-shared", "-fPIC", HERE / "busy.c", "-o", library]
    subprocess.run(command, check=True)
    with zipfile.ZipFile(folder / "busy.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION)
        archive.write(library, "binaries/linux64/busy.so")
    return library


def rounds_per_microsecond(library):
    """How much of its work takes 1 us here."""
    busy = ctypes.CDLL(str(library))
    busy.fmi2Instantiate.restype = ctypes.c_void_p
    model = ctypes.c_void_p(busy.fmi2Instantiate(None, 0, None, None, None, 0, 0))
    rounds = 1_000_000
    busy.fmi2SetInteger(model, None, ctypes.c_size_t(1), (ctypes.c_int * 1)(rounds))
    shortest = float("inf")
    for _ in range(20):
        begin = time.perf_counter()
        busy.fmi2DoStep(model, ctypes.c_double(0), ctypes.c_double(STEP), 0)
        shortest = min(shortest, time.perf_counter() - begin)
    return rounds / (shortest * 1e6)


def scenario(rounds, steps, coupling, isolated):
    """Two nodes that need nothing of each other, the last so many of them isolated."""
    start = f"start = {{ u = 0.5, rounds = {rounds} }}\n"
    nodes = "".join(
        f'[[fmu]]\nname = "{name}"\npath = "busy.fmu"\nisolate = {str(place < isolated).lower()}\n{start}'
        for place, name in [(1, "one"), (0, "other")]
    )
    return f'[time]\nstep = {STEP}\nstop = {steps * STEP}\n[coupling]\nalgorithm = "{coupling}"\n[record]\nexcept = ["*"]\n{nodes}'


def run(program, folder, text):
    """Wall time [s]."""
    (folder / "case.toml").write_text(text)
    begin = time.perf_counter()
    done = subprocess.run([program, "run", "case.toml", "--out", "out", "--rerun", "off"], cwd=folder, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(done.stderr)
    return time.perf_counter() - begin


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=Path)
    parser.add_argument("--times", default="20,50,100,200,500")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--coupling", default="gauss_seidel")
    arguments = parser.parse_args()
    program = arguments.program.resolve()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        per_microsecond = rounds_per_microsecond(build(folder))
        print("| step of each FMU [us] | one process [us] | one isolated [us] | times faster | both isolated [us] | times faster |")
        print("|---|---|---|---|---|---|")
        for microseconds in map(float, arguments.times.split(",")):
            steps = max(100, round(LENGTH / (2e-6 * microseconds)))
            rounds = round(microseconds * per_microsecond)
            measured = [[], [], []]
            for _ in range(arguments.rounds):
                for isolated, times in enumerate(measured):
                    whole, single = (
                        run(program, folder, scenario(rounds, count, arguments.coupling, isolated)) for count in (steps, 1)
                    )
                    times.append((whole - single) / (steps - 1) * 1e6)
            cells = [f"{statistics.median(measured[0]):.0f}"]
            for times in measured[1:]:
                ratios = [one / other for one, other in zip(measured[0], times)]
                cells += [f"{statistics.median(times):.0f}", f"{statistics.median(ratios):.2f}"]
            print(f"| {microseconds:g} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
