"""Step a scenario from Python: set and read its variables between two steps, go back, and let Python steer.

A session has the scenario in this process: the library that `trackside pack --fmu` puts into an FMU, with the functions of FMI 3.0.
"""

from __future__ import annotations

import copy
import ctypes
import difflib
import html
import json
import logging
import math
import os
import re
import shutil
import tempfile
import threading
import weakref
from array import array
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from . import fmu
from ._errors import FmuError, InputError, TracksideError
from ._program import call, settings
from ._run import _judged, find

if TYPE_CHECKING:
    import pandas
    import pyarrow as pa

    Number = float | int | bool

#: Messages of FMUs go here: warnings, and with `log=True` all.
LOGGER = logging.getLogger("trackside.session")
#: Steps that are done in one call; Ctrl-C is heard between two calls.
STEPS = 250
#: `fmi3Status`: from here on a call has failed.
FAILED = 2
#: Variables that a notebook shows of a session.
SHOWN = 40

_OK, _WARNING = 0, 1
_ONE = ctypes.c_size_t(1)
_CELLS: dict[str, type] = {
    "real": ctypes.c_double,
    "integer": ctypes.c_int32,
    "boolean": ctypes.c_uint8,
    "string": ctypes.c_char_p,
}
_CALLS = {"real": "Float64", "integer": "Int32", "boolean": "Boolean", "string": "String"}
_LOG_MESSAGE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)

#: The library of this process, which later sessions take, too.
_LIBRARIES: list[str] = []

#: What the controller calls of a session: the time [s] and its inputs in, its output or outputs out.
Controller = Callable[..., Any]


@dataclass(frozen=True)
class Variable:
    """A variable of a session."""

    #: Its name, `node.variable`.
    name: str
    #: Its type: `real`, `integer`, `boolean` or `string`.
    kind: str
    #: What one may do: `output` (read), `input` (set; nothing else does), `override` (set instead of the scenario, and `release`),
    #: `parameter` (set before the first step).
    role: str
    #: Its unit; None without one.
    unit: str | None
    #: One line about it.
    description: str | None


class _Native:
    """An instance of the library, with all that has to live as long as it. It is freed with the last session or state that needs it."""

    def __init__(self, about: Mapping[str, Any], folder: Path, log: bool) -> None:
        self.library = ctypes.CDLL(about["library"])
        _LIBRARIES[:] = [about["library"]]
        self.messages: list[tuple[int, str]] = []
        messages = self.messages

        @_LOG_MESSAGE
        def take(_environment: int, status: int, _category: bytes, text: bytes) -> None:
            messages.append((status, text.decode(errors="replace")))

        self.take = take
        function = self.library.fmi3InstantiateCoSimulation
        function.restype = ctypes.c_void_p
        function.argtypes = [
            *(ctypes.c_char_p,) * 3, *(ctypes.c_bool,) * 4, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p, _LOG_MESSAGE, ctypes.c_void_p,
        ]  # fmt: skip
        name = f"{about['name']}-{id(self):x}".encode()
        pointer = function(name, about["token"].encode(), os.fsencode(folder), False, log, False, False, None, 0, None, take, None)
        if not pointer:
            raise TracksideError("\n".join(text for _, text in messages) or "the library made no instance of the scenario")
        self.instance = ctypes.c_void_p(pointer)
        self.states: weakref.WeakSet[State] = weakref.WeakSet()
        self.free = weakref.finalize(self, _free_instance, self.library, self.instance, take, str(folder), os.getpid())

    def function(self, name: str) -> Any:
        """A function of FMI 3.0; it gets arguments of ctypes, which need no conversion."""
        return getattr(self.library, f"fmi3{name}")

    def close(self) -> None:
        """Free the states and the instance."""
        for state in list(self.states):
            state._free()
        self.free()


def _free_instance(library: ctypes.CDLL, instance: ctypes.c_void_p, _take: object, folder: str, process: int) -> None:
    # What a fork copied belongs to its parent.
    if os.getpid() == process:
        library.fmi3FreeInstance(instance)
        _remove(folder, process)


