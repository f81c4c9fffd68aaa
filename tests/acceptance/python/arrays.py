"""Lets fmpy run a model with arrays in both versions of FMI and compares every element: arrays.py FMU2 FMU3"""
import sys

import fmpy
import numpy as np

two, three = sys.argv[1:]
count, step, stop = 3, 0.01, 2.0
time = np.arange(0.0, stop + step / 2, step)
force = np.stack([np.sin(3.0 * time), np.cos(2.0 * time), 0.5 * time], axis=1)
elements = [f"F[{index + 1}]" for index in range(count)]
single = np.zeros(len(time), dtype=[("time", float)] + [(name, float) for name in elements])
whole = np.zeros(len(time), dtype=[("time", float), ("F", float, (count,))])
single["time"] = whole["time"] = time
whole["F"] = force
for index, name in enumerate(elements):
    single[name] = force[:, index]
common = dict(stop_time=stop, step_size=step, output_interval=step, fmi_type="CoSimulation")
masses = {f"m[{index + 1}]": value for index, value in enumerate([1.5, 2.5, 3.5])}
outputs = [f"{name}[{index + 1}]" for name in "xv" for index in range(count)]
first = fmpy.simulate_fmu(two, input=single, start_values=masses, output=outputs, **common)
second = fmpy.simulate_fmu(three, input=whole, start_values={"m": [1.5, 2.5, 3.5]}, output=["x", "v"], **common)
for name in "xv":
    for index in range(count):
        one, other = first[f"{name}[{index + 1}]"], second[name][:, index]
        assert np.array_equal(one, other), f"{name}[{index + 1}]: {np.abs(one - other).max()}"
        assert np.ptp(one) > 0.01, "it moves"
print("equal")
