"""The seeded changes of a scenario: twelve kinds, each a function that changes a copy of the scenario in one place."""

import re
import tomllib
from dataclasses import dataclass

import archives
from gathered import flatten, parameter_files, text_files

# Other units of the same quantity.
UNITS = {
    "rad": "deg", "deg": "rad", "m/s": "km/h", "km/h": "m/s", "m/s2": "g0", "N": "kN", "kN": "N", "rad/s": "deg/s", "deg/s": "rad/s",
    "m": "mm", "mm": "m", "N.m": "kN.m", "s": "ms", "kg": "g", "1": "%", "%": "1",
}  # fmt: skip
# Packages whose symbols mark a function as one of the model, not of a library that the model uses.
PACKAGES = ()


@dataclass
class Change:
    """`places` are the names under which the change may be reported; any of them, or a place below it, is right."""

    text: str
    places: list
    # Another version in report.json, in place of another scenario.
    report: dict | None = None


def scaled(random, value):
    """Another number of the same sign and of plausible size."""
    factor = random.choice([0.7, 0.8, 0.9, 0.95, 1.02, 1.05, 1.1, 1.2, 1.4])
    return float(f"{value * factor:.6g}") if value else random.choice([0.01, 0.1])


def start_places(node, name):
    return [f"{node}.{name}", f"fmu.{node}.start.{name}"]


def archive_places(node):
    return [f"fmu.{node['name']}", node["path"]]


def reals(scenario, node, causality):
    """Real variables of a node of this causality, with the number that each starts with in the description."""
    found = {}
    for variable in archives.variables(scenario.archive(node)).values():
        if variable.causality == causality and variable.type in ("Real", "Float64") and variable.start is not None:
            found[variable.name] = float(variable.start)
    return found


def file_values(scenario, node):
    """Start values of the node's files: name to (file, value)."""
    values = {}
    for file in parameter_files(node):
        values |= {name: (file, value) for name, value in flatten(tomllib.loads(scenario.contents(file).decode())).items()}
    return values


def readers(scenario, file, name):
    """Places of a start value of a file: that of each node which takes it from there."""
    places = [file]
    for node in scenario.list("fmu"):
        if file in parameter_files(node) and name not in node.get("start", {}):
            places += start_places(node["name"], name)
    return places


def replace_toml_number(text, dotted, value):
    """The text of a file of tables with another number of a key."""
    table, _, key = dotted.rpartition(".")
    inside = not table
    lines = text.split("\n")
    for index, line in enumerate(lines):
        if header := re.match(r"\s*\[([^\]]+)\]", line):
            inside = header[1].strip() == table
        elif inside and (match := re.match(rf"(\s*{re.escape(key)}\s*=\s*)[-+0-9.e]+", line)):
            lines[index] = match[1] + repr(value) + line[match.end() :]
            return "\n".join(lines)
    return None


