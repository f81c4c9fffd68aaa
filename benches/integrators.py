#!/usr/bin/env python3
"""Compares the integrator of trackside with CVODE in C: one FMU of FMI 2.0 for model exchange, nothing recorded, the same tolerance.

usage: integrators.py FMU OUTPUT [--step S] [--steps N] [--tolerance T] [--rounds N] [--program trackside]

OUTPUT is the name of a Real variable. Both programs take turns; the table has medians of processor time, that of trackside less a run of one step,
and the difference of OUTPUT at the end from that of CVODE at a thousandth of the tolerance. It needs cc and Debian's libsundials-dev.
"""

import argparse
import csv
import json
import os
import statistics
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path

from compare import used


def compiled(folder):
    """The program of cvode.c."""
    program = folder / "cvode"
    source = Path(__file__).with_name("cvode.c")
    libraries = ["sundials_cvode", "sundials_nvecserial", "sundials_sunlinsoldense", "sundials_sunmatrixdense", "dl", "m"]
    subprocess.run(["cc", "-O2", source, "-o", program, *(f"-l{it}" for it in libraries)], check=True)
    return program


def words_of_fmu(fmu, output, folder):
    """Library, GUID, resources, and the numbers of states and indicators; and the reference of the output."""
    zipfile.ZipFile(fmu).extractall(folder)
    about = ET.parse(folder / "modelDescription.xml").getroot()
    identifier = about.find("ModelExchange").get("modelIdentifier")
    variables = list(about.find("ModelVariables"))
    reals = [it.find("Real") for it in variables]
    states = sum(it is not None and it.get("derivative") is not None for it in reals)
    reference = next(it.get("valueReference") for it in variables if it.get("name") == output)
    library = folder / "binaries" / "linux64" / f"{identifier}.so"
    words = [library, about.get("guid"), (folder / "resources").as_uri()]
    return [*words, str(states), about.get("numberOfEventIndicators", "0")], reference


def scenario(arguments, steps, recorded):
    """The text of a run."""
    left_out = "" if recorded else '[record]\nexcept = ["*"]'
    return f"""[time]
step = {arguments.step!r}
stop = {arguments.step * steps!r}
{left_out}
[[fmu]]
name = "model"
path = {json.dumps(arguments.fmu)}
unconnected = "start"
interface = "model-exchange"
relative_tolerance = {arguments.tolerance!r}
absolute_tolerance = {arguments.tolerance / 100!r}
"""


def run(arguments, folder, steps, recorded=False):
    """Processor time of a run of this many steps [s]."""
    path = folder / "case.toml"
    path.write_text(scenario(arguments, steps, recorded))
    command = [arguments.program, "run", path, "--out", folder / "out", "--rerun", "off", "--csv"]
    begin = used()
    ended = subprocess.run(command, capture_output=True, text=True)
    if ended.returncode:
        sys.exit(f"trackside: {ended.stderr}")
    return used() - begin


def end_of_run(arguments, folder):
    """The output at the end of a run of all steps."""
    run(arguments, folder, arguments.steps, recorded=True)
    with (folder / "out" / "run.csv").open(newline="") as table:
        rows = list(csv.reader(table))
    column = next(i for i, name in enumerate(rows[0]) if name.split(" ")[0] == "model." + arguments.output)
    return float(rows[-1][column])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("fmu", type=os.path.abspath)
    parser.add_argument("output")
    parser.add_argument("--step", type=float, default=0.01)
    parser.add_argument("--steps", type=int, default=100_000)
    parser.add_argument("--tolerance", type=float, default=1e-6)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--program", default="target/release/trackside", type=os.path.abspath)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        words, reference = words_of_fmu(arguments.fmu, arguments.output, folder / "fmu")
        program = compiled(folder)

        def cvode(tolerance):
            numbers = [arguments.step, arguments.steps, tolerance, reference]
            command = [program, *words, *map(str, numbers)]
            said = subprocess.run(command, capture_output=True, text=True)
            if said.returncode:
                sys.exit(f"cvode: {said.stderr}")
            time, evaluations, value = said.stdout.split()
            return float(time), int(evaluations), float(value)

        *_, exact = cvode(arguments.tolerance / 1000)
        times = {"CVODE": [], "trackside": []}
        errors = {}
        for _ in range(arguments.rounds):
            time, evaluations, value = cvode(arguments.tolerance)
            times["CVODE"].append(time)
            errors["CVODE"] = abs(value - exact)
            whole = run(arguments, folder, arguments.steps)
            times["trackside"].append((whole - run(arguments, folder, 1)) / arguments.steps * 1e9)
        errors["trackside"] = abs(end_of_run(arguments, folder) - exact)
        base = statistics.median(times["CVODE"])
        print(f"CVODE evaluates the derivatives {evaluations / arguments.steps:.2f} times in a step")
        print(f"{'program':12} {'us per step':>12} {'times CVODE':>12} {'error at the end':>18}")
        for name, found in times.items():
            median = statistics.median(found)
            print(f"{name:12} {median * 1e-3:12.3f} {median / base:12.2f} {errors[name]:18.2e}")


if __name__ == "__main__":
    main()
