"""Gathers a scenario and those that it extends into one document whose files all lie beside it, and writes it as a folder."""

import copy
import fnmatch
import os
import re
import shutil
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

# Keys that name an entry of a list.
NAMES = ("name", "to", "title", "input", "label", "node")
MANOEUVRES = (
    "acceleration", "braking_in_a_turn", "frequency_response", "lane_change", "mu_split_braking", "sine_with_dwell",
    "slowly_increasing_steer", "steady_circle", "step_steer", "stop_and_go", "tip_in",
)  # fmt: skip
# What judges, draws or repeats a run does not change its values.
LEFT_OUT = ("extends", "variant", "without", "analysis", "validation", "check", "baseline", "view", "sweep")


@dataclass
class Scenario:
    """A document of TOML. `files` has for each path that the document names a file, its contents, or what writes it."""

    name: str
    document: dict
    files: dict = field(default_factory=dict)

    def copy(self):
        return Scenario(self.name, copy.deepcopy(self.document), dict(self.files))

    def list(self, key):
        return self.document.get(key, [])

    def node(self, name):
        return next(it for it in self.list("fmu") if it["name"] == name)

    def contents(self, path):
        file = self.files[path]
        return file if isinstance(file, bytes) else file.read_bytes()

    def archive(self, node):
        """The archive of a node, while nothing in it is changed."""
        return self.files[node["path"]]

    def write(self, folder):
        """Writes the document and its files; unchanged files are links. Returns the path of the scenario."""
        for path, file in self.files.items():
            target = folder / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.unlink(missing_ok=True)
            if isinstance(file, bytes):
                target.write_bytes(file)
            elif isinstance(file, Path):
                link(file, target)
            else:
                file.write(target)
        folder.mkdir(parents=True, exist_ok=True)
        scenario = folder / f"{Path(self.name).name}.toml"
        scenario.write_text(toml_text(self.document))
        return scenario


def link(file, target):
    try:
        os.link(file, target)
    except OSError:
        shutil.copyfile(file, target)


def entry_name(entry):
    return next((entry[key] for key in NAMES if key in entry), None)


