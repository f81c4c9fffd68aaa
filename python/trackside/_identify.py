"""Identify the tires of a car from a frame: write it as a log, run the identification, show what is known."""

from __future__ import annotations

import html
import json
import math
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
import pyarrow.parquet as pq

from ._errors import InputError
from ._program import call
from ._run import Run, _judged, _stamp, _word, free

if TYPE_CHECKING:
    import pandas

#: The signals of each task, in SI units: docs/identification.md.
SIGNALS: dict[str, dict[str, str]] = {
    "tires": {
        "v_x": "m/s", "v_y": "m/s", "r": "rad/s", "a_x": "m/s2", "a_y": "m/s2", "a_z": "m/s2", "delta": "rad", "gear": "1",
        "omega_fl": "rad/s", "omega_fr": "rad/s", "omega_rl": "rad/s", "omega_rr": "rad/s",
    },
    "closed_loop": {"v_x": "m/s", "v_y": "m/s", "r": "rad/s", "a_y": "m/s2", "F_x": "N", "delta": "rad"},
}  # fmt: skip
#: A title with a unit: `v_x [m/s]`.
TITLE = re.compile(r"(?P<name>.*?)\s*\[(?P<unit>[^\]]*)\]\s*")


class Identification:
    """Tires that were identified, with their intervals and verdicts. Jupyter shows them as a table with curves on a page."""

    #: The run that identified them.
    run: Run

    def __init__(self, run: Run) -> None:
        self.run = run

    @property
    def result(self) -> dict[str, Any]:
        """All that the identification says, as in the report: docs/identification.md has the keys."""
        return dict(self.run.report["analyses"]["tires"])

    @property
    def summary(self) -> list[str]:
        """Sentences; the first one has the verdict on the model."""
        return list(self.result.get("summary", []))

    @property
    def sound(self) -> bool:
        """Whether the model fits: otherwise nothing is identified."""
        return bool(self.result.get("sound", True))

    @property
    def page(self) -> Path:
        """The page with curves, bands and reasons."""
        return self.run.folder / "tires.html"

    @property
    def start_values(self) -> Path:
        """Start values for the next run: `trackside.run(scenario, set=[f"@{found.start_values}"])`."""
        return self.run.folder / "tires.toml"

    def arrow(self) -> pa.Table:
        """Return the parameters as a table: `method`, `curve`, `parameter`, `value`, `std`, `low` and `high` (the 95 % interval),
        `verdict` (`identified`, `weak`, `not_identifiable`) and its `reason`."""
        rows = []
        for method, curves in self.result.items():
            if not isinstance(curves, dict):
                continue
            for curve, found in curves.items():
                if isinstance(found, dict) and isinstance(found.get("mean"), dict):
                    rows += [_row(method, curve, found, name) for name in found["mean"]]
        return pa.Table.from_pylist(rows, schema=PARAMETERS)

    def frame(self) -> pandas.DataFrame:
        """Return the parameters as a frame of pandas, by method, curve and parameter.

        Raises:
            ImportError: without pandas.
        """
        return self.arrow().to_pandas().set_index(["method", "curve", "parameter"])

    def __repr__(self) -> str:
        return f"<Identification: {self.summary[0] if self.summary else self.run.verdict}, {self.run.folder}>"

    def _repr_html_(self) -> str:
        parts = [f"<p>{html.escape(sentence)}</p>" for sentence in self.summary]
        parts.append("<table><tr><th>method</th><th>curve</th><th></th><th>value</th><th>95 % interval</th><th></th></tr>")
        for row in self.arrow().to_pylist():
            low, high = row["low"], row["high"]
            interval = "" if low is None or high is None else f"{low:.4g} to {high:.4g}"
            value = "" if row["value"] is None else f"{row['value']:.4g}"
            words = (row["method"], row["curve"], row["parameter"], value, interval)
            cells = "".join(f"<td>{html.escape(word)}</td>" for word in words)
            parts.append(f'<tr>{cells}<td title="{html.escape(row["reason"] or "")}">{_word(row["verdict"] or "")}</td></tr>')
        parts.append(f"</table><p><code>{html.escape(str(self.page))}</code></p>")
        return "".join(parts)


PARAMETERS = pa.schema(
    [("method", pa.string()), ("curve", pa.string()), ("parameter", pa.string())]
    + [(name, pa.float64()) for name in ("value", "std", "low", "high")]
    + [("verdict", pa.string()), ("reason", pa.string())]
)


