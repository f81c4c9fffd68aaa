"""Models in Python that `trackside pack --python` makes FMUs of.

A model is a class. Its variables are attributes of the class; its methods read and set them as attributes of the object:

    from trackside.fmu import Model, input, output, parameter

    class Cruise(Model):
        "Holds a speed."

        k = parameter(500.0, unit="N.s/m", doc="Gain")
        v = input(0.0, unit="m/s", doc="Speed")
        F = output(unit="N", doc="Force")

        def step(self, t, h):
            self.F = self.k * (20.0 - self.v)

The methods of a model, all optional:

`initialise(self)`
    begins a run, with the start values in the attributes. It may come again with others, then on a new object.
`step(self, t, h)`
    goes from the time `t` to `t + h` [s]; inputs keep their values meanwhile.
`outputs(self)`
    computes outputs from inputs without a step in between; it comes after `initialise` and `step`, and when an output is
    read after an input was written. Without it outputs change in steps only.
`terminate(self)`
    ends a run.
`save(self)`, `restore(self, state)`
    copy all that the model goes on from. Without them that is every attribute of the object, pickled.

`self.time` is the time [s] at the beginning of a call. This file needs nothing but Python's standard library.
It is also the program that runs in the process of such an FMU: it answers one question after the other, a question and
an answer being a length (4 bytes), a number (1 byte) and contents.
"""

import builtins
import faulthandler
import importlib.util
import json
import math
import operator
import os
import pickle
import select
import signal
import struct
import sys
import threading
import time
import traceback
import types

__all__ = ["Model", "Terminate", "input", "local", "output", "parameter"]

_KINDS = {float: "real", int: "integer", bool: "boolean", str: "string"}
_ZEROS = {"real": 0.0, "integer": 0, "boolean": False, "string": ""}
# Time for a script to end by itself once nobody asks any more [s].
_GRACE = 2.0


class Terminate(Exception):
    """Ends the simulation as planned, when a step raises it."""


class Variable:
    """A variable of a model; `input`, `output`, `parameter` and `local` make them."""

    def __init__(self, causality, start, *, unit="", doc="", name=None, type=None, min=None, max=None, nominal=None,
                 display_unit=None, tunable=False, discrete=False, depends=None):
        given = builtins.type(start) if start is not None else float
        kind = type or given
        if kind not in _KINDS:
            raise TypeError(f"expected a start value of type float, int, bool or str, found {start!r}")
        self.kind = _KINDS[kind]
        if start is None:
            start = _ZEROS[self.kind]
        elif type is not None and (type is float and given in (float, int) or type is given):
            start = type(start)
        elif type is not None:
            raise TypeError(f"expected a start value of type {type.__name__}, found {start!r}")
        if unit and self.kind != "real":
            raise TypeError(f"only real variables have a unit: write {float(start) if self.kind == 'integer' else 0.0} "
                            f"instead of {start!r}, or type=float")
        self.causality, self.start, self.unit, self.doc, self.name = causality, start, unit, doc, name
        self.min, self.max, self.nominal, self.display_unit = min, max, nominal, display_unit
        self.tunable, self.discrete = tunable, discrete
        self.depends = None if depends is None else list(depends)
        self.attribute = None
        # The line of the script that calls `input` or the like, which called this.
        frame = sys._getframe(2)
        self.place = [os.path.basename(frame.f_code.co_filename), frame.f_lineno]

    def __set_name__(self, owner, attribute):
        if attribute == "time":
            raise TypeError("`time` is the time of the model: give the attribute another name, and this one as name=\"time\"")
        self.attribute = attribute
        self.name = self.name or attribute

    def described(self):
        """The variable as a description has it."""
        words = ("name", "causality", "kind", "start", "unit", "doc", "min", "max", "nominal", "display_unit", "tunable",
                 "discrete", "depends", "place")
        return {word: getattr(self, word) for word in words}


def input(start=None, *, unit="", doc="", name=None, type=None, min=None, max=None, nominal=None, display_unit=None,
          discrete=False):
    """A value from outside. Its type is that of the start value; `name` may have dots: `wheel[1].speed`."""
    return Variable("input", start, unit=unit, doc=doc, name=name, type=type, min=min, max=max, nominal=nominal,
                    display_unit=display_unit, discrete=discrete)


