"""Reads what an FMU has, by the standard alone: interfaces, experiment, variables to compare, and ways to run it."""

import math
import re
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

# Folders of `binaries` in FMI 3.0 and before.
LIBRARIES = {
    "linux": ["x86_64-linux", "linux64"],
    "wine64": ["x86_64-windows", "win64"],
    "wine32": ["x86-windows", "win32"],
}
# In the order in which they are preferred.
WAYS = ["linux", "sources", "wine64", "wine32"]
INTERFACES = {"co-simulation": "CoSimulation", "model-exchange": "ModelExchange"}
TYPES = ("Real", "Integer", "Boolean", "String", "Enumeration")  # of FMI 1.0 and 2.0
TEXTS = ("String", "Binary")

MOST_OUTPUTS = 2000
MOST_LOCALS = 50


class Refused(Exception):
    """Why an archive is not run in some way."""


@dataclass
class Variable:
    name: str
    kind: str
    reference: int
    count: int
    is_output: bool
    is_clocked: bool


@dataclass
class Model:
    version: int
    tool: str
    guid: str
    interfaces: dict[str, dict] = field(default_factory=dict)
    states: int = 0
    indicators: int = 0
    start: float = 0.0
    step: float = 0.0
    tolerance: float = 0.0
    has_clocks: bool = False
    variables: list[Variable] = field(default_factory=list)


def plain_name(name: str) -> str:
    return name.replace("\\", "/").removeprefix("./")


def read_model(archive: zipfile.ZipFile) -> Model:
    names = [it for it in archive.namelist() if plain_name(it) == "modelDescription.xml"]
    if not names:
        raise Refused("there is no modelDescription.xml")
    try:
        root = ElementTree.fromstring(archive.read(names[0]))
    except (ElementTree.ParseError, ValueError, RuntimeError) as error:
        raise Refused(f"the description cannot be read: {error}") from error
    version = root.get("fmiVersion", "")[:1]
    if version not in ("1", "2", "3"):
        raise Refused(f"this is no version of FMI: {root.get('fmiVersion')}")
    if root.find("ModelVariables") is None:
        raise Refused("its description has no <ModelVariables>")
    guid = root.get("instantiationToken") or root.get("guid") or ""
    model = Model(int(version), root.get("generationTool") or "unknown", guid)
    read_interfaces(model, root)
    read_experiment(model, root)
    model.has_clocks = root.find("ModelVariables/Clock") is not None
    model.variables = variables_to_compare(root, model.version)
    return model


def read_interfaces(model: Model, root):
    model.indicators = int(root.get("numberOfEventIndicators", 0))
    model.states = int(root.get("numberOfContinuousStates", 0))
    model.states = model.states or len(root.findall("ModelStructure/Derivatives/Unknown"))
    if model.version == 1:
        kind = "model-exchange" if root.find("Implementation") is None else "co-simulation"
        model.interfaces[kind] = dict(root.attrib)
        return
    for kind, tag in INTERFACES.items():
        found = root.find(tag)
        if found is not None:
            files = [it.get("name") for it in found.iter("File")]
            model.interfaces[kind] = dict(found.attrib) | {"files": files}


def read_experiment(model: Model, root):
    """Start and step are those of the description; without a step, a 500th of its experiment or of 1 s."""
    found = root.find("DefaultExperiment")
    given = {} if found is None else {key: float(value) for key, value in found.attrib.items() if key != "name"}
    model.start = max(given.get("startTime", 0.0), 0.0)
    model.tolerance = given.get("tolerance", 0.0)
    length = given.get("stopTime", model.start + 1.0) - model.start
    fixed = model.interfaces.get("co-simulation", {}).get("fixedInternalStepSize", 0.0)
    model.step = given.get("stepSize") or float(fixed) or (length if length > 0.0 else 1.0) / 500.0


def variables_to_compare(root, version: int) -> list[Variable]:
    """The outputs, or some locals where there are none. Nothing is known of the values of a clocked local between its ticks."""
    elements = root.findall("ModelVariables/*")
    starts = {it.get("valueReference"): it.get("start", "1") for it in elements}
    outputs, others = [], []
    for it in elements:
        typed = it if version == 3 else next((child for child in it if child.tag in TYPES), None)
        if typed is None or typed.tag == "Clock" or it.get("alias") == "negatedAlias" or not it.get("name"):
            continue
        kind = typed.tag if typed.tag != "Enumeration" else "Int64" if version == 3 else "Integer"
        sizes = [size.get("start") or starts.get(size.get("valueReference"), "1") for size in it.iter("Dimension")]
        count = math.prod(int(size.split()[0]) for size in sizes)
        causality = it.get("causality", "local")
        reference = int(it.get("valueReference", "0"))
        variable = Variable(it.get("name"), kind, reference, count, causality == "output", bool(it.get("clocks")))
        if variable.is_output and count:
            outputs.append(variable)
        # In a pattern of `observe`, an asterisk stands for any letters.
        elif causality in ("local", "internal") and count == 1 and not variable.is_clocked and "*" not in variable.name:
            others.append(variable)
    return outputs[:MOST_OUTPUTS] or others[:MOST_LOCALS]


def ways_to_run(archive: zipfile.ZipFile) -> list[str]:
    names = [plain_name(it) for it in archive.namelist()]

    def has(pattern: str) -> bool:
        return any(re.match(pattern, it, re.IGNORECASE) for it in names)

    found = {way: [rf"binaries/{it}/[^/]+\.(so|dll)$" for it in folders] for way, folders in LIBRARIES.items()}
    found["sources"] = [r"sources/.+\.(c|cc|cpp|cxx)$"]
    return [way for way in WAYS if any(has(pattern) for pattern in found[way])]


def copy_for_way(path: Path, way: str, folder: Path) -> Path:
    """A copy without the libraries and sources of other ways."""
    others = [f"binaries/{it}/" for other, folders in LIBRARIES.items() if other != way for it in folders]
    others += [] if way == "sources" else ["sources/"]
    copy = folder / path.name
    with zipfile.ZipFile(path) as source, zipfile.ZipFile(copy, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as target:
        for entry in source.infolist():
            if not plain_name(entry.filename).startswith(tuple(others)):
                target.writestr(entry, source.read(entry))
    return copy
