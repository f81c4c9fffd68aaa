"""Runs an archive by trackside and by a plain loop, and judges what came of it."""

import csv
import json
import re
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path

from archive import Model, Refused, copy_for_way, read_model, ways_to_run
from comparison import differences, explains
from loops import TOLERANCE, PlainLoop, finished


@dataclass
class Outcome:
    """What came of one interface and one way to run it.

    equal: the same values. explained: two plain loops differ from each other, too. alone: only trackside runs it.
    neither: neither runs it. differs, refused: faults of trackside. left out: nothing to run on this machine.
    """

    kind: str
    detail: str = ""
    model: Model | None = None
    interface: str = ""
    way: str = ""


def outcomes_of(machines, options, path: Path) -> list[Outcome]:
    try:
        with zipfile.ZipFile(path) as archive:
            model, ways = read_model(archive), ways_to_run(archive)
    except (Refused, zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
        return [Outcome("left out", f"it is no FMU: {error}")]
    if not model.interfaces or not ways:
        lacks = "neither co-simulation nor model exchange" if not model.interfaces else "neither a library nor sources"
        return [Outcome("left out", f"it has {lacks} for this machine", model)]
    outcomes = []
    for interface in model.interfaces:
        for way in ways if options.all_ways else ways[:1]:
            if not set(options.only.split()) <= {interface, way}:
                continue
            with tempfile.TemporaryDirectory(prefix="trial-", dir=options.scratch) as folder:
                try:
                    alone = path if ways[0] == "linux" == way or ways == [way] else copy_for_way(path, way, Path(folder))
                    trial = Trial(machines, options, alone, model, interface, way, Path(folder))
                    kind, detail = trial.judge()
                except Exception as error:  # Whatever an archive does, the others are run.
                    kind, detail = "alone", f"the comparison fails: {type(error).__name__}: {error}"
            outcomes.append(Outcome(kind, detail, model, interface, way))
    return outcomes


class Trial:
    def __init__(self, machines, options, path: Path, model: Model, interface: str, way: str, folder: Path):
        self.options, self.path, self.model, self.interface, self.folder = options, path, model, interface, folder
        self.loop = PlainLoop(machines, options, model, interface, way, folder)

    def judge(self) -> tuple[str, str]:
        refusal, ours = self.trackside()
        try:
            plain = self.loop.rows(self.path, coarse=False)
        except Refused as reason:
            if ours is None:
                return "neither", f"{refusal}; the plain loop: {reason}"
            return "alone", f"the plain loop does not run: {reason}"
        if ours is None:
            return "refused", refusal
        found = self.differences(ours, plain)
        if not found:
            return "equal", f"{len(plain)} points, {len(self.model.variables)} variables"
        worst = max(found.values(), key=lambda it: it.size).what
        try:
            between = self.differences(self.loop.rows(self.path, coarse=True), plain)
        except Refused as reason:
            return "differs", f"{worst}; a second plain loop does not run: {reason}"
        return ("explained" if explains(between, found) else "differs"), worst

    def differences(self, ours, plain):
        return differences(self.model.variables, ours, plain, self.interface == "co-simulation")

    def trackside(self):
        """Why it is refused, or the rows by title."""
        (self.folder / "case.toml").write_text(self.scenario(), encoding="utf-8")
        command = [self.options.trackside, "run", "case.toml", "--out", "out", "--csv", "--rerun", "off"]
        code, err = finished(command, self.options.seconds, cwd=self.folder)
        table = self.folder / "out/run.csv"
        if code is None:
            return f"it takes more than {self.options.seconds:g} s", None
        if code != 0 or not table.exists():
            return message(err) or f"exit code {code} without a word", None
        with open(table, newline="", encoding="utf-8") as file:
            titles, *rows = csv.reader(file)
        names = [re.sub(r" \[[^\[\]]*\]$", "", title) for title in titles]
        return "", [dict(zip(names, row)) for row in rows]

    def scenario(self) -> str:
        node = {"name": "it", "path": str(self.path.resolve()), "unconnected": "start"}
        node["observe"] = [it.name for it in self.model.variables if not it.is_output]
        if len(self.model.interfaces) > 1:
            node["interface"] = self.interface
        if self.interface == "model-exchange":
            node["relative_tolerance"] = TOLERANCE
        start, step = self.model.start, self.model.step
        time = {"step": step, "stop": start + self.options.steps * step, "start": start}
        # Numbers and texts of JSON are those of TOML.
        tables = [
            f"{title}\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in it.items())
            for title, it in (("[time]", time), ("[[fmu]]", node))
        ]
        return "\n".join(tables)


def message(err: str) -> str:
    """The error of trackside in one line, without warnings, frames and the lines of the scenario."""
    error = err.partition("×")[2] or err
    words = " ".join(part.strip(" │╭╰─┬▲·├▶") for part in error.splitlines())
    told = re.sub(r"\s+", " ", words).strip().partition(" [case.toml")[0]
    return told[:600]