def output(start=None, *, unit="", doc="", name=None, type=None, min=None, max=None, nominal=None, display_unit=None,
           discrete=False, depends=None):
    """A value for others. With a method `outputs` it depends on the inputs that `depends` names, or on all."""
    return Variable("output", start, unit=unit, doc=doc, name=name, type=type, min=min, max=max, nominal=nominal,
                    display_unit=display_unit, discrete=discrete, depends=depends)


def parameter(start=None, *, unit="", doc="", name=None, type=None, min=None, max=None, nominal=None,
              display_unit=None, tunable=False):
    """A value that is set before a run, or with `tunable` between two steps."""
    return Variable("parameter", start, unit=unit, doc=doc, name=name, type=type, min=min, max=max, nominal=nominal,
                    display_unit=display_unit, tunable=tunable)


def local(start=None, *, unit="", doc="", name=None, type=None, min=None, max=None, nominal=None, display_unit=None,
          discrete=False):
    """A value to look at; it cannot be connected."""
    return Variable("local", start, unit=unit, doc=doc, name=name, type=type, min=min, max=max, nominal=nominal,
                    display_unit=display_unit, discrete=discrete)


class Model:
    """A model; see the text at the top of this file."""

    #: Preferred communication step [s].
    step_size = 0.01
    #: Whether steps of any size do.
    variable_step = True
    #: How long a call may take [s].
    patience = 60.0
    #: End of the usual experiment [s].
    stop_time = None
    #: Version and author of the model.
    version = "1.0"
    author = None

    def __new__(cls, *_arguments, **_values):
        self = super().__new__(cls)
        self.__dict__.update({variable.attribute: variable.start for variable in variables(cls)}, time=0.0)
        return self

    def __init__(self, **values):
        for name, value in values.items():
            if name not in self.__dict__:
                raise TypeError(f"{type(self).__name__} has no variable `{name}`")
            setattr(self, name, value)

    def initialise(self):
        """Begins a run."""

    def step(self, t, h):
        """Goes from `t` to `t + h` [s]."""

    def outputs(self):
        """Computes outputs from inputs."""

    def terminate(self):
        """Ends a run."""

    def save(self):
        """All that the model goes on from; it is pickled."""
        return self.__dict__

    def restore(self, state):
        """Goes on from there."""
        self.__dict__.clear()
        self.__dict__.update(state)


def variables(model):
    """The variables of a class, those of its bases first."""
    found = {}
    for owner in reversed(model.__mro__):
        for name, value in vars(owner).items():
            if isinstance(value, Variable):
                found[name] = value
            elif name in found:
                raise TypeError(f"`{name}` is a variable already: give it another value by {name} = parameter(...) or the like")
    return list(found.values())


def _only_model(module, wanted):
    """The model of a script: the one that it defines, or the one with this name."""
    classes = [value for value in vars(module).values() if isinstance(value, type) and issubclass(value, Model)]
    own = {value.__name__: value for value in classes if value.__module__ == module.__name__}
    if wanted:
        own = {value.__name__: value for value in classes if value.__name__ == wanted}
    else:
        bases = {base for value in own.values() for base in value.__mro__[1:]}
        own = {name: value for name, value in own.items() if value not in bases}
    if len(own) == 1:
        return next(iter(own.values()))
    found = ", ".join(sorted(own)) or "none"
    what = f"a class `{wanted}`" if wanted else "one class"
    help = "choose one with --class" if own else "write class Controller(trackside.fmu.Model)"
    raise TypeError(f"expected {what} that is a Model, found {found}: {help}")


def _described(model):
    """What the description of an FMU says."""
    text = (model.__doc__ or "").strip().split("\n")[0]
    own = {word: getattr(model, word) for word in ("step_size", "variable_step", "patience", "stop_time", "version", "author")}
    return {
        **own, "class": model.__name__, "doc": text, "direct": model.outputs is not Model.outputs,
        "variables": [variable.described() for variable in variables(model)],
        "python": [sys.executable, sys.version.split()[0]],
    }


def _why_not_saved(model):
    """Why the state of a model cannot be copied; nothing if it can."""
    tried = model()
    try:
        tried.initialise()
        pickle.dumps(tried.save())
    except Exception as error:
        for name, value in tried.__dict__.items():
            try:
                pickle.dumps(value)
            except Exception as cause:
                return f"`{name}` cannot be pickled: {cause}"
        return f"{type(error).__name__}: {error}"
    return None