def _remove(folder: str, process: int) -> None:
    if os.getpid() == process:
        shutil.rmtree(folder, ignore_errors=True)


class State:
    """A state of a session: all that it goes on from, controllers included that have `save` and `restore`."""

    def __init__(self, native: _Native, pointer: ctypes.c_void_p, tick: int, controllers: list[Any]) -> None:
        self._native, self._pointer, self._tick, self._controllers = native, pointer, tick, controllers
        native.states.add(self)
        self._free = weakref.finalize(self, _free_state, native, pointer, os.getpid())


def _free_state(native: _Native, pointer: ctypes.c_void_p, process: int) -> None:
    if os.getpid() == process and native.free.alive:
        native.function("FreeFMUState")(native.instance, ctypes.byref(pointer))


class Trace:
    """Values at communication points, as `Session.record` takes them."""

    def __init__(self, session: Session, names: list[str], every: int) -> None:
        self.names = names
        self._every, self._session = every, weakref.ref(session)
        self._units = {name: unit for name in names if (unit := session.unit(name))}
        self._read = [session._reader(name) for name in names]
        self._ticks, self._times, self._values = array("q"), array("d"), array("d")

    def _take(self, tick: int, time: float) -> None:
        if tick % self._every == 0:
            self._ticks.append(tick)
            self._times.append(time)
            self._values.extend([read() for read in self._read])

    def _forget_after(self, tick: int) -> None:
        """Drop what comes after a state that the session goes back to."""
        while self._ticks and self._ticks[-1] > tick:
            self._ticks.pop()
            self._times.pop()
            del self._values[len(self._ticks) * len(self.names) :]

    def __len__(self) -> int:
        return len(self._ticks)

    def arrow(self) -> pa.Table:
        """Return the values as a table of Arrow: `time` [s], then a column for each variable, with its `unit` as metadata."""
        import pyarrow as pa

        count = len(self.names)
        columns = {"time": self._times} | {name: self._values[place::count] for place, name in enumerate(self.names)}
        units = {"time": "s"} | self._units
        fields = [pa.field(name, pa.float64(), metadata={"unit": units[name]} if name in units else None) for name in columns]
        return pa.table([pa.array(values, pa.float64()) for values in columns.values()], pa.schema(fields))

    def frame(self) -> pandas.DataFrame:
        """Return the values as a frame of pandas, by time [s]. `frame.attrs["units"]` has their units.

        Raises:
            ImportError: without pandas.
        """
        from . import _tables

        return _tables.to_pandas(self.arrow(), "time")

    def stop(self) -> None:
        """Take no more values."""
        session = self._session()
        if session is not None and self in session._traces:
            session._traces.remove(self)


