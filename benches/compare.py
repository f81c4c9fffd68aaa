#!/usr/bin/env python3
"""Compares the loop of trackside with that of others: a chain of instances of one FMU of FMI 2.0, nothing recorded.

usage: compare.py FMU INPUT OUTPUT [--nodes N] [--steps N] [--rounds N] [--program trackside] [--venv DIR] [--packed]

INPUT and OUTPUT are names of Real variables. What counts is processor time, in all threads of a program, and all programs
take turns, so that other work on the machine matters little; the table has medians. Those of trackside are of whole
processes, less one that does a single step. The others measure their loop themselves: a loop in C with nothing around it, the
containers of FMPy and of FMU Manipulation Toolbox and, with `--packed`, the FMU that `trackside pack --fmu` makes of the chain (whose
library is built first), each in the same loop, Ecos, libcosim, fmpy. `--venv DIR` makes an environment for the Python packages there, with pip; without it this Python is
used. What is not there is said and left out.
"""

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path

from environment import environment

STEP = 0.1
# Ecos needs a library that another package brings.
PACKAGES = ["ecospy", "tbb", "libcosimpy", "fmpy", "fmu-manipulation-toolbox"]
# So many times fewer steps than trackside, for those that take long.
FEWER = {"FMPy's container": 1, "fmucontainer": 2, "Ecos": 10, "libcosim": 100, "fmpy": 20}


def ecos(fmu, names, nodes, steps):
    """Processor time of a step of the chain [ns]."""
    from ecospy import EcosSimulation, EcosSimulationStructure

    structure = EcosSimulationStructure()
    for i in range(nodes):
        structure.add_model(f"n{i}", fmu)
    for i in range(1, nodes):
        structure.make_real_connection(f"n{i - 1}::{names[1]}", f"n{i}::{names[0]}")
    simulation = EcosSimulation(structure=structure, step_size=STEP)
    simulation.init()
    begin = time.process_time()
    simulation.step(steps)
    return (time.process_time() - begin) / steps * 1e9


def libcosim(fmu, names, nodes, steps):
    """Processor time of a step of the chain [ns]."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(step_size=int(STEP * 1e9))
    made = [
        execution.add_local_slave(CosimLocalSlave(fmu_path=fmu, instance_name=f"n{i}"))
        for i in range(nodes)
    ]
    known = {v.name.decode(): v.reference for v in execution.slave_variables(made[0])}
    for one, other in zip(made, made[1:]):
        execution.connect_real_variables(one, known[names[1]], other, known[names[0]])
    begin = time.process_time()
    execution.step(steps)
    return (time.process_time() - begin) / steps * 1e9


def fmpy(fmu, names, nodes, steps):
    """Processor time of a step of the chain [ns], with the calls of fmpy's own slaves from Python."""
    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Slave

    about, folder = read_model_description(fmu), extract(fmu)
    references = {v.name: v.valueReference for v in about.modelVariables}
    given, taken = ([references[name]] for name in names)
    chain = []
    for i in range(nodes):
        slave = FMU2Slave(
            guid=about.guid,
            unzipDirectory=folder,
            modelIdentifier=about.coSimulation.modelIdentifier,
            instanceName=f"n{i}",
        )
        slave.instantiate()
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        chain.append(slave)
    begin = time.process_time()
    for tick in range(steps):
        value = [float(tick)]
        for slave in chain:
            slave.setReal(given, value)
            slave.doStep(tick * STEP, STEP)
            value = slave.getReal(taken)
    return (time.process_time() - begin) / steps * 1e9


