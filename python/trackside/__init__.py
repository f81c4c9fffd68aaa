"""Run co-simulations of vehicle dynamics from Python, and look at them as tables and pictures.

    import trackside

    run = trackside.run("step_steer", set={"plant.body.m": 900.0})
    run.passed, run.frame("plant.*"), run.page

The program `trackside` runs as a process: an FMU that crashes ends the run, and not this one. A `Session` steps a scenario in this process.
"""

from ._compare import Comparison, Difference, compare
from ._errors import FmuError, InputError, TracksideError
from ._identify import Identification, identify
from ._plot import Plot
from ._program import program
from ._run import Check, Run, load, run
from ._scenarios import scenarios
from ._session import Session, State, Trace, Variable
from ._sweep import Sweep, sweep

__all__ = [
    "Check",
    "Comparison",
    "Difference",
    "FmuError",
    "Identification",
    "InputError",
    "Plot",
    "Run",
    "Session",
    "State",
    "Sweep",
    "Trace",
    "TracksideError",
    "Variable",
    "compare",
    "identify",
    "load",
    "program",
    "run",
    "scenarios",
    "sweep",
]
