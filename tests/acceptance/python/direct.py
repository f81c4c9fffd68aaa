"""Reads outputs of an FMU after its inputs and tunable parameters were written, with and without a step: direct.py FMU"""
import sys

import fmpy
from fmpy.fmi2 import FMU2Slave

fmu = sys.argv[1]
description = fmpy.read_model_description(fmu)
reference = {variable.name: variable.valueReference for variable in description.modelVariables}
instance = FMU2Slave(
    guid=description.guid, unzipDirectory=fmpy.extract(fmu),
    modelIdentifier=description.coSimulation.modelIdentifier, instanceName="instance",
)


def write(**values):
    for name, value in values.items():
        instance.setReal([reference[name]], [value])


def read():
    return tuple(instance.getReal([reference["y"], reference["sum"]]))


instance.instantiate()
instance.setupExperiment(startTime=1.0)
instance.enterInitializationMode()
write(u=2.0)
assert read() == (6.0, 1.0), read()  # y = k u, sum = the time of the start
write(u=3.0, k=4.0)
assert read() == (12.0, 1.0), read()
instance.exitInitializationMode()
instance.doStep(1.0, 0.5)
assert read() == (12.0, 7.0), read()  # sum += y h
write(u=1.0)
assert read() == (4.0, 7.0), read()
write(k=10.0)
assert read() == (10.0, 7.0), read()
write(k=20.0)
instance.doStep(1.5, 0.5)
assert read() == (20.0, 17.0), read()
instance.reset()
instance.setupExperiment(startTime=0.0)
instance.enterInitializationMode()
instance.exitInitializationMode()
assert read() == (0.0, 0.0), read()
instance.terminate()
instance.freeInstance()
print("all values are those of the script")