class _Packer:
    """Turns attributes of an object into bytes, and back."""

    def __init__(self, chosen):
        kinds = {kind: [it for it in chosen if it.kind == kind] for kind in _ZEROS}
        self.plain = kinds["real"] + kinds["integer"] + kinds["boolean"]
        self.texts = kinds["string"]
        self.booleans = kinds["boolean"]
        self.form = struct.Struct("<" + "d" * len(kinds["real"]) + "i" * len(kinds["integer"]) + "?" * len(self.booleans))
        names = [variable.attribute for variable in self.plain]
        self.names = names
        if len(names) == 1:
            one = operator.attrgetter(names[0])
            self.read = lambda model: (one(model),)
        else:
            self.read = operator.attrgetter(*names) if names else lambda model: ()

    def write(self, model, data, at):
        """Sets the attributes; returns where the bytes of others begin."""
        model.__dict__.update(zip(self.names, self.form.unpack_from(data, at)))
        at += self.form.size
        for variable in self.texts:
            (length,) = struct.unpack_from("<I", data, at)
            at += 4
            setattr(model, variable.attribute, data[at:at + length].decode())
            at += length
        return at

    def pack(self, model):
        """The attributes as bytes."""
        try:
            bytes_ = self.form.pack(*self.read(model))
        except Exception:
            raise TypeError(self.wrong(model)) from None
        for variable in self.booleans:
            if not _is_boolean(getattr(model, variable.attribute)):
                raise TypeError(self.wrong(model))
        for variable in self.texts:
            text = getattr(model, variable.attribute, None)
            if not isinstance(text, str) or "\0" in text:
                raise TypeError(f"expected a text without NUL in `{variable.attribute}`, found {text!r}")
            text = text.encode()
            bytes_ += struct.pack("<I", len(text)) + text
        return bytes_

    def wrong(self, model):
        """The first attribute that has another type than its variable."""
        for variable in self.plain:
            name = variable.attribute
            if not hasattr(model, name):
                return f"the attribute `{name}` is gone"
            value = getattr(model, name)
            sign = {"real": "d", "integer": "i", "boolean": "?"}[variable.kind]
            try:
                struct.pack("<" + sign, value)
            except Exception:
                pass
            else:
                if sign != "?" or _is_boolean(value):
                    continue
            word = {"real": "a number", "integer": "an integer of 32 bits", "boolean": "True or False"}[variable.kind]
            return f"expected {word} in `{name}`, found {value!r}"
        return "the attributes do not fit their variables"


def _is_boolean(value):
    return isinstance(value, bool) or type(value).__name__ in ("bool_", "bool") or type(value) is int and value in (0, 1)


class _Server:
    """Answers questions about one model."""

    def __init__(self, model):
        self.type = model
        chosen = variables(model)
        of = lambda *causalities: [it for it in chosen if it.causality in causalities]
        self.inputs, self.given, self.shown = _Packer(of("input")), _Packer(of("input", "parameter")), _Packer(of("output", "local"))
        self.direct = model.outputs is not Model.outputs
        self.model = None
        self.answers = {1: self.initialise, 2: self.step, 3: self.update, 4: self.save, 5: self.restore, 6: self.terminate}

    def show(self):
        if self.direct:
            self.model.outputs()
        return self.shown.pack(self.model)

    def initialise(self, data):
        self.model = self.type()
        (self.model.time,) = struct.unpack_from("<d", data)
        self.given.write(self.model, data, 8)
        self.model.initialise()
        return self.show()

    def step(self, data):
        t, h = struct.unpack_from("<dd", data)
        model = self.model
        self.inputs.write(model, data, 16)
        model.time = t
        model.step(t, h)
        model.time = t + h
        return self.show()

    def update(self, data):
        self.given.write(self.model, data, 0)
        return self.show()

    def save(self, _data):
        return pickle.dumps(self.model.save(), protocol=4)

    def restore(self, data):
        self.model = self.type()
        self.model.restore(pickle.loads(data))
        return b""

    def terminate(self, _data):
        if self.model is not None:
            self.model.terminate()
        return b""