def container(fmu, names, nodes, steps):
    """Processor time of a step of the chain [ns] as one FMU of FMPy, whose outer input and output the loop in C sets and reads."""
    from fmpy import read_model_description
    from fmpy.container_fmu.cli import create_container_fmu
    from fmpy.container_fmu.config import Component, Configuration, Connection
    from fmpy.model_description import CoSimulation, ModelDescription, ModelVariable, Unknown

    about = read_model_description(fmu)
    variables = {it.name: it for it in about.modelVariables}
    given, taken = (variables[name] for name in names)
    components = [Component(f"n{i}", Path(fmu), about) for i in range(nodes)]
    links = zip(components, components[1:])
    outer = ModelDescription(
        fmiVersion="2.0",
        modelName="chain",
        instantiationToken="chain",
        coSimulation=CoSimulation(modelIdentifier="container_fmu", fixedInternalStepSize=STEP),
        modelVariables=[
            ModelVariable(name="u", valueReference=0, type="Real", causality="input", variability="continuous"),
            ModelVariable(name="y", valueReference=1, type="Real", causality="output", variability="continuous"),
        ],
    )
    outer.outputs = [Unknown(variable=outer.modelVariables[1])]
    configuration = Configuration(
        parallelDoStep=False,
        modelDescription=outer,
        components=components,
        connections=[Connection(one, [taken], other, [given]) for one, other in links],
        variableMappings={
            outer.modelVariables[0]: [(components[0], given)],
            outer.modelVariables[1]: [(components[-1], taken)],
        },
    )
    with tempfile.TemporaryDirectory() as folder:
        inside = Path(folder) / "unzipped"
        inside.mkdir()
        create_container_fmu(configuration, inside, Path(folder) / "chain.fmu")
        # Version 0.3.32 writes the connections with the word of FMI 2, and its library expects that of FMI 3.
        description = inside / "resources" / "container.json"
        description.write_text(description.read_text().replace('"Real"', '"Float64"'))
        library = inside / "binaries" / "linux64" / "container_fmu.so"
        words = [compiled(Path(folder)), library, "chain", (inside / "resources").as_uri()]
        # Its own references begin at 1: 0 is the time.
        words += ["1", "2", "1", str(steps)]
        return float(subprocess.run(words, capture_output=True, text=True, check=True).stdout)


def fmucontainer(fmu, names, nodes, steps):
    """The same as one FMU of FMU Manipulation Toolbox, whose instances step one after the other."""
    from fmu_manipulation_toolbox.assembly import AssemblyNode

    given, taken = names
    chain = AssemblyNode("chain.fmu", step_size=STEP, auto_link=False, auto_input=False, auto_output=False)
    with tempfile.TemporaryDirectory() as folder:
        for i in range(nodes):
            chain.add_fmu(f"n{i}.fmu", fmu)
        for i in range(1, nodes):
            chain.add_link(f"n{i - 1}.fmu", taken, f"n{i}.fmu", given)
        chain.add_input("u", "n0.fmu", given)
        chain.add_output(f"n{nodes - 1}.fmu", taken, "y")
        chain.make_fmu(Path(folder))
        return in_c(Path(folder) / "chain.fmu", ("u", "y"), 1, steps)