class Session:
    """A scenario that this process steps.

        with trackside.Session("step_steer", set={"plant.body.m": 1200.0}) as s:
            s["plant.delta"] = 0.02
            s.step()
            s["plant.r"]

    Until the first step all that is set counts from the beginning, parameters too. FMUs run in this process: one that crashes ends
    it, unless `isolate` is true or the scenario says so. Of several threads one at a time gets its turn.
    """

    def __init__(
        self,
        scenario: str | os.PathLike[str],
        *,
        set: Mapping[str, object] | Sequence[str] | None = None,
        seed: int | None = None,
        tunable: Iterable[str] = (),
        isolate: bool = False,
        log: bool = False,
    ) -> None:
        """Prepare a scenario; its checks, analyses and recordings are for `trackside.run`.

        Args:
            scenario: the file, or the name of a scenario that comes with the program, such as `step_steer`.
            set: values instead of the scenario's, `{"plant.body.m": 800.0, "plant.start.v_x": "100 km/h"}`, or words of `--set`.
            seed: the seed of every random stream, instead of the scenario's.
            tunable: tunable parameters to be set between two steps; the others are set before the first one.
            isolate: run all FMUs in processes of their own, where a crash is an error and no more. A step takes longer by two
                changes of process for each FMU.
            log: log all that FMUs have to say, not their warnings alone.

        Raises:
            InputError: when the scenario or an argument is wrong.
        """
        folder = Path(tempfile.mkdtemp(prefix="trackside-session-"))
        remove = weakref.finalize(self, _remove, str(folder), os.getpid())
        words = ["session", os.fspath(find(scenario)), "--out", os.fspath(folder), *settings(set, seed)]
        for name in [tunable] if isinstance(tunable, str) else tunable:
            words += ["--tunable", name]
        words += ["--isolate"] if isolate else []
        words += ["--library", _LIBRARIES[-1]] if _LIBRARIES else []
        self._scenario = os.fspath(scenario)
        self._native: _Native | None = None
        try:
            ended = call(words)
            _judged(ended)
            about = json.loads(ended.stdout)
            native = _Native(about, folder, log)
        except BaseException:
            remove()
            raise
        # From here on the files go when the instance has gone.
        remove.detach()
        for line in ended.stderr.strip().splitlines():
            level = logging.WARNING if line.startswith("warning: ") else logging.INFO
            LOGGER.log(level, "%s", line.removeprefix("warning: "))
        self._native = native
        self._lock = threading.RLock()
        self.title: str = about["title"]
        #: The communication step [s].
        self.step_size: float = about["step"]
        #: Begin and end of the scenario [s]; a session may go on after the end.
        self.start_time: float = about["start"]
        self.stop_time: float = about["stop"]
        self._can_save = (about["state"], about["serialized_state"])
        fields = Variable.__dataclass_fields__
        #: The variables by name.
        self.variables: dict[str, Variable] = {
            entry["name"]: Variable(**{field: entry[field] for field in fields}) for entry in about["variables"]
        }
        self._places = {entry["name"]: (place, entry["access"]) for place, entry in enumerate(about["variables"])}
        self._readers: dict[str, Callable[[], Any]] = {}
        self._writers: dict[str, Callable[[Any], None]] = {}
        self._controllers: list[_Attached] = []
        self._traces: list[Trace] = []
        self._tick = 0
        self._initialised = False
        self._failure: str | None = None
        #: Why a node ended the run; None while it goes on.
        self.ended: str | None = None
        self._time, self._size = ctypes.c_double(), ctypes.c_double()
        self._flags = (ctypes.c_bool * 3)()
        self._reached = ctypes.c_double()
        flags = [ctypes.byref(self._flags, place) for place in range(3)]
        arguments = (native.instance, self._time, self._size, ctypes.c_bool(False), *flags, ctypes.byref(self._reached))
        self._do_step = partial(native.function("DoStep"), *arguments)
        self._enter_initialisation()

    # Values

    def __getitem__(self, name: str) -> Any:
        """Read a variable, in its unit.

        Raises:
            KeyError: when there is none of this name; with the one that may be meant.
        """
        return (self._readers.get(name) or self._reader(name))()

    def __setitem__(self, name: str, value: Number | str) -> None:
        """Set a variable, in its unit: it keeps the value until it is set again or released.

        An input without a connection, a signal, and before the first step a parameter have it at once; a connected input has it in
        the next step, instead of what the connection brings.

        Raises:
            KeyError: when there is none of this name; with the one that may be meant.
            InputError: when it cannot be set, or not to this value.
        """
        (self._writers.get(name) or self._writer(name))(value)

    def release(self, name: str) -> None:
        """Give a variable back to the scenario, from the next step on: to its connection, or its signal.

        Raises:
            KeyError: when there is none of this name.
            InputError: when the scenario has no value for it.
        """
        if self._variable(name).role != "override":
            raise InputError(f"expected a connected input or a signal, found `{name}`, for which the scenario has no other value")
        self._raw_writer(name)(math.nan)

    def get(self, names: Iterable[str]) -> list[Any]:
        """Read variables, in the order of the names.

        Raises:
            KeyError: when there is none of a name.
        """
        return [self[name] for name in names]

    def set(self, values: Mapping[str, Number | str]) -> None:
        """Set variables.

        Raises:
            KeyError: when there is none of a name.
            InputError: when one cannot be set.
        """
        for name, value in values.items():
            self[name] = value

    def names(self, pattern: str = "*") -> list[str]:
        """Return the names of all variables, or of those that fit a pattern such as `plant.*`."""
        return [name for name in self.variables if pattern == "*" or fnmatchcase(name, pattern)]

    def unit(self, name: str) -> str | None:
        """Return the unit of a variable; None without one.

        Raises:
            KeyError: when there is none of this name.
        """
        return self._variable(name).unit

    # Time

    @property
    def time(self) -> float:
        """The time of the last communication point [s], to the nanosecond as recordings have it."""
        return round(self.start_time + self._tick * self.step_size, 9)

    def initialise(self) -> None:
        """End the initialisation, as the first step does by itself: parameters keep their values from here on.

        Raises:
            FmuError: when an FMU refuses its start values.
        """
        with self._lock:
            if not self._initialised:
                self._checked(self._function("ExitInitializationMode"))
                self._initialised = True
                for trace in self._traces:
                    trace._take(self._tick, self.time)

    def step(self, n: int = 1) -> None:
        """Go on by `n` communication steps. Controllers are called before each of them.

        A node that ends the run as planned ends it in the midst of them: see `ended`.

        Raises:
            FmuError: when an FMU fails, with node, call and time. The session goes on after `restore` or `reset`.
        """
        if n < 1 or n != int(n):
            raise InputError(f"expected a number of steps, found {n!r}")
        with self._lock:
            if not self._initialised:
                self.initialise()
            if self.ended is not None:
                raise TracksideError(f"the run has ended: {self.ended}; `restore` or `reset` go back")
            if self._controllers or self._traces:
                self._step_with_controllers(int(n))
                return
            left = int(n)
            while left and self.ended is None:
                count = min(left, STEPS)
                self._advance(count)
                left -= count

    def _step_with_controllers(self, count: int) -> None:
        for _ in range(count):
            tick, time = self._tick, self.time
            for attached in self._controllers:
                if tick % attached.every == 0:
                    attached.call(time)
            self._advance(1)
            if self.ended is not None:
                return
            for trace in self._traces:
                trace._take(self._tick, self.time)

    def run(self, until: float | None = None) -> None:
        """Go on to the last communication point that is not after a time [s], or to the end of the scenario.

        Raises:
            FmuError: when an FMU fails.
            InputError: when the time is over.
        """
        until = self.stop_time if until is None else until
        # A millionth of a step is rounding.
        last = math.floor((until - self.start_time) / self.step_size + 1e-6)
        if last < self._tick:
            raise InputError(f"expected a time from {self.time:g} s on, found {until:g} s; `restore` or `reset` go back")
        if last > self._tick:
            self.step(last - self._tick)

    def reset(self) -> None:
        """Go back to the beginning, before the initialisation, with the values of the scenario and of `set`. Controllers stay.

        Raises:
            FmuError: when an FMU crashed.
        """
        with self._lock:
            self._failure = self.ended = None
            self._checked(self._function("Reset"))
            self._tick, self._initialised = 0, False
            for trace in self._traces:
                trace._forget_after(-1)
            self._enter_initialisation()

    # States

    def save(self) -> State:
        """Return the state: of all FMUs, connections, effects and random streams. Before the first step it ends the initialisation.

        Raises:
            TracksideError: when an FMU cannot save its state.
        """
        if not self._can_save[0]:
            raise TracksideError("an FMU of the scenario cannot save its state: see `trackside inspect`")
        with self._lock:
            self.initialise()
            pointer = ctypes.c_void_p()
            self._checked(partial(self._function("GetFMUState"), ctypes.byref(pointer)))
            controllers = [copy.deepcopy(attached.saved()) for attached in self._controllers]
            return State(self._alive(), pointer, self._tick, controllers)

    def restore(self, state: State) -> None:
        """Go back, or forth, to a state of this session.

        Raises:
            InputError: when the state is that of another session.
            TracksideError: when an FMU cannot go back.
        """
        native = self._alive()
        if state._native is not native:
            raise InputError("expected a state of this session, found one of another session: `to_bytes` and `from_bytes` carry it over")
        with self._lock:
            self._failure = self.ended = None
            self._checked(partial(self._function("SetFMUState"), state._pointer))
            self._tick, self._initialised = state._tick, True
            for attached, saved in zip(self._controllers, state._controllers):
                attached.restore(copy.deepcopy(saved))
            for trace in self._traces:
                trace._forget_after(self._tick)

    def to_bytes(self, state: State) -> bytes:
        """Return a state as bytes, which sessions of the same scenario and values take, also in other processes. Controllers are not in it.

        Raises:
            TracksideError: when an FMU cannot write its state so.
        """
        if not self._can_save[1]:
            raise TracksideError("an FMU of the scenario cannot write its state as bytes: see `trackside inspect`")
        size = ctypes.c_size_t()
        self._checked(partial(self._function("SerializedFMUStateSize"), state._pointer, ctypes.byref(size)))
        room = (ctypes.c_uint8 * size.value)()
        self._checked(partial(self._function("SerializeFMUState"), state._pointer, room, size))
        return state._tick.to_bytes(8, "little") + bytes(room)

    def from_bytes(self, data: bytes) -> State:
        """Return the state of bytes that `to_bytes` gave.

        Raises:
            TracksideError: when they are those of another scenario.
        """
        self.initialise()
        tick, rest = int.from_bytes(data[:8], "little"), data[8:]
        pointer, room = ctypes.c_void_p(), (ctypes.c_uint8 * len(rest)).from_buffer_copy(rest)
        arguments = (room, ctypes.c_size_t(len(rest)), ctypes.byref(pointer))
        self._checked(partial(self._function("DeserializeFMUState"), *arguments))
        return State(self._alive(), pointer, tick, [])

    # Controllers and recordings

    def attach(
        self,
        controller: Controller | fmu.Model,
        inputs: Sequence[str] | Mapping[str, str] | str,
        outputs: Sequence[str] | Mapping[str, str] | str,
        every: int = 1,
    ) -> None:
        """Let Python steer: before each step the controller reads inputs and sets outputs, which last until it is called again.

        Args:
            controller: a function, called with the time [s] and the values of `inputs`, that returns that of the only output or as
                many as there are outputs. Or an object of a `trackside.fmu.Model`, as it may be packed later.
            inputs: the variables of the session that it reads; of a model, `{"its input": "node.variable"}`.
            outputs: the variables that it sets; of a model, `{"its output": "node.variable"}`.
            every: communication steps between two calls.

        Raises:
            KeyError: when there is no variable of a name.
            InputError: when an output cannot be set.
        """
        if every < 1 or every != int(every):
            raise InputError(f"expected a number of steps in `every`, found {every!r}")
        kind = _AttachedModel if isinstance(controller, fmu.Model) else _AttachedFunction
        self._controllers.append(kind(self, controller, inputs, outputs, int(every)))

    def detach(self, controller: Controller | fmu.Model) -> None:
        """Call a controller no more, and release its outputs.

        Raises:
            InputError: when it is not attached.
        """
        found = [attached for attached in self._controllers if attached.controller is controller]
        if not found:
            raise InputError(f"expected an attached controller, found {controller!r}")
        for attached in found:
            self._controllers.remove(attached)
            for name in attached.outputs:
                if self.variables[name].role == "override":
                    self.release(name)

    def record(self, names: Iterable[str] | str = "*", every: int = 1) -> Trace:
        """Take values from here on, at this and each later communication point, or every so many of them.

        Args:
            names: names such as `plant.r`, or patterns such as `plant.*`. Texts are left out.
            every: communication steps between two values.

        Raises:
            KeyError: when a name or a pattern fits no variable.
        """
        chosen: list[str] = []
        for pattern in [names] if isinstance(names, str) else names:
            found = [pattern] if pattern in self.variables else self.names(pattern)
            if not found:
                raise KeyError(self._unknown(pattern))
            chosen += [name for name in found if name not in chosen and self.variables[name].kind != "string"]
        trace = Trace(self, chosen, every)
        if self._initialised:
            trace._take(self._tick, self.time)
        self._traces.append(trace)
        return trace

    # Ends

    def close(self) -> None:
        """End the session, and free its FMUs and files. Closing again does nothing."""
        with self._lock:
            native, self._native = self._native, None
            if native is not None:
                if self._initialised and self._failure is None and self.ended is None:
                    native.function("Terminate")(native.instance)
                native.close()

    def __enter__(self) -> Session:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def __repr__(self) -> str:
        state = f"{self.time:g} s" if self._native is not None else "closed"
        return f"<Session {self._scenario}: {state}, {len(self.variables)} variables>"

    def _repr_html_(self) -> str:
        head = f"<h4>{html.escape(self.title)}: {html.escape(repr(self).split(': ', 1)[1].rstrip('>'))}</h4>"
        if self._native is None or self._failure is not None:
            return head
        order = {"input": 0, "override": 1, "output": 2, "parameter": 3}
        shown = sorted(self.variables.values(), key=lambda it: order[it.role])[:SHOWN]
        rows = "".join(
            f'<tr><td style="text-align:left">{html.escape(it.name)}</td><td>{html.escape(_shown(self[it.name]))}</td>'
            f"<td>{html.escape(it.unit or '')}</td><td>{it.role}</td></tr>"
            for it in shown
        )
        more = len(self.variables) - len(shown)
        return f"{head}<table><tr><th>variable</th><th>value</th><th>unit</th><th></th></tr>{rows}</table>" + (
            f"<p>and {more} more: <code>.names()</code></p>" if more else ""
        )

    # The library

    def _alive(self) -> _Native:
        if self._native is None:
            raise TracksideError("the session is closed")
        return self._native

    def _function(self, name: str) -> Callable[..., int]:
        native = self._alive()
        return partial(native.function(name), native.instance)

    def _enter_initialisation(self) -> None:
        no, zero = ctypes.c_bool(False), ctypes.c_double(0.0)
        enter = self._function("EnterInitializationMode")
        self._checked(partial(enter, no, zero, ctypes.c_double(self.start_time), no, zero))

    def _advance(self, count: int) -> None:
        """Go on by steps that nothing comes in between of."""
        self._time.value = self.start_time + self._tick * self.step_size
        self._size.value = count * self.step_size
        status = self._do_step() if self._native is not None and self._failure is None else FAILED
        if status == _OK and not self._flags[1]:
            self._tick += count
            return
        if self._native is not None and self._failure is None:
            self._tick = round((self._reached.value - self.start_time) / self.step_size)
        self._judge(status, bool(self._flags[1]))

    def _checked(self, function: Callable[[], int]) -> None:
        with self._lock:
            status = function()
            if status != _OK:
                self._judge(status)
            elif self._native is not None and self._native.messages:
                self._tell()

    def _judge(self, status: int, ended: bool = False) -> None:
        """Raise what a call that did not simply succeed has to say, or note that a node `ended` the run."""
        messages = self._alive().messages
        if self._failure is not None and not messages:
            raise TracksideError(f"the session has failed: {self._failure}; `restore` or `reset` go back")
        errors = [text for level, text in messages if level >= FAILED]
        if status < FAILED and not ended:
            self._tell()
            return
        messages[:] = [entry for entry in messages if entry[0] < FAILED]
        self._tell()
        text = "\n".join(errors) or "the call failed, and nothing says why"
        if ended and status < FAILED:
            self.ended = text
            LOGGER.info("%s", text)
            return
        found = _FAILURE.search(text)
        if found is None:
            raise TracksideError(text)
        self._failure = text
        raise FmuError(text, node=found["node"], time=float(found["time"]) if found["time"] else self.time)

    def _tell(self) -> None:
        """Hand messages to Python's log."""
        messages = self._alive().messages
        taken = list(messages)
        messages.clear()
        for status, text in taken:
            LOGGER.log(logging.INFO if status == _OK else logging.WARNING, "%s", text)

    def _variable(self, name: str) -> Variable:
        try:
            return self.variables[name]
        except KeyError:
            raise KeyError(self._unknown(name)) from None

    def _unknown(self, name: str) -> str:
        node, last = str(name).partition(".")[0], str(name).rpartition(".")[2]
        same = [it for it in self.variables if it.rpartition(".")[2] == last]
        near = difflib.get_close_matches(str(name), same or self.variables, n=1, cutoff=0.7)
        own = any(it.startswith(f"{node}.") for it in self.variables)
        help = f"did you mean `{near[0]}`?" if near else f"`names({node + '.*' if own else ''!r})` lists them" if own else "`names()` lists them"
        return f"no variable `{name}`; {help}"

    def _reader(self, name: str) -> Callable[[], Any]:
        """The function that reads a variable, made once."""
        found = self._readers.get(name)
        if found is not None:
            return found
        kind = self._variable(name).kind
        place, access = self._places[name]
        native = self._alive()
        cell = _CELLS[access]()
        arguments = (ctypes.byref(ctypes.c_uint32(place)), _ONE, ctypes.byref(cell), _ONE)
        function = partial(native.function(f"Get{_CALLS[access]}"), native.instance, *arguments)
        convert = {"integer": int, "boolean": bool, "string": lambda text: (text or b"").decode(errors="replace")}.get(kind)
        lock, session = self._lock, weakref.ref(self)

        def read() -> Any:
            with lock:
                status = function() if native.free.alive else FAILED
                if status:
                    session()._judge(status)  # type: ignore[union-attr]
            return cell.value if convert is None else convert(cell.value)

        self._readers[name] = read
        return read

    def _writer(self, name: str) -> Callable[[Any], None]:
        """The function that sets a variable, made once."""
        variable = self._variable(name)
        if variable.role == "output":
            raise InputError(_not_settable(self, variable))
        write, kind, session = self._raw_writer(name), variable.kind, weakref.ref(self)
        is_parameter, is_int = variable.role == "parameter", self._places[name][1] in ("integer", "boolean")

        def check_and_write(value: Any) -> None:
            if is_parameter and session()._initialised:  # type: ignore[union-attr]
                raise InputError(
                    f"`{name}` is a parameter, which is set before the first step: after `reset`, or by Session(…, set={{{name!r}: …}}); "
                    "one that its FMU calls tunable also by Session(…, tunable=[…])"
                )
            number = _value(name, kind, value, variable.unit)
            write(int(number) if is_int else number)

        def write_number(value: Any) -> None:
            # The usual case without a detour.
            if type(value) is float and value == value:
                write(value)
            else:
                check_and_write(value)

        writer = write_number if kind == "real" and not is_parameter else check_and_write
        self._writers[name] = writer
        return writer

    def _raw_writer(self, name: str) -> Callable[[Any], None]:
        place, access = self._places[name]
        native = self._alive()
        cell = _CELLS[access]()
        arguments = (ctypes.byref(ctypes.c_uint32(place)), _ONE, ctypes.byref(cell), _ONE)
        function = partial(native.function(f"Set{_CALLS[access]}"), native.instance, *arguments)
        lock, session = self._lock, weakref.ref(self)

        def write(value: Any) -> None:
            with lock:
                cell.value = value
                status = function() if native.free.alive else FAILED
                if status:
                    session()._judge(status)  # type: ignore[union-attr]

        return write


