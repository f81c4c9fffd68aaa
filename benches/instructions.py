#!/usr/bin/env python3
"""Counts the instructions of small workloads of trackside by callgrind, and compares them with those of before: they repeat on a busy machine.

usage: instructions.py PROGRAM FMU [--golden FILE] [--bless] [--only NAME]

FMU is `Feedthrough.fmu` of the Reference FMUs 3.0, which a C compiler made once: one that cargo builds beside other crates has other counts
by a tenth. The table goes to standard output as JSON: the version of rustc, and by workload the instructions of the whole process in
millions, for runs of many steps less those of one step. With `--golden` a workload whose count differs by more than 3 % and 3 million from
that in the file ends the program with 1; `--bless` writes the file. Counts hold for one rustc and one profile, with CARGO_INCREMENTAL=0.
"""

import argparse
import csv
import json
import math
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

TOLERANCE = 0.03
# What threads of the program do by the clock, which a slow machine does more often [millions of instructions].
CLOCKWORK = 3.0
STEP = 0.01
LOG = """
[time]
step = 0.01
stop = 49.9
[[table]]
name = "log"
path = "log.csv"
time = "time"
[table.columns]
F = { column = "F", unit = "N" }
v = { column = "v", unit = "m/s" }
"""


def driven(fmu, nodes, steps, record, more=""):
    """FMUs that one signal drives; `more` goes to each connection."""
    lines = ["[time]", f"step = {STEP}", f"stop = {steps * STEP!r}", "[record]", "except = []" if record else "except = ['*']"]
    lines += ["[[signal]]", "name = 'driver.force'", "sine = { amplitude = 1.0, frequency = 1.0 }"]
    for node in range(nodes):
        lines += ["[[fmu]]", f"name = 'n{node}'", f"path = {json.dumps(str(fmu))}", "unconnected = 'start'"]
        lines += ["[[connect]]", "from = 'driver.force'", f"to = 'n{node}.Float64_continuous_input'", more]
    return "\n".join(lines) + "\n"


def judged(fmu, steps):
    """One of them with a noisy force and checks."""
    checks = [f"[[check]]\nname = 'c{k}'\nthat = 'n0.Float64_continuous_output < {k + 10}.0'\n" for k in range(20)]
    return driven(fmu, 1, steps, False, "noise = { std = 0.1 }") + "".join(checks)


def table(path, rows):
    """A log with a column of force."""
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["time", "F", "v"])
        writer.writerows([f"{k * STEP:.2f}", f"{math.sin(k * STEP):.6f}", f"{k % 100:.1f}"] for k in range(rows))


def workloads(fmu, folder):
    """The words after the program, by name; with others, what those take is left out."""
    def scenario(name, text):
        (folder / f"{name}.toml").write_text(text)
        # With a deadline each step is timed; without one that depends on how long steps take, and so on the machine.
        return ["run", f"{name}.toml", "--out", f"out_{name}", "--rerun", "off", "--realtime", "1e9"]

    table(folder / "log.csv", 5_000)
    return {
        "start of three FMUs": [scenario("start", driven(fmu, 3, 1, False))],
        "3 FMUs, 10,000 steps": [
            scenario("three", driven(fmu, 3, 10_001, False)),
            scenario("start", driven(fmu, 3, 1, False)),
        ],
        "30 FMUs, 1,000 steps": [
            scenario("thirty", driven(fmu, 30, 1_001, False)),
            scenario("thirty_start", driven(fmu, 30, 1, False)),
        ],
        "3 FMUs, 500 steps, recorded": [
            scenario("recorded", driven(fmu, 3, 501, True)) + ["--csv"],
            scenario("recorded_start", driven(fmu, 3, 1, True)) + ["--csv"],
        ],
        "noise and 20 checks, 2,000 steps": [
            scenario("judged", judged(fmu, 2_001)),
            scenario("judged_start", judged(fmu, 1)),
        ],
        "5,000 rows of a log": [scenario("log", LOG)],
        "inspect an FMU": [["inspect", str(fmu)]],
        "inspect an FMU as JSON": [["inspect", str(fmu), "--json"]],
        "inspect a log of 5,000 rows": [["inspect", "log.csv"]],
        "explain all keys": [["explain", "--all"]],
    }


def instructions(program, words, folder):
    """Millions of instructions of the program with these words."""
    command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={os.devnull}", program, *words]
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    found = re.search(r"Collected : (\d+)", ended.stderr)
    if ended.returncode or not found:
        sys.exit(f"{' '.join(words)}: exit code {ended.returncode}\n{ended.stderr}")
    return int(found[1]) / 1e6


def rustc():
    """The compiler that cargo calls here."""
    return subprocess.run(["rustc", "--version"], capture_output=True, text=True, check=True).stdout.strip()


def differences(counts, golden):
    """What is to be told of counts that are not those of before."""
    for name, count in counts.items():
        before = golden.get(name)
        if before is None:
            yield f"{name}: {count} million instructions, and the golden file does not know it"
        elif abs(count - before) > TOLERANCE * before + CLOCKWORK:
            yield f"{name}: {count} million instructions in place of {before}: {100 * (count / before - 1):+.1f} %"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=os.path.abspath)
    parser.add_argument("fmu", type=Path)
    parser.add_argument("--golden", type=Path)
    parser.add_argument("--bless", action="store_true")
    parser.add_argument("--only")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        chosen = workloads(arguments.fmu.absolute(), Path(folder))
        chosen = {name: words for name, words in chosen.items() if arguments.only in (None, name)}
        counts = {}
        for name, [measured, *left_out] in chosen.items():
            count = instructions(arguments.program, measured, folder)
            count -= sum(instructions(arguments.program, words, folder) for words in left_out)
            counts[name] = round(count, 3)
    text = json.dumps({"rustc": rustc(), "millions": counts}, indent=2) + "\n"
    print(text, end="")
    if arguments.golden and arguments.bless:
        arguments.golden.write_text(text)
    elif arguments.golden:
        golden = json.loads(arguments.golden.read_text())
        found = list(differences(counts, golden["millions"]))
        if found:
            if golden["rustc"] != rustc():
                print(f"The counts to compare with are of {golden['rustc']}, this is {rustc()}.", file=sys.stderr)
            print("\n".join(found), file=sys.stderr)
            print("If this is as it should be: the same command with --bless.", file=sys.stderr)
            sys.exit(1)


if __name__ == "__main__":
    main()
