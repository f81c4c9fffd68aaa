"""Saves the state of an FMU in the middle of a run, goes on, and goes on again from there: state.py FMU"""
import sys

import fmpy
from fmpy.fmi2 import FMU2Slave

fmu = sys.argv[1]
description = fmpy.read_model_description(fmu)
step = float(description.defaultExperiment.stepSize)
outputs = [variable.valueReference for variable in description.modelVariables if variable.causality == "output"]
instance = FMU2Slave(
    guid=description.guid, unzipDirectory=fmpy.extract(fmu),
    modelIdentifier=description.coSimulation.modelIdentifier, instanceName="instance",
)
instance.instantiate()
instance.setupExperiment(startTime=0.0)
instance.enterInitializationMode()
instance.exitInitializationMode()


def steps(first, last):
    rows = []
    for tick in range(first, last):
        instance.doStep(tick * step, step)
        rows.append(tuple(instance.getReal(outputs)))
    return rows


steps(0, 30)
state = instance.getFMUstate()
first = steps(30, 60)
assert first[0] != first[-1], "the outputs move"
instance.setFMUstate(state)
assert steps(30, 60) == first, "the state is not restored"
instance.reset()
instance.setFMUstate(state)
assert steps(30, 60) == first, "the state is not restored after a reset"
instance.freeFMUstate(state)
instance.terminate()
instance.freeInstance()
print("restored")