class _Line:
    """The connection with the host: standard input, which the script does not get."""

    def __init__(self):
        self.file = os.dup(0)
        os.set_inheritable(self.file, False)
        nothing = os.open(os.devnull, os.O_RDWR)
        os.dup2(nothing, 0)
        os.close(nothing)
        # The terminal sends this to all processes; the host decides what becomes of this one.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        # The host asks what goes on in a call that does not return.
        faulthandler.register(signal.SIGUSR1, file=2, all_threads=False)
        threading.Thread(target=self.watch, daemon=True).start()

    def watch(self):
        """Ends the process when the host is gone, also in the midst of a call."""
        poll = select.poll()
        poll.register(self.file, 0)
        poll.poll()
        time.sleep(_GRACE)
        os._exit(0)

    def take(self):
        """The next question: its number and contents; none at the end."""
        data = os.read(self.file, 1 << 16)
        while data and (len(data) < 5 or len(data) < 5 + int.from_bytes(data[:4], "little")):
            more = os.read(self.file, 1 << 20)
            if not more:
                return None
            data += more
        return (data[4], data[5:]) if data else None

    def give(self, number, data):
        """Answers; what the script printed comes first."""
        for stream in (sys.stdout, sys.stderr):
            try:
                stream.flush()
            except Exception:
                pass
        data = len(data).to_bytes(4, "little") + bytes([number]) + data
        while data:
            data = data[os.write(self.file, data):]

    def fail(self, error, folder):
        """Answers with an error: its message, and the line of the script that it comes from."""
        if isinstance(error, Terminate):
            return self.give(2, json.dumps({"message": str(error) or "the model ended the simulation"}).encode())
        traceback.print_exception(type(error), error, error.__traceback__)
        self.give(1, json.dumps(_placed(error, folder)).encode(errors="replace"))


def _placed(error, folder):
    """The message of an exception and its place in the files of a folder."""
    message = f"{type(error).__name__}: {error}"
    if isinstance(error, SyntaxError) and error.filename:
        return {"message": f"{type(error).__name__}: {error.msg}", "file": os.path.relpath(error.filename, folder), "line": error.lineno}
    if isinstance(error, SystemExit):
        message = f"the script called exit({error.code!r})"
    runtime = os.path.dirname(os.path.realpath(__file__))
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        file = os.path.realpath(frame.filename)
        if file.startswith(os.path.realpath(folder) + os.sep) and os.path.dirname(file) != runtime:
            return {"message": message, "file": os.path.relpath(file, os.path.realpath(folder)), "line": frame.lineno, "where": frame.name}
    return {"message": message}


def _load(path, name="script"):
    """Runs a script as a module, with its folder in the search path."""
    sys.path[0] = os.path.dirname(os.path.realpath(path))
    specification = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(specification)
    sys.modules[name] = module
    specification.loader.exec_module(module)
    return module


def _appear_as(name, own):
    """Makes this file the module that scripts import, whatever else is installed."""
    package = types.ModuleType("trackside")
    package.__path__ = []
    sys.modules.setdefault("trackside", package)
    sys.modules["trackside." + name] = own
    setattr(sys.modules["trackside"], name, own)


def _finite(value):
    """JSON has no numbers that are none."""
    if isinstance(value, float) and not math.isfinite(value):
        return repr(value)
    return value


def _main(mode, path, wanted):
    """Loads a script and answers questions; `mode` is `describe` or `serve`."""
    line, folder = _Line(), os.path.dirname(os.path.realpath(path))
    _appear_as("fmu", sys.modules["__main__"])
    try:
        model = _only_model(_load(path), wanted)
        about = _described(model)
        if mode == "describe":
            about["unsaved"] = _why_not_saved(model)
        for variable in about["variables"]:
            variable["start"] = _finite(variable["start"])
        text = json.dumps(about).encode()
        server = _Server(model)
    except BaseException as error:
        return line.fail(error, folder)
    line.give(0, text)
    while True:
        question = line.take()
        if question is None:
            return None
        try:
            answer = server.answers[question[0]](question[1])
        except BaseException as error:
            line.fail(error, folder)
        else:
            line.give(0, answer)


if __name__ == "__main__":
    _main(*sys.argv[1:3], sys.argv[3] if len(sys.argv) > 3 else None)
