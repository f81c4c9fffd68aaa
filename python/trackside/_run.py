"""Run a scenario, and show what a run left: verdict, checks, signals, pages."""

from __future__ import annotations

import html
import json
import os
import subprocess
import weakref
import webbrowser
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.parquet as pq

from . import _plot, _tables
from ._errors import FmuError, InputError, TracksideError
from ._program import Ended, call, environment_with_scripts, program, settings

if TYPE_CHECKING:
    import pandas
    import polars

#: Plots that a notebook shows of a run, and curves of each: more do not fit on a screen.
PLOTS, CURVES = 6, 8
#: A viewer that does not start ends within this time [s].
START = 1.5


@dataclass(frozen=True)
class Check:
    """A check of a scenario, and what became of it."""

    #: Its name in the scenario.
    name: str
    #: Its condition.
    that: str
    #: Whether it held.
    passed: bool
    #: The value that decided, in `unit`; None for conditions without one number.
    value: float | None
    #: What it was compared with, in `unit`.
    limit: float | None
    #: How far it held, as a share of the limit or in the unit; negative when it did not.
    margin: float | None
    #: The unit of value and limit.
    unit: str | None
    #: When the value was reached [s].
    at: float | None
    #: When it was first violated [s].
    first: float | None
    #: Its window [s].
    during: tuple[float, float]
    #: Why it failed.
    reason: str | None

    @classmethod
    def of(cls, entry: Mapping[str, Any]) -> Check:
        """Read a check of a report."""
        known: dict[str, Any] = {name: entry.get(name) for name in cls.__dataclass_fields__}
        known["during"] = tuple(entry.get("during") or (0.0, 0.0))
        return cls(**known)


#: The runs that somebody still holds, by folder: a new run of this process spares them.
_HELD: weakref.WeakValueDictionary[Path, Run] = weakref.WeakValueDictionary()