def _row(method: str, curve: str, found: Mapping[str, Any], name: str) -> dict[str, Any]:
    low, high = (found.get("interval") or {}).get(name) or (None, None)
    return {
        "method": method,
        "curve": curve,
        "parameter": name,
        "value": found["mean"][name],
        "std": (found.get("std") or {}).get(name),
        "low": low,
        "high": high,
        "verdict": (found.get("identified") or {}).get(name),
        "reason": (found.get("reason") or {}).get(name),
    }


def identify(
    frame: Any,
    *,
    car: Mapping[str, Any],
    units: Mapping[str, str] | str | None = None,
    columns: Mapping[str, str] | None = None,
    time: str | None = None,
    task: str = "tires",
    config: Mapping[str, Any] | None = None,
    out: str | os.PathLike[str] | None = None,
) -> Identification:
    """Identify the tires of a car from the log of a drive.

    Args:
        frame: a frame of pandas or polars, a table of Arrow, a mapping of columns, or the path of a CSV or Parquet file.
        car: the data of the car, as `[analysis.config.car]` has them: `{"body": {"m": 982.0, "I_zz": 1605.0, "l_f": 1.33,
            "l_r": 1.07, "h": {"value": 0.45, "std": 0.05}}, "aero": "none", "drive_front_share": 0.0,
            "brake_front_share": "by_load"}`.
        units: the unit of each signal, or `SI` for all; those in `frame.attrs["units"]` and in titles such as `v_x [km/h]` are known.
        columns: the column of each signal, `{"v_x": "Speed", "r": "YawRate"}`; by default columns with the names of signals.
        time: the column of the time [s]; by default `time`, or else the index of a frame of pandas.
        task: `tires`, from accelerations and speeds, or `closed_loop`, from what sensors measured and the force that drove.
        config: more keys of `[analysis.config]`, such as `{"methods": ["least_squares"]}`.
        out: the folder for the files; `target/runs/tires` in the current folder by default, numbered as those of `run`.

    Raises:
        InputError: when a signal, a unit or a datum of the car is missing or wrong.
        FmuError: when the identification failed.
    """
    if task not in SIGNALS:
        raise InputError(f"task: expected one of {', '.join(SIGNALS)}, found {task!r}")
    table, known = _table(frame, time)
    names = _columns(table, columns, task)
    wanted = SIGNALS[task]
    found = {signal: _unit(signal, column, units, known, wanted) for signal, column in names.items()}
    folder = (Path(out) if out is not None else free(Path("target/runs/tires"))).resolve()
    # Beside the folder of the run, which a run keeps to itself.
    place = folder.with_name(f"{folder.name}.input")
    place.mkdir(parents=True, exist_ok=True)
    log = pa.table({"time": table["time"]} | {signal: table[column] for signal, column in names.items()})
    pa.csv.write_csv(log, place / "log.csv")
    scenario = place / "tires.toml"
    scenario.write_text(_scenario(found, {"task": task, "car": car, **(config or {})}), encoding="utf-8")
    before = _stamp(folder)
    ended = call(["run", scenario, "--out", folder, "--parquet"], _workspace())
    _judged(ended, folder, is_new=_stamp(folder) not in (None, before))
    return Identification(Run(folder))


def _workspace() -> Path | None:
    """Return the clone of the repository that this package is in, if it is in one: it builds the plugin."""
    clone = Path(__file__).resolve().parent.parent.parent
    return clone if (clone / "Cargo.toml").is_file() else None


