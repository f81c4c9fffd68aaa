"""Analyses in Python: a function over the signals of a run.

A scenario names the file, `[[analysis]] python = "energy.py"`, and the file has a function:

    def analyse(signals, config):
        v = signals["v"]
        return {"mean": sum(v.values) / len(v.values), "unit": v.unit}

`signals` is a `Signals`: by name a `Signal` with `time` [s], `values` and `unit`. With numpy installed both columns are arrays, else
memoryviews of float; neither is a copy. `signals.table()` is a table of pyarrow, whose fields have the unit in their metadata, and
`signals.frame()` one of pandas; libraries that take Arrow's stream interface take `signals` itself. `config` is what stands in
`[analysis.config]`. The result is a dict of what JSON has, and of numbers and arrays of numpy; checks find it under the name of the
analysis. NaN becomes null.

A function with a third argument gets a `Run`, for progress, files and derived signals. A variable `signals = {"v": "m/s"}` of the
file says which signals it takes, and in which units; without it, all of any name, in their own.

This file is also the program that runs in the process of such an analysis.
"""

import importlib.util
import inspect
import json
import math
import mmap
import os
import pathlib
import struct
import sys
from collections.abc import Mapping

__all__ = ["Run", "Signal", "Signals"]


class Signal:
    """A signal: `time` [s] and `values`, and the `unit` of these, empty where there is none."""

    def __init__(self, name, time, values, unit=""):
        self.name, self.time, self.values, self.unit = name, time, values, unit

    def __len__(self):
        return len(self.values)

    def __array__(self, dtype=None, copy=None):
        import numpy

        return numpy.array(self.values, dtype=dtype, copy=bool(copy))

    def __repr__(self):
        unit = f" [{self.unit}]" if self.unit else ""
        return f"<signal {self.name}{unit}, {len(self)} values>"


class Signals(Mapping):
    """Signals by their names."""

    def __init__(self, signals):
        self._signals = {signal.name: signal for signal in signals}

    def __getitem__(self, name):
        if name not in self._signals:
            raise KeyError(f"expected one of the signals {', '.join(self._signals) or '(none)'}, found {name}: add it to [analysis.signals]")
        return self._signals[name]

    def __iter__(self):
        return iter(self._signals)

    def __len__(self):
        return len(self._signals)

    def _alike(self, names):
        """The chosen signals, which have the same times."""
        chosen = [self[name] for name in names or self._signals]
        for signal in chosen[1:]:
            if signal.time is not chosen[0].time:
                raise ValueError(f"`{signal.name}` has other times than `{chosen[0].name}`: name signals with the same times")
        return chosen

    def table(self, *names):
        """A table of pyarrow with the column `time` and these signals, or all; nothing is copied."""
        try:
            import pyarrow
        except ImportError:
            raise ImportError(f"signals.table() needs pyarrow: {sys.executable} -m pip install pyarrow") from None
        chosen = self._alike(names)

        def array(values):
            return pyarrow.Array.from_buffers(pyarrow.float64(), len(values), [None, pyarrow.py_buffer(values)])

        fields = [pyarrow.field("time", pyarrow.float64(), metadata={"unit": "s"})]
        fields += [pyarrow.field(it.name, pyarrow.float64(), metadata={"unit": it.unit} if it.unit else None) for it in chosen]
        columns = [array(chosen[0].time if chosen else memoryview(b"").cast("d"))] + [array(it.values) for it in chosen]
        return pyarrow.Table.from_arrays(columns, schema=pyarrow.schema(fields))

    def __arrow_c_stream__(self, requested_schema=None):
        return self.table().__arrow_c_stream__(requested_schema)

    def frame(self, *names):
        """A frame of pandas with the index `time` and these signals, or all; units are in `frame.attrs["units"]`."""
        import pandas

        chosen = self._alike(names)
        frame = pandas.DataFrame({it.name: it.values for it in chosen}, index=pandas.Index(chosen[0].time if chosen else [], name="time"))
        frame.attrs["units"] = {it.name: it.unit for it in chosen}
        return frame