def in_c(fmu, names, nodes, steps):
    """Processor time of a step of a chain of an FMU in the loop in C [ns]."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        library, guid, resources, references = unpacked(fmu, folder / "fmu")
        words = [compiled(folder), library, guid, resources, *(references[it] for it in names)]
        words += [str(nodes), str(steps)]
        return float(subprocess.run(words, capture_output=True, text=True, check=True).stdout)


PEERS = {"FMPy's container": container, "fmucontainer": fmucontainer, "Ecos": ecos, "libcosim": libcosim, "fmpy": fmpy}


def peer(name, python, arguments, folder):
    """Processor time of a step of another program [ns], in a process of its own; nothing when it is not there."""
    words = [arguments.fmu, arguments.input, arguments.output, "--nodes", str(arguments.nodes)]
    words += ["--steps", str(max(arguments.steps // FEWER[name], 1)), "--peer", name]
    command = [python, os.path.abspath(__file__), *words]
    libraries = {"LD_LIBRARY_PATH": str(Path(python).parent.parent / "lib")}
    around = os.environ | libraries
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=around)
    lines = [line for line in ended.stdout.splitlines() if line.startswith("{")]
    if ended.returncode or not lines:
        why = (ended.stderr.strip().splitlines() or ["it says nothing"])[-1]
        print(f"{name} is left out: {why}", file=sys.stderr)
        return None
    return json.loads(lines[-1])["ns"]


def compiled(folder):
    """The program of bare.c."""
    program = folder / "bare"
    source = Path(__file__).with_name("bare.c")
    subprocess.run(["cc", "-O2", source, "-o", program, "-ldl"], check=True)
    return program


def unpacked(fmu, folder):
    """Library, GUID, resources and value references by name of an FMU."""
    zipfile.ZipFile(fmu).extractall(folder)
    about = ET.parse(folder / "modelDescription.xml").getroot()
    identifier = about.find("CoSimulation").get("modelIdentifier")
    variables = about.find("ModelVariables")
    references = {it.get("name"): it.get("valueReference") for it in variables}
    library = folder / "binaries" / "linux64" / f"{identifier}.so"
    return library, about.get("guid"), (folder / "resources").as_uri(), references


def scenario(arguments, steps):
    """The text of the chain."""
    lines = ["[time]", f"step = {STEP}", f"stop = {steps * STEP!r}", "[record]", 'except = ["*"]']
    for i in range(arguments.nodes):
        lines += ["[[fmu]]", f'name = "n{i}"', f"path = {json.dumps(arguments.fmu)}"]
        lines += ['unconnected = "start"']
    for i in range(1, arguments.nodes):
        lines += ["[[connect]]", f'from = "n{i - 1}.{arguments.output}"']
        lines += [f'to = "n{i}.{arguments.input}"']
    return "\n".join(lines) + "\n"


def used():
    """Processor time of all processes that this one started and that ended [s]."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def trackside(arguments, folder):
    """Processor times of a step of the loop, and of the whole process by steps [ns]."""

    def run(steps):
        path = folder / f"chain_{steps}.toml"
        path.write_text(scenario(arguments, steps))
        command = [arguments.program, "run", path, "--out", folder / "out", "--rerun", "off"]
        begin = used()
        ended = subprocess.run(command, capture_output=True, text=True)
        if ended.returncode:
            sys.exit(f"trackside: {ended.stderr}")
        return used() - begin

    start, whole = run(1), run(arguments.steps)
    return (whole - start) / arguments.steps * 1e9, whole / arguments.steps * 1e9


def packed(arguments, folder):
    """The chain as an FMU, with the first input and the last output."""
    path = folder / "packed.toml"
    path.write_text(scenario(arguments, 1))
    ends = [f"n0.{arguments.input}", f"n{arguments.nodes - 1}.{arguments.output}"]
    words = [path, "--fmu", "chain", "--inputs", ends[0], "--outputs", ends[1], "--out", folder]
    subprocess.run([arguments.program, "pack", *words], capture_output=True, text=True, check=True)
    return folder / "chain.fmu", ends


def table(times):
    """Prints medians, and how many times as long as bare C they are."""
    bare = statistics.median(times["bare C"])
    print(f"{'program':24} {'us per step':>12} {'times bare C':>13} {'rounds':>7}")
    for name, found in times.items():
        if found:
            median = statistics.median(found)
            print(f"{name:24} {median * 1e-3:12.3f} {median / bare:13.2f} {len(found):7}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("fmu", type=os.path.abspath)
    parser.add_argument("input")
    parser.add_argument("output")
    parser.add_argument("--nodes", type=int, default=3)
    parser.add_argument("--steps", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--program", default="target/release/trackside", type=os.path.abspath)
    parser.add_argument("--venv")
    parser.add_argument("--packed", action="store_true")
    parser.add_argument("--peer", choices=PEERS, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    names = (arguments.input, arguments.output)
    if arguments.peer:
        found = PEERS[arguments.peer](arguments.fmu, names, arguments.nodes, arguments.steps)
        print(json.dumps({"ns": found}), flush=True)
        return
    python = environment(arguments.venv, PACKAGES)
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        times = {"bare C": [], "trackside": [], "trackside, with its start": [], "a scenario as FMU": []}
        chain = packed(arguments, folder) if arguments.packed else None
        times |= {name: [] for name in PEERS}
        for _ in range(arguments.rounds):
            times["bare C"].append(in_c(arguments.fmu, names, arguments.nodes, arguments.steps))
            loop, whole = trackside(arguments, folder)
            times["trackside"].append(loop)
            times["trackside, with its start"].append(whole)
            if chain:
                times["a scenario as FMU"].append(in_c(*chain, 1, arguments.steps))
            for name in PEERS:
                found = peer(name, python, arguments, folder)
                times[name] += [] if found is None else [found]
        table(times)


if __name__ == "__main__":
    main()