class Run:
    """A run and its files. Jupyter shows it as a table of its checks and a picture of its plots."""

    #: The folder of the run.
    folder: Path
    #: All of `report.json`.
    report: dict[str, Any]

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder).resolve()
        path = self.folder / "report.json"
        try:
            self.report = json.loads(path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise InputError(f"expected the folder of a run, found no report.json in {self.folder}") from None
        _HELD[self.folder] = self

    @property
    def verdict(self) -> str:
        """How it ended: `pass`, `no checks`, `fail`, `doubtful`, `error` or `interrupted`."""
        return str(self.report["verdict"])

    @property
    def passed(self) -> bool:
        """Whether it came to its end, and no check or validation failed, and no analysis doubts its result against what the scenario expects. Without any, `verdict` is `no checks`."""
        return self.verdict in ("pass", "no checks")

    @cached_property
    def checks(self) -> list[Check]:
        """The checks, in the order of the scenario."""
        return [Check.of(entry) for entry in self.report["checks"]]

    @property
    def analyses(self) -> dict[str, Any]:
        """The results of analyses by their names."""
        return dict(self.report["analyses"])

    @property
    def warnings(self) -> list[str]:
        """What is odd, but no error."""
        return list(self.report["warnings"])

    @property
    def messages(self) -> list[dict[str, Any]]:
        """What the nodes say, by kind: node, level (summary, warning, error), text, count, and the time of the first one [s]."""
        return list(self.report.get("messages", []))

    @property
    def page(self) -> Path:
        """The page for people: a file that needs nothing but a browser."""
        return self.folder / "report.html"

    @property
    def recording(self) -> Path:
        """The recording with all signals and events, `run.mcap`."""
        return self.folder / "run.mcap"

    @property
    def parquet(self) -> Path:
        """The signals as Parquet; made from the recording when the run did not leave it.

        Raises:
            InputError: when there is no recording either.
        """
        path = self.folder / "run.parquet"
        if not path.exists():
            _judged(call(["convert", self.folder, "--out", path]))
        return path

    def arrow(self, signals: str | Iterable[str] | None = None) -> pa.Table:
        """Return the signals as a table of Arrow: `time` [s], then a column for each. Fields have their `unit` as metadata.

        Args:
            signals: names such as `plant.v_x`, or patterns such as `plant.*`; all without it. Only these are read.

        Raises:
            KeyError: when a name or a pattern fits no signal.
        """
        return _tables.read(self.parquet, signals, "time")

    def frame(self, signals: str | Iterable[str] | None = None) -> pandas.DataFrame:
        """Return the signals as a frame of pandas, by time [s]. `frame.attrs["units"]` has their units.

        Args:
            signals: names such as `plant.v_x`, or patterns such as `plant.*`; all without it. Only these are read.

        Raises:
            KeyError: when a name or a pattern fits no signal.
            ImportError: without pandas.
        """
        return _tables.to_pandas(self.arrow(signals), "time")

    def polars(self, signals: str | Iterable[str] | None = None) -> polars.DataFrame:
        """Return the signals as a frame of polars with a column `time` [s]. It holds no units: see `units`.

        Args:
            signals: names such as `plant.v_x`, or patterns such as `plant.*`; all without it. Only these are read.

        Raises:
            KeyError: when a name or a pattern fits no signal.
            ImportError: without polars.
        """
        return _tables.to_polars(self.arrow(signals))

    @cached_property
    def units(self) -> dict[str, str]:
        """The unit of each signal that has one."""
        return _tables.units(pq.read_schema(self.parquet).empty_table())

    @cached_property
    def signals(self) -> list[str]:
        """The names of all signals."""
        return [name for name in pq.read_schema(self.parquet).names if name != "time"]

    def plot(self, signals: str | Iterable[str], title: str | None = None) -> _plot.Plot:
        """Draw signals over time, all on one axis.

        Args:
            signals: names such as `plant.v_x`, or patterns such as `plant.*`.
            title: a title; by default the units of the signals.
        """
        table = self.arrow(signals)
        names = table.schema.names[1:]
        found = sorted({unit for name, unit in _tables.units(table).items() if name in names})
        curves = [_plot.Curve(name, name) for name in names]
        return _plot.draw(title or f"[{', '.join(found) or '-'}]", table, curves, (640.0, 300.0))

    def plots(self) -> list[_plot.Plot]:
        """Draw the plots that the scenario lays out in `[[view.plot]]`, or one for each unit of each node, as the replay has them."""
        schema = pq.read_schema(self.parquet)
        known = set(schema.names)
        layout = json.loads((schema.metadata or {}).get(b"trackside.plots", b"[]"))
        plots = []
        for plot in layout:
            curves = [curve for curve in plot["curves"] if curve["signal"] in known][:CURVES]
            if curves:
                drawn = [_plot.Curve(it["label"], it["signal"], it["factor"], it["offset"]) for it in curves]
                table = self.arrow([it.signal for it in drawn])
                plots.append(_plot.draw(plot["title"], table, drawn))
            if len(plots) == PLOTS:
                break
        return plots

    def view(self) -> str:
        """Open the replay in the Rerun viewer when it is installed and the run has one, the page in a browser otherwise.

        Returns:
            `viewer` or `page`: what was opened.
        """
        if (self.folder / "run.rrd").exists():
            viewer = subprocess.Popen(
                [program(), "view", self.folder],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
                env=environment_with_scripts(),
            )
            try:
                if viewer.wait(timeout=START) == 0:
                    return "viewer"
            except subprocess.TimeoutExpired:
                return "viewer"
        webbrowser.open(self.page.as_uri())
        return "page"

    def __repr__(self) -> str:
        held = sum(check.passed for check in self.checks)
        return f"<Run {self.report['scenario']}: {self.verdict}, {held} of {len(self.checks)} checks passed, {self.folder}>"

    def _repr_html_(self) -> str:
        parts = [f"<h4>{html.escape(self.report['title'])}: {_word(self.verdict)}</h4>"]
        if "error" in self.report:
            parts.append(f"<p>{html.escape(self.report['error'])}</p>")
        parts.append(_table_of(self.checks))
        try:
            pictures = "".join(str(plot) for plot in self.plots())
        except (TracksideError, OSError, pa.ArrowException) as error:
            pictures = f"<p>{html.escape(str(error))}</p>"
        parts.append(f'<div style="display:flex;flex-wrap:wrap;gap:8px">{pictures}</div>')
        parts.append(f"<p><code>{html.escape(str(self.folder))}</code></p>")
        return "\n".join(parts)


def _word(verdict: str) -> str:
    colour = "#0a7f5a" if verdict in ("pass", "passed", "identified") else "#5c6773" if verdict == "no checks" else "#c0392b"
    return f'<span style="color:{colour}">{html.escape(verdict)}</span>'


def _table_of(checks: Sequence[Check]) -> str:
    """Write checks as a table."""
    if not checks:
        return ""
    rows = ["<table><tr><th>check</th><th></th><th>value</th><th>limit</th><th>unit</th></tr>"]
    for check in checks:
        verdict = _word("passed" if check.passed else "FAILED")
        reason = f"<br>{html.escape(check.reason)}" if check.reason else ""
        name = f"{html.escape(check.name)}<br><code>{html.escape(check.that)}</code>{reason}"
        numbers = "".join(f"<td>{'' if it is None else f'{it:.4g}'}</td>" for it in (check.value, check.limit))
        rows.append(f'<tr><td style="text-align:left">{name}</td><td>{verdict}</td>{numbers}<td>{html.escape(check.unit or "")}</td></tr>')
    return "".join(rows) + "</table>"


def run(
    scenario: str | os.PathLike[str],
    *,
    set: Mapping[str, object] | Sequence[str] | None = None,
    seed: int | None = None,
    out: str | os.PathLike[str] | None = None,
    csv: bool = False,
    replay: bool = True,
    limit: float | None = None,
    arguments: Sequence[str] = (),
) -> Run:
    """Run a scenario to its end. A failed check is no exception: see `Run.passed`.

    Args:
        scenario: the file, or the name of a scenario that comes with the program, such as `step_steer`.
        set: values instead of the scenario's, `{"plant.body.m": 800.0, "plant.start.v_x": "100 km/h"}`, or words of `--set`.
        seed: the seed of every random stream, instead of the scenario's.
        out: the folder for the files. By default `target/runs/SCENARIO` in the current folder, with a number behind it while
            this process holds a run with that folder.
        csv: write `run.csv` too.
        replay: write `run.rrd` for the Rerun viewer.
        limit: end the run when it is not over after this time by the clock [s].
        arguments: further arguments of `trackside run`.

    Raises:
        InputError: when the scenario or an argument is wrong.
        FmuError: when an FMU or a plugin failed; its `run` is what was recorded until then.
        KeyboardInterrupt: after Ctrl-C, when the program has closed its recordings.
    """
    path = find(scenario)
    folder = Path(out) if out is not None else free(Path("target/runs") / path.stem)
    words = ["run", os.fspath(path), "--out", os.fspath(folder), "--parquet", *settings(set, seed)]
    words += ["--csv"] if csv else []
    words += [] if replay else ["--rerun", "off"]
    words += ["--limit", repr(float(limit))] if limit is not None else []
    before = _stamp(folder)
    ended = call([*words, *arguments])
    _judged(ended, folder, is_new=_stamp(folder) not in (None, before))
    return Run(folder)


def load(folder: str | os.PathLike[str]) -> Run:
    """Return the run in a folder, also one that the program made without Python.

    Raises:
        InputError: when there is no report of a run.
    """
    return Run(folder)


def find(scenario: str | os.PathLike[str]) -> Path:
    """Return the file of a scenario: the path itself, or that of a scenario of this name that comes with the program."""
    path = Path(scenario)
    if path.is_file() or path.suffix or len(path.parts) != 1:
        return path
    from ._scenarios import scenarios

    try:
        return scenarios().get(str(scenario), path)
    except TracksideError:
        return path


def free(folder: Path) -> Path:
    """Return the folder, or one with a number behind its name while a run of this process has it."""
    candidate, count = folder, 1
    while candidate.resolve() in _HELD:
        count += 1
        candidate = folder.with_name(f"{folder.name}_{count}")
    return candidate


def _stamp(folder: Path) -> tuple[int, int] | None:
    """Tell one report of a folder from the next."""
    try:
        status = (folder / "report.json").stat()
    except OSError:
        return None
    return (status.st_ino, status.st_mtime_ns)


def _judged(ended: Ended, folder: Path | None = None, is_new: bool = False) -> None:
    """Raise what the exit code says; 0, 1 and 4 (an analysis doubts its result) are results. `is_new` says that the folder holds the report of this very run."""
    if ended.code in (0, 1, 4):
        return
    if ended.code == 2:
        raise InputError(ended.message)
    if ended.code == 3:
        raise FmuError(ended.message, folder, Run(folder) if folder and is_new else None)
    raise TracksideError(f"{ended.reason}\n{ended.message}")