class Run:
    """The program, as an analysis sees it."""

    def __init__(self, line, folder):
        self._line = line
        #: Files that are written here end in the folder of the run.
        self.folder = pathlib.Path(folder)

    def progress(self, share, task=""):
        """Tells the share of the work that is done, 0 to 1, and the next task."""
        self._line.give(3, json.dumps([float(share), str(task)]).encode())

    def record(self, group, time, values, units=None):
        """Adds signals to the recording, under the name of the group: values by name, over rising times [s]."""
        columns = [list(map(float, column)) for column in [time, *values.values()]]
        names = [[name, (units or {}).get(name, "")] for name in values]
        if any(len(column) != len(columns[0]) for column in columns):
            raise ValueError(f"expected columns of equal length to record as `{group}`, found {[len(it) for it in columns]}")
        head = json.dumps([group, names, len(columns[0])]).encode()
        body = b"".join(struct.pack(f"<{len(column)}d", *column) for column in columns)
        self._line.give(4, len(head).to_bytes(4, "little") + head + body)


def _plain(value, path="the result"):
    """A value that JSON has."""
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): _plain(inner, f"{path}[{key!r}]") for key, inner in value.items()}
    if isinstance(value, (list, tuple, set, memoryview)):
        return [_plain(inner, f"{path}[{place}]") for place, inner in enumerate(value)]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "tolist"):  # Numbers and arrays of numpy, series of pandas.
        return _plain(value.tolist(), path)
    raise TypeError(f"expected a number, a text, a list or a dict in {path}, found {type(value).__name__}")


def _columns(about):
    """The signals in a file of numbers."""
    with open(about["data"], "rb") as file:
        length = os.fstat(file.fileno()).st_size
        data = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) if length else b"").cast("d")
    try:
        import numpy
    except ImportError:
        numpy = None

    def column(place):
        begin, length = place
        values = data[begin:begin + length]
        return values if numpy is None else numpy.frombuffer(values, dtype="f8")

    times = [column(place) for place in about["times"]]
    return Signals(Signal(it["name"], times[it["time"]], column(it["values"]), it["unit"]) for it in about["signals"])


def _beside(name):
    """Loads another file of this folder, whatever else is installed."""
    path = os.path.join(os.path.dirname(os.path.realpath(__file__)), name + ".py")
    specification = importlib.util.spec_from_file_location("trackside." + name, path)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def _main(path):
    """Loads a script, says which signals it takes, and analyses when it is asked."""
    fmu = _beside("fmu")
    line, folder = fmu._Line(), os.path.dirname(os.path.realpath(path))
    fmu._appear_as("fmu", fmu)
    fmu._appear_as("analysis", sys.modules["__main__"])
    try:
        module = fmu._load(path)
        analyse = getattr(module, "analyse", None)
        if not callable(analyse):
            raise TypeError("expected a function `analyse(signals, config)`, found none")
        wanted = getattr(module, "signals", None)
        if wanted is not None and not (isinstance(wanted, dict) and all(isinstance(it, str) for pair in wanted.items() for it in pair)):
            raise TypeError(f"expected units by names of signals in `signals`, found {wanted!r}")
        arguments = len(inspect.signature(analyse).parameters)
    except BaseException as error:
        return line.fail(error, folder)
    line.give(0, json.dumps(wanted).encode())
    question = line.take()
    if question is None:
        return None
    try:
        about = json.loads(question[1])
        given = [_columns(about), about["config"], Run(line, about["folder"])][:max(arguments, 2)]
        result = analyse(*given)
        if not isinstance(result, Mapping):
            raise TypeError(f"expected a dict from `analyse`, found {type(result).__name__}")
        answer = json.dumps(_plain(result), allow_nan=False).encode()
    except BaseException as error:
        return line.fail(error, folder)
    line.give(0, answer)
    # The answer is on its way: what the script left running ends with the connection.
    line.take()


if __name__ == "__main__":
    _main(sys.argv[1])
