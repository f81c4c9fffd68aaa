"""Saves the state of an FMU in the middle of a run, goes on, and goes on again from there, if the FMU can also in another instance
and from bytes: state.py FMU"""
import sys

import fmpy
from fmpy.fmi2 import FMU2Slave

fmu = sys.argv[1]
description = fmpy.read_model_description(fmu)
step = float(description.defaultExperiment.stepSize)
reals = [variable for variable in description.modelVariables if variable.type == "Real"]
outputs = [variable.valueReference for variable in reals if variable.causality == "output"]
folder = fmpy.extract(fmu)


def make(name):
    made = FMU2Slave(
        guid=description.guid, unzipDirectory=folder,
        modelIdentifier=description.coSimulation.modelIdentifier, instanceName=name,
    )
    made.instantiate()
    return made


instance = make("instance")
instance.setupExperiment(startTime=0.0)
instance.enterInitializationMode()
instance.exitInitializationMode()


def steps(first, last, instance=instance):
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
if description.coSimulation.canSerializeFMUstate:
    other = make("other")
    restored = other.deSerializeFMUstate(instance.serializeFMUstate(state))
    other.setFMUstate(restored)
    assert steps(30, 60, other) == first, "the state is not restored from bytes"
    other.freeFMUstate(restored)
    other.freeInstance()
    print("restored from bytes")
instance.freeFMUstate(state)
instance.terminate()
instance.freeInstance()
print("restored")
