"""Simulates a system of FMUs with libcosim or Ecos and compares it with our trace: coupled.py TOOL SYSTEM.json CSV"""
import csv
import json
import sys

import fmpy

TOLERANCE = {"system": 1e-9, "single": 1e-12}
# Ecos reads values after it has handed over the inputs of the next step: outputs that follow an input
# without a step in between are already those of the next one.
FOLLOWING = {"plant": ["a_x", "a_y", "alpha_f", "F_zf", "F_zr", "F_xf", "F_xr", "F_yf", "F_yr", "kappa_f", "omega_f", "delta_f"]}


def libcosim(system, rows):
    """Yields, after each step, a function that reads a variable."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(step_size=round(system["step"] * 1e9))
    slaves, references = {}, {}
    for name, path in system["fmus"].items():
        slaves[name] = execution.add_local_slave(CosimLocalSlave(fmu_path=path, instance_name=name))
        assert slaves[name] >= 0, f"libcosim refuses {path}"
        variables = execution.slave_variables(slaves[name])
        references[name] = {variable.name.decode(): variable.reference for variable in variables}
    find = lambda name: (slaves[name.split(".")[0]], references[name.split(".")[0]][name.split(".", 1)[1]])
    for name, value in system["start"].items():
        assert execution.real_initial_value(*find(name), value), name
    for source, target in system["connections"]:
        assert execution.connect_real_variables(*find(source), *find(target)) == 0, target
    observer, manipulator = CosimObserver.create_last_value(), CosimManipulator.create_override()
    execution.add_observer(observer)
    execution.add_manipulator(manipulator)
    for row in rows:
        for name in system["inputs"]:
            slave, reference = find(name)
            manipulator.slave_real_values(slave, [reference], [row[name]])
        assert execution.step(1)
        yield lambda name: observer.last_real_values(find(name)[0], [find(name)[1]])[0]


def ecos(system, rows):
    """Yields, after each step, a function that reads a variable."""
    from ecospy import EcosSimulation, EcosSimulationStructure

    slashed = lambda name: name.replace(".", "::", 1)
    structure = EcosSimulationStructure()
    for name, path in system["fmus"].items():
        structure.add_model(name, path)
    for source, target in system["connections"]:
        structure.make_real_connection(slashed(source), slashed(target))
    starts = {slashed(name): value for name, value in system["start"].items()}
    structure.add_parameter_set("start", starts)
    simulation = EcosSimulation(structure=structure, step_size=system["step"])
    simulation.init(parameter_set="start")
    for row in rows:
        for name in system["inputs"]:
            simulation.set_real(slashed(name), row[name])
        simulation.step(1)
        yield lambda name: simulation.get_real(slashed(name))
    simulation.terminate()


tool, description, table = sys.argv[1:]
with open(description) as file:
    system = json.load(file)
with open(table, newline="") as file:
    rows = [{title.partition(" [")[0]: float(value) for title, value in row.items()} for row in csv.DictReader(file)]
# replay.py compares the others.
real = {
    f"{node}.{variable.name}" for node, path in system["fmus"].items()
    for variable in fmpy.read_model_description(path).modelVariables if variable.type == "Real"
}
outputs = [name for name in system["outputs"] if name in real]
if tool == "ecos" and system["connections"]:
    ahead = [f"{node}.{name}" for node, names in FOLLOWING.items() for name in names]
    outputs = [name for name in outputs if name not in ahead]
tolerance = TOLERANCE["system" if system["connections"] else "single"]
worst = 0.0
run = {"libcosim": libcosim, "ecos": ecos}[tool]
for row, read in zip(rows[1:], run(system, rows[1:])):
    for name in outputs:
        ours, theirs = row[name], read(name)
        difference = abs(ours - theirs) / max(1.0, abs(ours))
        worst = max(worst, difference)
        assert difference <= tolerance, f"{name} at {row['time']} s: {ours!r}, with {tool} {theirs!r}"
print(f"{tool}: {len(outputs)} outputs at {len(rows) - 1} points, largest difference {worst:g}")
