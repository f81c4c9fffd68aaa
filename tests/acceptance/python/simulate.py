"""Lets fmpy simulate an FMU with recorded inputs and compares every output: simulate.py NODE FMU CSV START"""
import csv
import json
import sys

import fmpy
import numpy as np

TOLERANCE = 1e-12

node, fmu, table, start = sys.argv[1:]
with open(table, newline="") as file:
    titles, *rows = csv.reader(file)
names = [title.partition(" [")[0] for title in titles]
values = np.array(rows, dtype=float)
recorded = {name: values[:, column] for column, name in enumerate(names)}
time = recorded["time"]
step = time[1]

variables = fmpy.read_model_description(fmu).modelVariables
columns = [name.removeprefix(f"{node}.") for name in names if name.startswith(f"{node}.")]
# Inputs that nothing feeds are no columns, and stay at their start values on both sides.
inputs = [variable.name for variable in variables if variable.causality == "input" and variable.name in columns]
outputs = [name for name in columns if name not in inputs]
assert outputs and inputs, f"no outputs or no inputs in {columns}"

# A row holds the inputs of the step that ended there; fmpy wants the inputs from a time on.
given = np.zeros(len(time), dtype=[(name, float) for name in ["time"] + inputs])
given["time"] = time
for name in inputs:
    given[name] = np.append(recorded[f"{node}.{name}"][1:], recorded[f"{node}.{name}"][-1])

result = fmpy.simulate_fmu(
    fmu, stop_time=time[-1], step_size=step, output_interval=step, fmi_type="CoSimulation",
    start_values=json.loads(start), input=given, output=outputs,
)
assert len(result) == len(time), f"{len(result)} rows against {len(time)}"
assert np.array_equal(result["time"], time), "the communication points differ"
worst = 0.0
for name in outputs:
    ours, theirs = recorded[f"{node}.{name}"], result[name]
    difference = np.abs(ours - theirs) / np.maximum(1.0, np.abs(ours))
    row = int(difference.argmax())
    worst = max(worst, difference[row])
    assert difference[row] <= TOLERANCE, (
        f"{name} at {time[row]} s: {ours[row]!r} against {theirs[row]!r} with fmpy"
    )
print(f"{node}: {len(outputs)} outputs at {len(time)} points, largest difference {worst:g}")
