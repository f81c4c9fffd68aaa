"""Read Parquet into tables of Arrow, pandas and polars, with the units of their columns."""

from __future__ import annotations

import difflib
import fnmatch
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.parquet as pq

if TYPE_CHECKING:
    import pandas
    import polars


def read(path: Path, signals: str | Iterable[str] | None, always: str) -> pa.Table:
    """Read the columns that `signals` names, all without it; the column `always` comes first.

    Raises:
        KeyError: when a name or a pattern fits no column.
    """
    with pq.ParquetFile(path) as file:
        return file.read(columns=chosen(file.schema_arrow.names, signals, always))


def chosen(names: list[str], signals: str | Iterable[str] | None, always: str) -> list[str] | None:
    """Resolve names and patterns such as `plant.*` to columns."""
    if signals is None:
        return None
    columns = [always]
    for signal in [signals] if isinstance(signals, str) else signals:
        # Elements of arrays have brackets in their names, which are no pattern then.
        found = [signal] if signal in names else fnmatch.filter(names, signal)
        if not found:
            close = difflib.get_close_matches(signal, names, n=3, cutoff=0.5)
            hint = f"did you mean {', '.join(close)}?" if close else f"there are {', '.join(names[:20])} ..."
            raise KeyError(f"expected a recorded signal, found {signal!r}; {hint}")
        columns += [name for name in found if name not in columns]
    return columns


def units(table: pa.Table) -> dict[str, str]:
    """Return the unit of each column that has one."""
    found = {}
    for field in table.schema:
        unit = (field.metadata or {}).get(b"unit")
        if unit:
            found[field.name] = unit.decode()
    return found


def to_pandas(table: pa.Table, index: str) -> pandas.DataFrame:
    """Convert to pandas, with a column as index and the units in `attrs["units"]`."""
    frame = table.to_pandas().set_index(index)
    frame.attrs["units"] = units(table)
    return frame


def to_polars(table: pa.Table) -> polars.DataFrame:
    """Convert to polars. Its frames hold no units: `Run.units` has them."""
    import polars

    frame = polars.from_arrow(table)
    assert isinstance(frame, polars.DataFrame)
    return frame