def _table(frame: Any, time: str | None) -> tuple[pa.Table, dict[str, str]]:
    """Convert what holds columns to a table with a column `time` [s] of numbers; return the units that are known, too."""
    units: dict[str, str] = {}
    if isinstance(frame, (str, os.PathLike)):
        path = Path(frame)
        table = pq.read_table(path) if path.suffix == ".parquet" else pa.csv.read_csv(path)
    elif isinstance(frame, pa.Table):
        table = frame
    elif hasattr(frame, "to_arrow"):
        table = frame.to_arrow()
    elif hasattr(frame, "reset_index"):
        units |= frame.attrs.get("units", {})
        if time is None and "time" not in map(_name, frame.columns):
            index = frame.index.name or "index"
            frame, time = frame.reset_index(), index
        table = pa.Table.from_pandas(frame.rename(columns=str), preserve_index=False)
    else:
        table = pa.table({str(name): list(values) for name, values in dict(frame).items()})
    for field in table.schema:
        unit = (field.metadata or {}).get(b"unit")
        title = TITLE.fullmatch(field.name)
        if title:
            units[title["name"]] = title["unit"]
        if unit:
            units[field.name] = unit.decode()
    table = table.rename_columns([_name(name) for name in table.schema.names])
    clock = _name(time or "time")
    if clock not in table.schema.names:
        raise InputError(f"expected a column {clock!r} with the time [s], found {', '.join(table.schema.names)}")
    if units.get(clock, "s") != "s":
        raise InputError(f"expected the time in s, found {units[clock]!r}")
    seconds = _seconds(table[clock])
    rest = table.drop_columns([clock])
    return rest.append_column("time", seconds), units


def _name(title: str) -> str:
    """Return the title of a column without its unit."""
    found = TITLE.fullmatch(str(title))
    return found["name"] if found else str(title)


def _seconds(times: pa.ChunkedArray) -> pa.ChunkedArray:
    """Return times in seconds; time stamps count from the first one."""
    if pa.types.is_timestamp(times.type) or pa.types.is_duration(times.type):
        if pa.types.is_timestamp(times.type):
            times = pc.subtract(times, times[0])
        return pc.divide(pc.cast(pc.cast(times, pa.duration("ns")), pa.int64()).cast(pa.float64()), 1e9)
    return pc.cast(times, pa.float64())


def _columns(table: pa.Table, columns: Mapping[str, str] | None, task: str) -> dict[str, str]:
    """Return the column of each signal that there is."""
    wanted, there = SIGNALS[task], table.schema.names
    if columns is None:
        found = {signal: signal for signal in wanted if signal in there}
        if not found:
            raise InputError(f"expected columns with the names of signals ({', '.join(wanted)}), found {', '.join(there)}: use columns={{...}}")
        return found
    for signal, column in columns.items():
        if signal not in wanted:
            raise InputError(f"columns: expected signals of the task {task} ({', '.join(wanted)}), found {signal!r}")
        if _name(column) not in there:
            raise InputError(f"columns: expected one of {', '.join(there)} for {signal}, found {column!r}")
    return {signal: _name(column) for signal, column in columns.items()}


def _unit(signal: str, column: str, given: Mapping[str, str] | str | None, known: Mapping[str, str], wanted: Mapping[str, str]) -> str:
    """Return the unit of a signal: what the caller says goes before what the frame says."""
    if isinstance(given, str):
        if given != "SI":
            raise InputError(f"units: expected the unit of each signal or 'SI', found {given!r}")
        return wanted[signal]
    unit = (given or {}).get(signal) or (given or {}).get(column) or known.get(column)
    if unit is None:
        raise InputError(f"the column {column!r} of {signal} has no unit: say units={{{signal!r}: {wanted[signal]!r}}}, or units='SI' for all")
    return unit


def _scenario(units: Mapping[str, str], config: Mapping[str, Any]) -> str:
    """Write the scenario that identifies from `log.csv` beside it."""
    lines = ['title = "Tires from a log"', "", "[[analysis]]", 'name = "tires"', 'crate = "identify"', "", "[analysis.table]"]
    lines += ['path = "log.csv"', 'time = "time"', "", "[analysis.table.columns]"]
    lines += [f"{signal} = {toml({'column': signal, 'unit': unit})}" for signal, unit in units.items()]
    lines += ["", "[analysis.config]"]
    lines += [f"{key} = {toml(value)}" for key, value in config.items()]
    return "\n".join(lines) + "\n"


def toml(value: Any) -> str:
    """Write a value as TOML, tables on one line."""
    item = getattr(value, "item", None)
    if callable(item):
        value = item()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return "nan" if math.isnan(value) else repr(value)
    if isinstance(value, (str, os.PathLike)):
        # What JSON escapes, TOML escapes alike; letters beyond ASCII are themselves in both.
        return json.dumps(os.fspath(value), ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{toml(str(key))} = {toml(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, Sequence):
        return "[" + ", ".join(toml(inner) for inner in value) + "]"
    raise InputError(f"expected numbers, texts, lists and mappings, found {value!r}")
