#!/usr/bin/env python3
"""Measures a step of `trackside.Session` with one value in and one value out, beside the calls of the FMU by themselves.

usage: sessions.py FMU INPUT OUTPUT [--steps N] [--rounds N] [--program trackside] [--venv DIR]

The FMU is one of FMI 2.0, INPUT and OUTPUT are names of Real variables. What counts is processor time of the process, and all take turns, so that
other work on the machine matters little; the table has medians. `bare C` is a loop with nothing around it, `ctypes` the same
loop in Python with arguments that are made once, `fmpy` its slaves from Python. `Session.step(n)` steps without a word from
Python in between, so what the coupling costs is its difference to bare C, and what Python costs is the difference of
`Session` to that. `--venv DIR` makes an environment with fmpy there; the package pyarrow is needed for trackside.
"""

import argparse
import ctypes
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from compare import STEP, compiled, fmpy, unpacked
from environment import environment

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "python"))
PACKAGES = ["fmpy", "pyarrow"]


def plain(fmu, names, steps, folder):
    """Processor time of a step by calls of ctypes [us]."""
    library, guid, resources, references = unpacked(fmu, folder)
    library = ctypes.CDLL(str(library))
    logger = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(lambda _: None)
    callbacks = (ctypes.c_void_p * 5)(ctypes.cast(logger, ctypes.c_void_p), None, None, None, None)
    library.fmi2Instantiate.restype = ctypes.c_void_p
    instance = library.fmi2Instantiate(b"one", 1, guid.encode(), resources.encode(), callbacks, 0, 0)
    instance, zero = ctypes.c_void_p(instance), ctypes.c_double(0.0)
    status = library.fmi2SetupExperiment(instance, 0, zero, zero, 0, zero)
    status |= library.fmi2EnterInitializationMode(instance) | library.fmi2ExitInitializationMode(instance)
    given, taken = (ctypes.byref(ctypes.c_uint32(int(references[name]))) for name in names)
    value, now = ctypes.c_double(), ctypes.c_double()
    place, size, one = ctypes.byref(value), ctypes.c_double(STEP), ctypes.c_size_t(1)
    set_real, do_step, get_real = library.fmi2SetReal, library.fmi2DoStep, library.fmi2GetReal
    begin = time.process_time()
    for tick in range(steps):
        value.value = float(tick)
        now.value = tick * STEP
        status |= set_real(instance, given, one, place)
        status |= do_step(instance, now, size, 1)
        status |= get_real(instance, taken, one, place)
        value.value
    used = time.process_time() - begin
    assert status == 0, f"the FMU returned {status}"
    return used / steps * 1e6


def sessions(fmu, names, steps):
    """Processor times of a step of a session in three ways [us]."""
    import trackside

    with tempfile.TemporaryDirectory() as folder:
        scenario = Path(folder) / "one.toml"
        lines = ["[time]", f"step = {STEP}", f"stop = {STEP}", "[[fmu]]", 'name = "one"', f"path = {json.dumps(fmu)}", 'unconnected = "start"']
        scenario.write_text("\n".join(lines))
        given, taken = (f"one.{name}" for name in names)
        with trackside.Session(scenario) as session:
            session.step()
            state, found = session.save(), {}

            def measure(name, work):
                session.restore(state)
                begin = time.process_time()
                work()
                found[name] = (time.process_time() - begin) / steps * 1e6

            def talk():
                for tick in range(steps):
                    session[given] = float(tick)
                    session.step()
                    session[taken]

            measure("Session.step(n)", lambda: session.step(steps))
            measure("Session: set, step, get", talk)
            session.attach(lambda time, y: y, inputs=[taken], outputs=[given])
            measure("Session.attach", lambda: session.step(steps))
    return found


def main():
    """Take turns, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("fmu", type=os.path.abspath)
    parser.add_argument("input")
    parser.add_argument("output")
    parser.add_argument("--steps", type=int, default=100_000)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--program", default="target/release/trackside", type=os.path.abspath)
    parser.add_argument("--venv")
    parser.add_argument("--round", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    names = (arguments.input, arguments.output)
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        if arguments.round:
            found = sessions(arguments.fmu, names, arguments.steps)
            found["ctypes"] = plain(arguments.fmu, names, arguments.steps, folder / "fmu")
            found["fmpy"] = fmpy(arguments.fmu, names, 1, max(arguments.steps // 10, 1)) * 1e-3
            print(json.dumps(found), flush=True)
            return
        python = environment(arguments.venv, PACKAGES)
        library, guid, resources, references = unpacked(arguments.fmu, folder / "fmu")
        bare = [compiled(folder), library, guid, resources, *(references[it] for it in names), "1", str(arguments.steps)]
        words = [python, os.path.abspath(__file__), arguments.fmu, *names, "--steps", str(arguments.steps), "--round"]
        times = {}
        for _ in range(arguments.rounds):
            said = subprocess.run(bare, capture_output=True, text=True, check=True).stdout
            round_ = {"bare C": float(said) * 1e-3}
            around = os.environ | {"TRACKSIDE_PROGRAM": arguments.program}
            ended = subprocess.run(words, capture_output=True, text=True, env=around)
            if ended.returncode:
                sys.exit(ended.stderr)
            round_ |= json.loads(ended.stdout.splitlines()[-1])
            for name, used in round_.items():
                times.setdefault(name, []).append(used)
    medians = {name: statistics.median(used) for name, used in times.items()}
    print(f"{'loop':26} {'us per step':>12} {'times ctypes':>13}")
    for name, used in sorted(medians.items(), key=lambda it: it[1]):
        print(f"{name:26} {used:12.2f} {used / medians['ctypes']:13.2f}")
    coupling = medians["Session.step(n)"] - medians["bare C"]
    python = medians["Session: set, step, get"] - medians["Session.step(n)"]
    print(f"coupling {coupling:.2f} us and Python {python:.2f} us beyond the calls of the FMU")


if __name__ == "__main__":
    main()