def flatten(table, prefix=""):
    """The table with the keys of nested ones joined by dots; `{ text_of = "x" }` is a value."""
    flat = {}
    for key, value in table.items():
        if isinstance(value, dict) and set(value) != {"text_of"}:
            flat |= flatten(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = value
    return flat


def merge_tables(old, new):
    for key, value in new.items():
        both = isinstance(old.get(key), dict) and isinstance(value, dict)
        old[key] = merge_tables(old[key], value) if both and set(value) != {"text_of"} else value
    return old


def merge_lists(key, old, new):
    merged = list(old)
    for entry in new:
        name = entry_name(entry)
        index = next((i for i, it in enumerate(old) if name is not None and entry_name(it) == name), None)
        if index is None or key == "fault":
            merged.append(entry)
        elif key == "signal":
            merged[index] = entry
        else:
            known = dict(merged[index])
            if "path" in entry or "crate" in entry:
                for it in ("path", "crate", "example"):
                    known.pop(it, None)
            if any(it in entry for it in MANOEUVRES):
                known = {it: value for it, value in known.items() if it not in MANOEUVRES}
            merged[index] = merge_tables(known, entry)
    return merged


def read_merged(path, root):
    """The document of a scenario with those that it extends; paths in it begin at `root`."""
    document = tomllib.loads(path.read_text())
    # A text that is a path relative to the file becomes one relative to the root.
    here = lambda text: os.path.relpath((path.parent / text).resolve(), root.resolve())
    for entry in document.get("fmu", []) + document.get("table", []):
        for key in ("path", "aliases", "parameters"):
            if key in entry:
                entry[key] = [here(it) for it in entry[key]] if isinstance(entry[key], list) else here(entry[key])
        if "start" in entry:
            entry["start"] = {
                name: {"text_of": here(value["text_of"])} if isinstance(value, dict) else value
                for name, value in flatten(entry["start"]).items()
            }
    if "extends" not in document:
        return document
    merged = read_merged(path.parent / document["extends"], root)
    for key, names in document.get("without", {}).items():
        if key in merged:
            gone = lambda entry: any(fnmatch.fnmatchcase(str(entry_name(entry)), it) for it in names)
            merged[key] = [it for it in merged[key] if not gone(it)]
    for key, value in document.items():
        if key in LEFT_OUT:
            continue
        old = merged.get(key)
        if isinstance(old, list) and isinstance(value, list):
            merged[key] = merge_lists(key, old, value)
        elif isinstance(old, dict) and isinstance(value, dict):
            merged[key] = merge_tables(old, value)
        else:
            merged[key] = value
    return merged


def text_files(table):
    """The values `{ text_of = "x" }` of a table, by dotted names."""
    return {name: value["text_of"] for name, value in flatten(table).items() if isinstance(value, dict)}


def parameter_files(node):
    files = node.get("parameters", [])
    return [files] if isinstance(files, str) else files


def gather(path, root, archives, most_steps):
    """The scenario without what does not change its values, and of at most so many steps; None if it simulates nothing.

    The package of each FMU becomes its archive in the folder `archives`.
    """
    document = {key: value for key, value in read_merged(path, root).items() if key not in LEFT_OUT}
    if "time" not in document or "system" in document or not document.get("fmu"):
        return None
    time = document["time"]
    time.pop("limit", None)
    begin, step = time.get("start", 0.0), time["step"]
    # A manoeuvre that did not end is an error.
    if not document.get("manoeuvre"):
        time["stop"] = round(begin + min(round((time["stop"] - begin) / step), most_steps) * step, 9)
    scenario = Scenario(str(path.relative_to(root).with_suffix("")), document)

    def bring(file):
        """The path beside the scenario of a file that is named from the root."""
        inside = file if not file.startswith("..") else f"data/{Path(file).name}"
        scenario.files[inside] = (root / file).resolve()
        return inside

    for node in document["fmu"]:
        package = node.pop("crate", None)
        if package is None and "path" not in node:
            return None
        archive = archives / f"{re.sub('-fmu$', '', package).replace('-', '_')}.fmu" if package else root / node["path"]
        if not archive.is_file():
            raise FileNotFoundError(f"no archive {archive} of `{package}`: run one of its scenarios, or give --fmus")
        node.pop("example", None)
        node["path"] = f"fmu/{node['name']}.fmu"
        scenario.files[node["path"]] = archive.resolve()
        for file in parameter_files(node):
            bring(file)
            for text in text_files(tomllib.loads((root / file).read_text())).values():
                bring(os.path.normpath(Path(file).parent / text))
        for name, text in text_files(node.get("start", {})).items():
            node["start"][name] = {"text_of": bring(text)}
    for table in scenario.list("table"):
        table["path"] = bring(table["path"])
        if "aliases" in table:
            table["aliases"] = bring(table["aliases"])
    return scenario


def toml_value(value):
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'
    if isinstance(value, list):
        return f"[{', '.join(map(toml_value, value))}]"
    if isinstance(value, dict):
        inner = ", ".join(f"{toml_key(key)} = {toml_value(it)}" for key, it in value.items())
        return f"{{ {inner} }}" if inner else "{}"
    return repr(value)


def toml_key(key):
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else toml_value(key)


def toml_text(document):
    """The document as TOML: plain values, tables, then lists of tables."""
    lines, tables = [], []
    for key, value in document.items():
        of_tables = isinstance(value, list) and value and all(isinstance(it, dict) for it in value)
        for title, table in [(f"[[{key}]]", it) for it in value] if of_tables else [(f"[{key}]", value)]:
            if isinstance(table, dict):
                tables += ["", title, *(f"{toml_key(name)} = {toml_value(it)}" for name, it in table.items())]
            else:
                lines.append(f"{toml_key(key)} = {toml_value(value)}")
    return "\n".join([*lines, *tables]) + "\n"
