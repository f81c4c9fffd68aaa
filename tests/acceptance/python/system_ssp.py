"""Lets another tool run a system of SSP and compares it with our trace: system_ssp.py TOOL SYSTEM.ssp STEP CSV"""
import csv
import re
import sys
import tempfile
import zipfile

TOLERANCE = 1e-9
# Ecos reads values after it has handed over the inputs of the next step: outputs that follow an input
# without a step in between are already those of the next one.
FOLLOWING = {"plant": ["a_x", "a_y", "alpha_f", "F_zf", "F_zr", "F_xf", "F_xr", "F_yf", "F_yr", "kappa_f", "omega_f", "delta_f"]}


def libcosim(path, step, count):
    """Yields, after each step, a function that reads a variable."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    with tempfile.TemporaryDirectory() as folder:
        zipfile.ZipFile(path).extractall(folder)
        execution = CosimExecution.from_ssp_file(folder, round(step * 1e9))
        observer = CosimObserver.create_last_value()
        execution.add_observer(observer)
        slaves, references = {}, {}
        for info in execution.slave_infos():
            name = info.name.decode()
            slaves[name] = info.index
            references[name] = {it.name.decode(): it.reference for it in execution.slave_variables(info.index)}

        def read(node, name):
            return observer.last_real_values(slaves[node], [references[node][name]])[0]

        for _ in range(count):
            assert execution.step(1)
            yield read


def ecos(path, step, count):
    """Yields, after each step, a function that reads a variable."""
    from ecospy import EcosSimulation

    simulation = EcosSimulation(ssp_path=path, step_size=step)
    # Ecos applies the values that it is told by name.
    simulation.init(parameter_set="start_values")
    for _ in range(count):
        simulation.step(1)
        yield lambda node, name: simulation.get_real(f"{node}::{name}")
    simulation.terminate()


tool, system, step, table = sys.argv[1:]
with open(table, newline="") as file:
    rows = [{title.partition(" [")[0]: float(value) for title, value in row.items()} for row in csv.DictReader(file)]
text = zipfile.ZipFile(system).read("SystemStructure.ssd").decode()
components = re.findall(r'<ssd:Component name="([^"]+)"(.*?)</ssd:Component>', text, re.DOTALL)
# replay.py compares Booleans.
truths = {
    (node, name) for node, inner in components
    for name in re.findall(r'<ssd:Connector name="([^"]+)"[^>]*>\s*<ssc:Boolean', inner)
}
outputs = [name.split(".", 1) for name in rows[0] if name != "time"]
outputs = [(node, name) for node, name in outputs if (node, name) not in truths]
if tool == "ecos":
    # The inputs of the next step are among those values, too.
    ahead = {node: re.findall(r'<ssd:Connector name="([^"]+)" kind="input"', inner) for node, inner in components}
    outputs = [(node, name) for node, name in outputs if name not in ahead[node] + FOLLOWING.get(node, [])]
worst = 0.0
run = {"libcosim": libcosim, "ecos": ecos}[tool]
for row, read in zip(rows[1:], run(system, float(step), len(rows) - 1)):
    for node, name in outputs:
        ours, theirs = row[f"{node}.{name}"], read(node, name)
        difference = abs(ours - theirs) / max(1.0, abs(ours))
        worst = max(worst, difference)
        assert difference <= TOLERANCE, f"{node}.{name} at {row['time']} s: {ours!r}, with {tool} {theirs!r}"
print(f"{tool}: {len(outputs)} outputs at {len(rows) - 1} points, largest difference {worst:g}")
