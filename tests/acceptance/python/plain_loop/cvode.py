"""Simulates an FMU for model exchange by fmpy with CVODE, in a process of its own: cvode.py REQUEST ANSWER"""

import json
import sys
from pathlib import Path

import fmpy

# Of a step: what rounding leaves between two times.
SAME = 1e-6

request = json.loads(sys.argv[1])
start, step, names = request["start"], request["step"], request["names"]
times = [start + i * step for i in range(request["steps"] + 1)]
result = fmpy.simulate_fmu(
    request["fmu"],
    validate=False,
    fmi_type="ModelExchange",
    solver="CVode",
    start_time=start,
    stop_time=times[-1],
    step_size=step,
    output_interval=step,
    relative_tolerance=request["tolerance"],
    record_events=False,
    output=names,
)
rows, place = [], 0
for time in times:
    # The last row of a time is that after its events.
    while place + 1 < len(result) and result["time"][place + 1] <= time + SAME * step:
        place += 1
    if abs(result["time"][place] - time) > SAME * step:
        break
    rows.append({name: result[name][place].ravel().tolist() for name in names})
Path(sys.argv[2]).write_text(json.dumps(rows))