#: The failure of a node, as the program words it.
_FAILURE = re.compile(r"node `(?P<node>[^`]+)`: \S+(?: at t = (?P<time>[-+0-9.e]+) s)?")


def _value(name: str, kind: str, value: Any, unit: str | None) -> Any:
    """A value as the library takes it."""
    if kind == "string":
        if isinstance(value, str) and "\0" not in value:
            return value.encode()
        raise InputError(f"expected a text for `{name}`, found {value!r}")
    wanted = {"real": f"a number{f' in {unit}' if unit else ''}", "integer": "an integer", "boolean": "True or False"}[kind]
    try:
        number = float(value) if not isinstance(value, (str, bytes)) else math.nan
    except (TypeError, ValueError):
        number = math.nan
    fits = number == number and (kind == "real" or number == math.floor(number)) and (kind != "boolean" or number in (0.0, 1.0))
    if not fits:
        raise InputError(f"expected {wanted} for `{name}`, found {value!r}")
    return number


def _not_settable(session: Session, variable: Variable) -> str:
    node = variable.name.partition(".")[0]
    own = [it.name for it in session.variables.values() if it.role in ("input", "override") and it.name.startswith(f"{node}.")]
    inputs = f": its inputs are {', '.join(own[:8])}" if own else ""
    return f"`{variable.name}` is what `{node}` calculates, and cannot be set{inputs}"