def numeric(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def start_number(scenario, random, causality, initial):
    """Another number for a parameter of an FMU: in `start`, or in its file of parameters. With `initial`, for an initial state."""
    node = random.choice(scenario.list("fmu"))
    defaults = {
        name: value
        for name, value in reals(scenario, node, causality).items()
        if name.startswith("start.") == initial
    }
    if not defaults:
        return None
    name = random.choice(sorted(defaults))
    start, files = node.setdefault("start", {}), file_values(scenario, node)
    if name not in start and name in files and random.random() < 0.5:
        file, value = files[name]
        new = scaled(random, value)
        text = replace_toml_number(scenario.contents(file).decode(), name, new)
        if text is None:
            return None
        scenario.files[file] = text.encode()
        return Change(f"{file}: {name} {value} -> {new}", readers(scenario, file, name))
    value = start.get(name, files.get(name, (None, defaults[name]))[1])
    if not numeric(value):
        return None
    start[name] = scaled(random, value)
    return Change(f"{node['name']}.{name}: {value} -> {start[name]}", start_places(node["name"], name))


def parameter(scenario, random):
    return start_number(scenario, random, "parameter", initial=False)


def start_value(scenario, random):
    if random.random() < 0.6:
        return start_number(scenario, random, "parameter", initial=True)
    # In the description of the archive.
    node = random.choice(scenario.list("fmu"))
    archive = scenario.archive(node)
    names = reals(scenario, node, "parameter") | reals(scenario, node, "input")
    name = random.choice(sorted(names))
    new = scaled(random, names[name])
    text = archives.replace_attribute(archives.description(archive), name, "start", repr(new))
    change_archive(scenario, node, {archives.DESCRIPTION: text.encode()})
    places = [*start_places(node["name"], name), *archive_places(node)]
    return Change(f"description of {node['name']}: start of {name} {names[name]} -> {new}", places)


def change_archive(scenario, node, members):
    """Gives the node its own archive, with other members."""
    scenario.files[node["path"]] = ArchiveChange(scenario.archive(node), members)


@dataclass
class ArchiveChange:
    archive: object
    members: dict

    def write(self, target):
        archives.replace_members(self.archive, self.members, target)


def constant(scenario, random, node, bits):
    """The library of the node with one other bit of a constant: (library, text), or None if it has no constants."""
    archive = scenario.archive(node)
    member = archives.library_name(archive)
    constants = archives.library_constants(archive, PACKAGES) if member else []
    if not constants:
        return None
    chosen, bit = random.choice(constants), random.choice(bits)
    library, value = archives.flip_bit(archives.read_member(archive, member), chosen.offset, bit)
    text = f"library of {node['name']}: bit {bit} of {chosen.value!r} -> {value!r}, used in {chosen.function or 'it'}"
    return member, library, text


def library_bit(scenario, random):
    node = random.choice(scenario.list("fmu"))
    # Upper bits of the mantissa: the size of the number stays, and the change is no rounding.
    found = constant(scenario, random, node, range(38, 52))
    if found is None:
        return None
    member, library, text = found
    change_archive(scenario, node, {member: library})
    return Change(text, archive_places(node))


def fmu_version(scenario, random):
    """Another build of the model: another version and date, other texts, and another constant in its library."""
    node = random.choice(scenario.list("fmu"))
    found = constant(scenario, random, node, range(44, 52))
    if found is None:
        return None
    member, library, text = found
    description = archives.description(scenario.archive(node))
    for attribute, value in [("version", "0.2.0"), ("generationDateAndTime", "2026-11-01T12:00:00Z"), ("author", "another")]:
        description = archives.replace_root_attribute(description, attribute, value)
    change_archive(scenario, node, {archives.DESCRIPTION: description.encode(), member: library})
    return Change(f"archive of {node['name']}: version 0.2.0; {text}", archive_places(node))


def signal_places(signal):
    return [f"signal.{signal['name']}", signal["name"]]


def connection_places(connection, *sources):
    place = [f"connect.{source} -> {connection['to']}" for source in (connection["from"], *sources)]
    return [*place, f"connect.{connection['to']}", f"connect -> {connection['to']}"]


def column_places(table, name):
    return [f"table.{table['name']}.columns.{name}", f"{table['name']}.{name}"]


def unit(scenario, random):
    candidates = [("signal", it) for it in scenario.list("signal") if it.get("unit") in UNITS]
    for table in scenario.list("table"):
        columns = table.get("columns", {})
        candidates += [("column", (table, it)) for it in columns if isinstance(columns[it], dict) and columns[it].get("unit") in UNITS]
    for connection in scenario.list("connect"):
        for end in ("from", "to"):
            name, _, variable = connection[end].partition(".")
            node = next((it for it in scenario.list("fmu") if it["name"] == name), None)
            if node and (known := archives.variables(scenario.archive(node)).get(variable)) and known.unit in UNITS:
                candidates.append(("description", (node, known)))
    if not candidates:
        return None
    where, what = random.choice(candidates)
    if where == "signal":
        old, what["unit"] = what["unit"], UNITS[what["unit"]]
        return Change(f"signal {what['name']}: unit {old} -> {what['unit']}", signal_places(what))
    if where == "column":
        table, name = what
        column = table["columns"][name]
        old, column["unit"] = column["unit"], UNITS[column["unit"]]
        # The file has no units, or else the program refuses the change.
        return Change(f"table {table['name']}: unit of {name} {old} -> {column['unit']}", column_places(table, name))
    node, variable = what
    new = UNITS[variable.unit]
    text = archives.description(scenario.archive(node))
    text = archives.replace_attribute(text, variable.name, "unit", new)
    # A description defines what it uses; the definition of the old unit serves with a factor.
    base = re.search(rf'<Unit name="{re.escape(variable.unit)}">\s*<BaseUnit ?([^>]*)/>', text)
    if f'<Unit name="{new}">' not in text and base:
        factor = {"deg": 0.017453292519943295, "km/h": 1 / 3.6, "g0": 9.80665, "kN": 1e3, "deg/s": 0.017453292519943295, "mm": 1e-3,
                  "kN.m": 1e3, "ms": 1e-3, "g": 1e-3, "%": 1e-2}.get(new, 1.0)  # fmt: skip
        entry = f'<Unit name="{new}"><BaseUnit {base[1].strip()} factor="{factor!r}"/></Unit>'
        text = text.replace("<UnitDefinitions>", f"<UnitDefinitions>\n    {entry}", 1)
    change_archive(scenario, node, {archives.DESCRIPTION: text.encode()})
    places = [*archive_places(node), f"{node['name']}.{variable.name}"]
    return Change(f"description of {node['name']}: unit of {variable.name} {variable.unit} -> {new}", places)


def numbers(value, path=()):
    """The numbers in a value and the keys that lead to each."""
    if numeric(value) and value:
        yield path
    elif isinstance(value, (dict, list)):
        for key, below in value.items() if isinstance(value, dict) else enumerate(value):
            yield from numbers(below, (*path, key))


def replace_number(value, path, change):
    for key in path[:-1]:
        value = value[key]
    old = value[path[-1]]
    value[path[-1]] = change(old)
    return old, value[path[-1]]


def sign(scenario, random):
    choice = random.random()
    # A time or a frequency has no sign to be mistaken.
    amplitudes = ("constant", "amplitude", "after", "peak", "value", "before", "offset")
    levels = [
        (it, path)
        for it in scenario.list("signal")
        for path in numbers(it)
        if any(key in amplitudes for key in path)
    ]
    if choice < 0.3 and levels:
        signal, path = random.choice(levels)
        old, new = replace_number(signal, path, lambda it: -it)
        return Change(f"signal {signal['name']}: {'.'.join(map(str, path))} {old} -> {new}", signal_places(signal))
    columns = [(it, name) for it in scenario.list("table") for name, column in it.get("columns", {}).items() if isinstance(column, dict)]
    if choice < 0.6 and columns:
        table, name = random.choice(columns)
        table["columns"][name]["sign"] = -table["columns"][name].get("sign", 1)
        return Change(f"table {table['name']}: sign of {name}", column_places(table, name))
    if not scenario.list("connect"):
        return None
    connection = random.choice(scenario.list("connect"))
    connection["gain"] = -connection.get("gain", 1.0)
    return Change(f"{connection['from']} -> {connection['to']}: gain {connection['gain']}", connection_places(connection))


def sources(scenario):
    """Outputs that connections may begin at, with their units."""
    found = {it["name"]: it.get("unit") for it in scenario.list("signal")}
    for node in scenario.list("fmu"):
        for variable in archives.variables(scenario.archive(node)).values():
            if variable.causality == "output" and variable.type in ("Real", "Float64"):
                found[f"{node['name']}.{variable.name}"] = variable.unit
    for table in scenario.list("table"):
        columns = table.get("columns", {})
        found |= {f"{table['name']}.{it}": columns[it].get("unit") for it in columns if isinstance(columns[it], dict)}
    return found


def takes_none(scenario, target):
    """Whether the FMU says that this input may have neither connection nor start value."""
    name, _, variable = target.partition(".")
    node = next((it for it in scenario.list("fmu") if it["name"] == name), None)
    known = archives.variables(scenario.archive(node)).get(variable) if node else None
    return known is not None and known.optional and variable not in node.get("start", {})


def connection(scenario, random):
    if not scenario.list("connect"):
        return None
    chosen = random.choice(scenario.list("connect"))
    optional = [it for it in scenario.list("connect") if takes_none(scenario, it["to"])]
    if optional and random.random() < 0.4:
        chosen = random.choice(optional)
        scenario.list("connect").remove(chosen)
        return Change(f"{chosen['from']} -> {chosen['to']} removed", connection_places(chosen))
    known = sources(scenario)
    old = chosen["from"]
    # What the manoeuvre measures or steers has no description here: angles are in rad, forces in N.
    wanted = known.get(old, {"steer": "rad", "drive": "N"}.get(old.partition(".")[2]))
    similar = {wanted, UNITS.get(wanted)}
    node = chosen["to"].partition(".")[0]
    fitting = sorted(it for it, unit in known.items() if it != old and unit in similar)
    others = [it for it in fitting if it.partition(".")[0] != node]
    # A loop of a node to itself needs the value of the start of the step.
    own = [it for it in fitting if it not in others] if chosen.get("at") == "start" else []
    if not others + own:
        return None
    chosen["from"] = random.choice(others or own)
    return Change(f"{old} -> {chosen['to']}: from {chosen['from']}", connection_places(chosen, old))


def step(scenario, random):
    time = scenario.document["time"]
    if random.random() < 0.25:
        node = random.choice(scenario.list("fmu"))
        old, node["step"] = node.get("step", time["step"]), round(time["step"] / random.choice([2, 4, 5]), 9)
        return Change(f"step of {node['name']}: {old} -> {node['step']}", [f"fmu.{node['name']}.step", f"{node['name']}.step", "time.step"])
    factor = random.choice([0.5, 0.8, 2.0, 4.0])
    old, time["step"] = time["step"], round(time["step"] * factor, 9)
    steps = (time["stop"] - time.get("start", 0.0)) / time["step"]
    if abs(steps - round(steps)) > 1e-6:
        return None
    return Change(f"time.step: {old} -> {time['step']}", ["time.step"])


def coupling(scenario, random):
    table = scenario.document.setdefault("coupling", {})
    old = table.get("algorithm", "gauss_seidel")
    table["algorithm"] = random.choice([it for it in ("gauss_seidel", "jacobi", "iterate") if it != old])
    return Change(f"coupling.algorithm: {old} -> {table['algorithm']}", ["coupling.algorithm"])


def seed(scenario, random):
    # Most scenarios have nothing random.
    words = ("'noise'", "'multisine'", "'dropout'", "'probability'", "'random'")
    if not any(word in repr(scenario.document) for word in words) and random.random() < 0.8:
        return None
    old = scenario.document.get("seed", 1)
    new = random.choice([it for it in range(1, 100) if it != old])
    scenario.document = {"seed": new} | {key: value for key, value in scenario.document.items() if key != "seed"}
    return Change(f"seed: {old} -> {new}", ["seed"])


def table(scenario, random):
    """A cell of a file of numbers: of a table, of a text that is the value of a parameter, or in a table of a signal."""
    files = {it["path"]: [f"table.{it['name']}", it["path"]] for it in scenario.list("table")}
    for node in scenario.list("fmu"):
        for name, file in text_files(node.get("start", {})).items():
            files.setdefault(file, [file]).extend(start_places(node["name"], name))
        for parameters in parameter_files(node):
            values = text_files(tomllib.loads(scenario.contents(parameters).decode()))
            for name, file in values.items():
                path = beside(parameters, file)
                files.setdefault(path, [path]).extend(readers(scenario, path, name) + start_places(node["name"], name))
    files = {file: places for file, places in files.items() if file.endswith(".csv") or random.random() < 0.3}
    signals = [it for it in scenario.list("signal") if "table" in it]
    if signals and (not files or random.random() < 0.3):
        signal = random.choice(signals)
        index = random.randrange(len(signal["table"]["value"]))
        old = signal["table"]["value"][index]
        signal["table"]["value"][index] = scaled(random, old)
        return Change(f"signal {signal['name']}: table.value[{index}] {old}", signal_places(signal))
    if not files:
        return None
    file = random.choice(sorted(files))
    return change_cell(scenario, random, file, files[file])


def beside(file, other):
    """The path of a file that another one names."""
    parts = file.split("/")[:-1]
    for part in other.split("/"):
        parts = parts[:-1] if part == ".." else [*parts, part]
    return "/".join(parts)


def change_cell(scenario, random, file, places):
    lines = scenario.contents(file).decode().split("\n")
    if file.endswith(".csv"):
        # The first column is a time or a grid: its order must stay.
        numeric_cell = re.compile(r"(?<=,)\s*([-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?)\s*(?=,|\r?$)")
        rows = [index for index, line in enumerate(lines) if re.match(r"\s*[-+]?[\d.]", line)]
        # In the part of a log that is played back.
        rows = rows[: max(2, len(rows) // 4)] if len(rows) > 1000 else rows
    else:
        numeric_cell = re.compile(r"=\s*([-+]?\d+\.\d*(?:[eE][-+]?\d+)?)")
        rows = [index for index, line in enumerate(lines) if re.match(r"\s*[prqs]\w+\s*=", line, re.I)]
    if not rows:
        return None
    row = random.choice(rows)
    cells = list(numeric_cell.finditer(lines[row]))
    if not cells:
        return None
    cell = random.choice(cells)
    old = float(cell[1])
    if not old:
        return None
    new = scaled(random, old)
    lines[row] = lines[row][: cell.start(1)] + repr(new) + lines[row][cell.end(1) :]
    scenario.files[file] = "\n".join(lines).encode()
    return Change(f"{file} line {row + 1}: {old} -> {new}", places)


def tool_version(scenario, random):
    if random.random() < 0.5:
        places = ["versions.trackside", "versions", "trackside", "tool"]
        return Change("report.json: versions.trackside 0.0.9", places, report={"trackside": "0.0.9"})
    node = random.choice(scenario.list("fmu"))
    attribute, value = random.choice([("generationTool", "Another tool 3.1"), ("version", "9.9.9")])
    text = archives.description(scenario.archive(node))
    old = archives.root_attribute(text, attribute)
    change_archive(scenario, node, {archives.DESCRIPTION: archives.replace_root_attribute(text, attribute, value).encode()})
    return Change(f"description of {node['name']}: {attribute} {old} -> {value}", archive_places(node))


KINDS = {
    "parameter": parameter,
    "fmu version": fmu_version,
    "unit": unit,
    "sign": sign,
    "start value": start_value,
    "connection": connection,
    "step": step,
    "coupling": coupling,
    "seed": seed,
    "table": table,
    "library bit": library_bit,
    "tool version": tool_version,
}

# Of these the draws without an effect are kept, too.
OFTEN_WITHOUT_EFFECT = ("seed", "tool version")


def draw(kind, scenario, random):
    """A changed copy of the scenario and its change, or None when the scenario has nothing of this kind."""
    changed = scenario.copy()
    change = KINDS[kind](changed, random)
    return (changed, change) if change else None
