"""Gives an FMU by fmpy, call by call, the inputs of a run, and compares every output: replay.py NODE FMU CSV START"""
import csv
import json
import shutil
import sys

import fmpy
from fmpy.fmi2 import FMU2Slave

TOLERANCE = 1e-12

node, fmu, table, start = sys.argv[1:]
with open(table, newline="") as file:
    rows = [{title.partition(" [")[0]: value for title, value in row.items()} for row in csv.DictReader(file)]
description = fmpy.read_model_description(fmu)
folder = fmpy.extract(fmu)
slave = FMU2Slave(
    guid=description.guid, unzipDirectory=folder, instanceName=node,
    modelIdentifier=description.coSimulation.modelIdentifier,
)
slave.instantiate()
setters = {"Real": slave.setReal, "Integer": slave.setInteger, "Boolean": slave.setBoolean}
variables = {variable.name: variable for variable in description.modelVariables}
write = lambda name, value: setters[variables[name].type]([variables[name].valueReference], [value])
recorded = [name for name in rows[0] if name.startswith(f"{node}.")]
inputs = [name for name in recorded if variables[name.removeprefix(f"{node}.")].causality == "input"]
outputs = [name for name in recorded if name not in inputs]
assert inputs and outputs, recorded


def number(text):
    """The value of a cell: a number, or a Boolean as 0 or 1."""
    return float(text == "true") if text in ("true", "false") else float(text)


def give(row):
    for name in inputs:
        write(name.removeprefix(f"{node}."), number(row[name]))


def compare(row):
    worst = 0.0
    for name in outputs:
        variable = variables[name.removeprefix(f"{node}.")]
        get = {"Real": slave.getReal, "Boolean": slave.getBoolean}[variable.type]
        ours, theirs = number(row[name]), float(get([variable.valueReference])[0])
        difference = abs(ours - theirs) / max(1.0, abs(ours))
        assert difference <= TOLERANCE, f"{name} at {row['time']} s: {ours!r} against {theirs!r} with fmpy"
        worst = max(worst, difference)
    return worst


slave.setupExperiment(startTime=0.0, stopTime=float(rows[-1]["time"]))
for name, value in json.loads(start).items():
    write(name, value)
slave.enterInitializationMode()
give(rows[0])
slave.exitInitializationMode()
worst = compare(rows[0])
times = [float(row["time"]) for row in rows]
for time, end, row in zip(times, times[1:], rows[1:]):
    give(row)
    slave.doStep(currentCommunicationPoint=time, communicationStepSize=end - time)
    worst = max(worst, compare(row))
slave.terminate()
slave.freeInstance()
shutil.rmtree(folder)
print(f"{node}: {len(outputs)} outputs at {len(rows)} points, largest difference {worst:g}")