def _shown(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


class _Attached:
    """A controller with what it reads and sets."""

    outputs: list[str]

    def __init__(self, controller: Any, every: int) -> None:
        self.controller, self.every = controller, every

    def call(self, time: float) -> None:
        """Read, calculate, set."""
        raise NotImplementedError

    def saved(self) -> Any:
        """What it goes on from, if it says so."""
        controller = self.controller
        return controller.save() if hasattr(controller, "save") and hasattr(controller, "restore") else None

    def restore(self, saved: Any) -> None:
        """Go on from there."""
        if hasattr(self.controller, "save") and hasattr(self.controller, "restore"):
            self.controller.restore(saved)


class _AttachedFunction(_Attached):
    """A function of the time and its inputs."""

    def __init__(self, session: Session, controller: Any, inputs: Any, outputs: Any, every: int) -> None:
        super().__init__(controller, every)
        if not callable(controller):
            raise InputError(f"expected a function or a trackside.fmu.Model, found {controller!r}")
        if isinstance(inputs, Mapping) or isinstance(outputs, Mapping):
            raise InputError("expected lists of names; a mapping is for a trackside.fmu.Model")
        inputs, self.outputs = [[names] if isinstance(names, str) else list(names) for names in (inputs, outputs)]
        self.read = [session._reader(name) for name in inputs]
        self.write = [session._writers.get(name) or session._writer(name) for name in self.outputs]

    def call(self, time: float) -> None:
        values = self.controller(time, *[read() for read in self.read])
        write = self.write
        if len(write) == 1 and not isinstance(values, (list, tuple)):
            write[0](values)
            return
        values = [] if values is None and not write else values
        try:
            found = len(values)
        except TypeError:
            found = -1
        if found != len(write):
            wanted = f"{len(write)} values for {', '.join(self.outputs)}" if write else "no value"
            raise InputError(f"expected {wanted} from the controller {self.controller!r}, found {values!r}")
        for set_value, value in zip(write, values):
            set_value(value)


class _AttachedModel(_Attached):
    """A model that could be an FMU."""

    def __init__(self, session: Session, model: fmu.Model, inputs: Any, outputs: Any, every: int) -> None:
        super().__init__(model, every)
        if not (isinstance(inputs, Mapping) and isinstance(outputs, Mapping)):
            raise InputError('expected {"variable of the model": "node.variable"}, found a list of names')
        own = {variable.name: variable for variable in fmu.variables(type(model))}
        for given, causality in ((inputs, "input"), (outputs, "output")):
            for name in given:
                if name not in own or own[name].causality != causality:
                    known = ", ".join(it.name for it in own.values() if it.causality == causality) or "none"
                    raise KeyError(f"{type(model).__name__} has no {causality} `{name}`; its {causality}s: {known}")
        self.outputs = list(outputs.values())
        self.read = [(own[name].attribute, session._reader(it)) for name, it in inputs.items()]
        self.write = [(own[name].attribute, session._writers.get(it) or session._writer(it)) for name, it in outputs.items()]
        self.size = session.step_size * every
        self.initialised = False

    def call(self, time: float) -> None:
        model = self.controller
        for attribute, read in self.read:
            setattr(model, attribute, read())
        model.time = time
        if not self.initialised:
            model.initialise()
            self.initialised = True
        model.step(time, self.size)
        model.time = time + self.size
        model.outputs()
        for attribute, write in self.write:
            write(getattr(model, attribute))
