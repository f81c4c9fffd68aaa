"""Simulates the plant with the recorded commands and compares every output: simulate_plant.py FMU CSV"""
import csv
import sys

import fmpy
import numpy as np

INPUTS = ["F_x", "delta"]
TOLERANCE = 1e-12

fmu, table = sys.argv[1:]
with open(table, newline="") as file:
    names, *rows = csv.reader(file)
values = np.array(rows, dtype=float)
recorded = {name: values[:, column] for column, name in enumerate(names)}
time = recorded["time"]
step = time[1]

# A row holds what was given for the step that ended there; fmpy wants what to give from a time on.
given = np.zeros(len(time), dtype=[(name, float) for name in ["time"] + INPUTS])
given["time"] = time
for name in INPUTS:
    given[name] = np.append(recorded[f"plant.{name}"][1:], recorded[f"plant.{name}"][-1])

outputs = [name.removeprefix("plant.") for name in names if name.startswith("plant.")]
outputs = [name for name in outputs if name not in INPUTS]
result = fmpy.simulate_fmu(
    fmu, stop_time=time[-1], step_size=step, output_interval=step, fmi_type="CoSimulation",
    start_values={"start.v_x": 15.0}, input=given, output=outputs,
)
assert len(result) == len(time), f"{len(result)} rows against {len(time)}"
assert np.array_equal(result["time"], time), "the communication points differ"
worst = 0.0
for name in outputs:
    ours, theirs = recorded[f"plant.{name}"], result[name]
    difference = np.abs(ours - theirs) / np.maximum(1.0, np.abs(ours))
    row = int(difference.argmax())
    worst = max(worst, difference[row])
    assert difference[row] <= TOLERANCE, (
        f"{name} at {time[row]} s: {ours[row]!r} against {theirs[row]!r} with fmpy"
    )
print(f"{len(outputs)} outputs at {len(time)} points, largest difference {worst:g}")
