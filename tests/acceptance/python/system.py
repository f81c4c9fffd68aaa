"""Lets fmpy simulate the FMU of a scenario and compares each output with the run of the scenario, bit by bit: system.py FMU CSV"""
import csv
import sys

import fmpy
import numpy as np

fmu, table = sys.argv[1:]
with open(table, newline="") as file:
    titles, *rows = csv.reader(file)
names = [title.partition(" [")[0] for title in titles]
values = np.array(rows, dtype=float)
description = fmpy.read_model_description(fmu)
outputs = [variable.name for variable in description.modelVariables if variable.causality == "output"]
experiment = description.defaultExperiment
step, stop = float(experiment.stepSize), float(experiment.stopTime)
result = fmpy.simulate_fmu(
    fmu, stop_time=stop, step_size=step, output_interval=step, fmi_type="CoSimulation", output=outputs
)
assert outputs and len(result) == len(values), f"{len(result)} rows against {len(values)}"
for name in outputs:
    assert np.array_equal(result[name], values[:, names.index(name)]), f"{name} differs"
print(f"{len(outputs)} outputs at {len(result)} points are equal")
