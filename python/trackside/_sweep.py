"""Run the variants of a scenario, and show what became of them as a table."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from . import _tables
from ._errors import FmuError, InputError
from ._program import call, settings
from ._run import Run, _judged, _stamp, find

if TYPE_CHECKING:
    import pandas
    import polars

#: Variants that a notebook shows: those that did not pass come first.
SHOWN = 10


class Sweep:
    """The variants of a scenario that were run. Jupyter shows the share that passed, and variants that did not."""

    #: The folder of the plan.
    folder: Path

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder).resolve()
        if not self.parquet.exists():
            raise InputError(f"expected the folder of a sweep, found no sweep.parquet in {self.folder}")

    @property
    def parquet(self) -> Path:
        """The table: a row for each variant."""
        return self.folder / "sweep.parquet"

    @property
    def page(self) -> Path:
        """The page for people: a file that needs nothing but a browser."""
        return self.folder / "sweep.html"

    @property
    def summary(self) -> dict[str, Any]:
        """All of `sweep.json`."""
        return dict(json.loads((self.folder / "sweep.json").read_text(encoding="utf-8")))

    def arrow(self, columns: str | Iterable[str] | None = None) -> pa.Table:
        """Return the variants as a table of Arrow: `variant`, the varied values, `verdict`, checks, collected words.

        Args:
            columns: names such as `plant.body.m`, or patterns such as `margin.*`; all without it.

        Raises:
            KeyError: when a name or a pattern fits no column.
        """
        return _tables.read(self.parquet, columns, "variant")

    def frame(self, columns: str | Iterable[str] | None = None) -> pandas.DataFrame:
        """Return the variants as a frame of pandas, by `variant`. `frame.attrs["units"]` has the units.

        Args:
            columns: names such as `plant.body.m`, or patterns such as `margin.*`; all without it.

        Raises:
            KeyError: when a name or a pattern fits no column.
            ImportError: without pandas.
        """
        return _tables.to_pandas(self.arrow(columns), "variant")

    def polars(self, columns: str | Iterable[str] | None = None) -> polars.DataFrame:
        """Return the variants as a frame of polars. It holds no units: see `units`.

        Args:
            columns: names such as `plant.body.m`, or patterns such as `margin.*`; all without it.

        Raises:
            KeyError: when a name or a pattern fits no column.
            ImportError: without polars.
        """
        return _tables.to_polars(self.arrow(columns))

    @property
    def units(self) -> dict[str, str]:
        """The unit of each column that has one."""
        return _tables.units(pq.read_schema(self.parquet).empty_table())

    @property
    def share(self) -> float:
        """The share of the variants that passed, or came to their end where nothing is checked, from 0 to 1; NaN without variants."""
        passed = pc.sum(_passed(self.arrow("verdict"))).as_py() or 0
        return passed / len(self) if len(self) else float("nan")

    def variants(self, verdict: str) -> list[int]:
        """Return the variants with this verdict: `passed`, `no checks`, `failed` or `error`."""
        table = self.arrow("verdict")
        return list(table.filter(pc.equal(table["verdict"], verdict))["variant"].to_pylist())

    def replay(self, variant: int) -> Run:
        """Run one variant again, with everything recorded.

        Raises:
            InputError: when there is no such variant.
            FmuError: when an FMU fails in it, as it did; its `run` is what was recorded until then.
        """
        folder = self.folder / "variants" / str(int(variant))
        before = _stamp(folder)
        ended = call(["replay", self.folder / str(int(variant))])
        _judged(ended, folder, is_new=_stamp(folder) not in (None, before))
        return Run(folder)

    def __len__(self) -> int:
        return int(pq.read_metadata(self.parquet).num_rows)

    def __repr__(self) -> str:
        return f"<Sweep of {len(self)} variants: {self.share:.1%} passed, {self.folder}>"

    def _repr_html_(self) -> str:
        table = self.arrow()
        order = pc.sort_indices(_passed(table))
        first = table.take(order[:SHOWN])
        head = "".join(f"<th>{html.escape(name)}</th>" for name in first.schema.names)
        rows = "".join("<tr>" + "".join(f"<td>{_cell(value)}</td>" for value in row.values()) + "</tr>" for row in first.to_pylist())
        note = f"<p>{len(self)} variants, {self.share:.1%} passed; <code>{html.escape(str(self.page))}</code></p>"
        return f"{note}<table><tr>{head}</tr>{rows}</table>"


def _passed(table: pa.Table) -> pa.ChunkedArray:
    """Return for each variant whether it came to its end and failed no check."""
    return pc.is_in(table["verdict"], value_set=pa.array(["passed", "no checks"]))


def _cell(value: object) -> str:
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else html.escape(str(value))


def sweep(
    scenario: str | os.PathLike[str],
    *,
    jobs: int | None = None,
    set: Mapping[str, object] | Sequence[str] | None = None,
    seed: int | None = None,
    out: str | os.PathLike[str] | None = None,
    replace: bool = False,
    arguments: Sequence[str] = (),
) -> Sweep:
    """Run all variants of a scenario with `[sweep]` on this machine. A sweep that was interrupted goes on.

    A variant in which an FMU fails is a row of the table, no exception.

    Args:
        scenario: the file, or the name of a scenario that comes with the program.
        jobs: variants at a time; one for each core by default.
        set: values instead of the scenario's, `{"plant.body.m": 800.0}`.
        seed: the seed of every random stream, instead of the scenario's.
        out: the folder of the plan; `target/sweeps/SCENARIO` in the current folder by default.
        replace: replace the results of another sweep in the folder.
        arguments: further arguments of `trackside sweep`.

    Raises:
        InputError: when the scenario or an argument is wrong.
        FmuError: when the sweep as a whole failed.
        KeyboardInterrupt: after Ctrl-C; what was done by then stays.
    """
    path = find(scenario)
    folder = Path(out) if out is not None else Path("target/sweeps") / path.stem
    words = ["sweep", os.fspath(path), "--out", os.fspath(folder), *settings(set, seed)]
    words += ["--jobs", str(jobs)] if jobs is not None else []
    words += ["--replace"] if replace else []
    ended = call([*words, *arguments])
    # Code 3 says that an FMU failed in a variant, which the table tells.
    if ended.code != 3:
        _judged(ended)
    elif not (folder / "sweep.parquet").exists():
        raise FmuError(ended.message, folder)
    return Sweep(folder)
