"""Step scenarios from Python: session.py TEST[+TEST...] FOLDER."""

import csv
import gc
import logging
import math
import os
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

tests, folder = sys.argv[1:]
os.environ.pop("LD_LIBRARY_PATH", None)
os.chdir(folder)
tempfile.tempdir = folder

import trackside  # noqa: E402
from trackside.fmu import Model, input, output  # noqa: E402


def raised(kind, call):
    """Insist on an exception; return it."""
    try:
        call()
    except kind as error:
        return error
    raise AssertionError(f"expected {kind.__name__}")


def folders():
    """The folders of sessions that are there."""
    return sorted(Path(folder).glob("trackside-session-*"))


def values():
    """Set and read variables of all roles, and wrong ones."""
    with trackside.Session("step_steer.toml", set={"plant.body.m": 1200.0, "plant.start.v_x": "90 km/h"}) as s:
        assert (s.time, s.step_size, s.stop_time) == (0.0, 0.01, 4.0) and "Step steer" in s.title
        assert s["plant.body.m"] == 1200.0 and s["plant.v_x"] == 25.0 and s.unit("plant.r") == "rad/s"
        assert {"plant.r", "plant.delta", "driver.delta"} <= set(s.names()) and s.names("driver.*") == ["driver.delta"]
        assert (s.variables["plant.delta"].role, s.variables["plant.F_x"].role) == ("override", "input")
        assert s.variables["plant.r"].description and s.variables["plant.body.m"].role == "parameter"
        # Until the first step parameters count from the beginning.
        s["plant.start.v_x"] = 20
        assert s["plant.v_x"] == 20.0
        s["plant.F_x"] = 500.0
        s["plant.delta"] = 0.02
        s.step()
        assert (s.time, s["plant.delta"], s["plant.F_x"]) == (0.01, 0.02, 500.0) and s["plant.r"] > 0.0
        assert s.get(["plant.delta", "driver.delta"]) == [0.02, 0.0]
        s.step(99)
        s.run(until=1.5)
        assert s.time == 1.5 and s["plant.delta"] == 0.02 and s["driver.delta"] == 1.5
        # A connected input goes back to its connection, a signal to its shape.
        s.set({"driver.delta": 3.0})
        s.release("plant.delta")
        s.step()
        assert math.isclose(s["plant.delta"], math.radians(3.0)), s["plant.delta"]
        s.release("driver.delta")
        s.step(2)
        assert s["driver.delta"] == 1.5 and math.isclose(s["plant.delta"], math.radians(1.5))
        for name, says in [("plant.m", "did you mean `plant.body.m`?"), ("plant.delt", "`plant.delta`"), ("nobody.q", "`names()`")]:
            for use in (lambda: s[name], lambda: s.__setitem__(name, 1.0), lambda: s.unit(name), lambda: s.release(name)):
                assert says in str(raised(KeyError, use)), name
        for name, value, says in [
            ("plant.r", 1.0, "cannot be set: its inputs are plant.F_x"),
            ("plant.body.m", 900.0, "tunable"),
            ("plant.delta", "2 deg", "a number in rad"),
            ("plant.delta", math.nan, "a number in rad"),
        ]:
            assert says in str(raised(trackside.InputError, lambda: s.__setitem__(name, value))), name
        assert "plant.F_x" in str(raised(trackside.InputError, lambda: s.release("plant.F_x")))
        assert "1 s" in str(raised(trackside.InputError, lambda: s.run(until=1.0)))
        raised(trackside.InputError, lambda: s.step(0))
        html = s._repr_html_()
        assert "plant.F_x" in html and "more" in html and "1.53 s" in repr(s), html
    assert "closed" in str(raised(trackside.TracksideError, lambda: s["plant.r"]))
    assert "closed" in str(raised(trackside.TracksideError, s.step)) and "closed" in repr(s)
    s.close()
    mistake = raised(trackside.InputError, lambda: trackside.Session("step_steer.toml", set={"plant.body.mm": 1.0}))
    assert "did you mean `body.m`?" in str(mistake) and not folders(), folders()
    assert "--tunable" in str(raised(trackside.InputError, lambda: trackside.Session("step_steer.toml", tunable=["plant.body.h"])))


def equal_to_runs():
    """Without a word from Python a session has the bits of the run: with noise, loops, and several FMUs."""
    for name, seed in [("step_steer", None), ("double_lane_change", 7)]:
        words = [] if seed is None else ["--seed", str(seed)]
        run = [trackside.program(), "run", f"{name}.toml", "--csv", "--rerun", "off", "--out", name, *words]
        subprocess.run(run, check=True, stdout=subprocess.DEVNULL)
        with open(f"{name}/run.csv", newline="") as file:
            titles, *rows = csv.reader(file)
        names = [title.partition(" [")[0] for title in titles][1:]
        with trackside.Session(f"{name}.toml", seed=seed) as s:
            assert set(names) <= set(s.names()), set(names) - set(s.names())
            trace = s.record(names)
            s.run()
            found = trace.arrow().to_pydict()
            for place, column in enumerate(names, 1):
                wanted = [float(row[place]) for row in rows]
                # Before the first step connected inputs have no effects yet, in a session as in a run.
                assert found[column] == wanted, (name, column)
            assert len(trace) == len(rows) and trace.frame().attrs["units"]["plant.r"] == "rad/s"


def states():
    """Go back with noise and overrides, in this session and through bytes in another one."""
    with trackside.Session("double_lane_change.toml") as s, trackside.Session("double_lane_change.toml") as other:
        s.run(2.5)
        s["controller.v_ref"] = 20.0
        s.step()
        state = s.save()
        trace = s.record("estimator.*", every=10)
        s.step(100)
        first = s.get(s.names("*.v_x*"))
        s.release("controller.v_ref")
        s.step(5)
        s.restore(state)
        assert s.time == 2.51 and len(trace) == 0, (s._tick, trace._ticks)
        assert s["controller.v_ref"] == 20.0
        s.step(100)
        assert s.get(s.names("*.v_x*")) == first
        other.restore(other.from_bytes(s.to_bytes(state)))
        assert other.time == 2.51
        other.step(100)
        assert other.get(s.names("*.v_x*")) == first
        assert "another session" in str(raised(trackside.InputError, lambda: other.restore(state)))
        raised(trackside.TracksideError, lambda: other.from_bytes(b"12345678nothing"))
        other.reset()
        assert other.time == 0.0 and other["controller.v_ref"] != 20.0
        start = other.save()
        other.step(10)
        raised(trackside.InputError, lambda: other.__setitem__("plant.body.m", 800.0))
        other.restore(start)
        assert other.time == 0.0
    with trackside.Session("step_steer.toml") as s:
        raised(trackside.TracksideError, lambda: s.from_bytes(s.save()._tick.to_bytes(8, "little")))


class Damper(Model):
    """Steers against the yaw rate, with a memory."""

    r = input(0.0, unit="rad/s")
    delta = output(unit="rad")

    def initialise(self):
        self.sum = 0.0

    def step(self, t, h):
        self.sum += self.r * h
        self.delta = 0.02 - 0.1 * self.r - 0.01 * self.sum


def controllers():
    """Functions and models steer, in time, and go back with states."""
    with trackside.Session("step_steer.toml") as s:
        calls = []

        def damp(time, r, v_x):
            calls.append(time)
            return 0.02 - 0.1 * r

        s.attach(damp, inputs=["plant.r", "plant.v_x"], outputs="plant.delta", every=5)
        s.step(11)
        assert calls == [0.0, 0.05, 0.1], calls
        s.detach(damp)
        s.step()
        assert s["plant.delta"] == 0.0 and len(calls) == 3
        assert "attached" in str(raised(trackside.InputError, lambda: s.detach(damp)))
        s.reset()
        model = Damper()
        s.attach(model, inputs={"r": "plant.r"}, outputs={"delta": "plant.delta"})
        s.step(50)
        state = s.save()
        s.step(50)
        values, memory = s.get(["plant.r", "plant.delta"]), model.sum
        s.restore(state)
        assert model.sum != memory
        s.step(50)
        assert s.get(["plant.r", "plant.delta"]) == values and model.sum == memory
        s.detach(model)
        assert "its inputs: r" in str(raised(KeyError, lambda: s.attach(model, inputs={"q": "plant.r"}, outputs={})))
        raised(KeyError, lambda: s.attach(damp, inputs=["plant.rr"], outputs=[]))
        raised(trackside.InputError, lambda: s.attach(damp, inputs=[], outputs=["plant.r"]))
        s.attach(lambda time: (1.0, 2.0), inputs=[], outputs=["plant.delta"])
        assert "1 values for plant.delta" in str(raised(trackside.InputError, s.step))


def lives():
    """Several sessions at once, threads, messages, and what is forgotten is freed."""
    sessions = [trackside.Session("step_steer.toml", set={"plant.body.m": m}) for m in (700.0, 900.0)]
    for s in sessions:
        s["plant.delta"] = 0.02
    workers = [threading.Thread(target=s.step, args=(300,)) for s in sessions for _ in range(2)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert [s.time for s in sessions] == [6.0, 6.0] and sessions[0]["plant.r"] != sessions[1]["plant.r"]
    assert len(folders()) == 2
    state = sessions[0].save()
    del s, workers, worker
    sessions.clear()
    gc.collect()
    # A state keeps what it is a state of.
    assert len(folders()) == 1, folders()
    del state
    gc.collect()
    assert not folders(), folders()
    heard = []
    handler = logging.Handler()
    handler.emit = lambda record: heard.append((record.levelname, record.getMessage()))
    logging.getLogger("trackside.session").addHandler(handler)
    with trackside.Session("step_steer.toml", set={"plant.body.m": 90000.0}) as s:
        s.step()
        s["plant.r"]
    assert any(level == "WARNING" and "body.m" in text for level, text in heard), heard


def failures():
    """The failure of an FMU is an exception with node and time; a run that a node ends is none."""
    with trackside.Session("case.toml") as s:
        error = raised(trackside.FmuError, lambda: s.step(100))
        assert (error.node, error.time) == ("tank", 0.5) and "tank" in str(error), error
        assert s.time == 0.4, s.time
        assert "has failed" in str(raised(trackside.TracksideError, s.step))
        s.reset()
        s.step(3)
        assert s.time == 0.3
    # A crash in a process of its own leaves this one alone.
    with trackside.Session("crash.toml", isolate=True) as s:
        error = raised(trackside.FmuError, lambda: s.step(100))
        assert error.node == "tank" and "SIGSEGV" in str(error), error
        s.reset()
        s.step(2)
    with trackside.Session("ends.toml") as s:
        s.run()
        assert "odd" in s.ended and s.time < s.stop_time, (s.ended, s.time)
        assert "has ended" in str(raised(trackside.TracksideError, s.step))
        s.reset()
        assert s.ended is None


def kinds():
    """Integers, truth values and texts; an FMU by itself; a Python FMU inside; tunable parameters."""
    with trackside.Session("odd.fmu") as s:
        s["odd.how"] = "well"
        s.set({"odd.u": 0.5, "odd.n": 4, "odd.on": True})
        s.step()
        assert (s["odd.n_out"], s["odd.on_out"], s["odd.how"]) == (8, False, "well"), s.get(s.names())
        assert type(s["odd.n_out"]) is int and type(s["odd.on_out"]) is bool
        for name, value in [("odd.n", 0.5), ("odd.on", 2), ("odd.on", "yes")]:
            raised(trackside.InputError, lambda: s.__setitem__(name, value))
    with trackside.Session("relays.toml") as s:
        s.step()
        assert (s["drive.n"], s["a.n"], s["a.n_out"], s["b.n"]) == (4, 4, 4, 4)
        s["drive.n"] = 6
        s["b.n"] = 9
        s.set({"a.on": True, "b.mode": 4})
        s.step()
        assert (s["drive.n"], s["a.n_out"], s["b.n_out"], s["a.on_out"], s["b.mode_out"]) == (6, 6, 9, True, 4)
        s.release("b.n")
        s.step()
        assert s["b.n_out"] == 6 and s["a.text_out"] == ""
    with trackside.Session("step_steer.toml", tunable=["plant.tire_f.B"]) as s:
        s["plant.delta"] = 0.02
        s.run(2.0)
        stiffness, r = s["plant.tire_f.B"], s["plant.r"]
        s["plant.tire_f.B"] = 0.5 * stiffness
        s.run(3.0)
        assert s["plant.tire_f.B"] == 0.5 * stiffness and s["plant.r"] < 0.9 * r, (r, s["plant.r"])


def environments():
    """The example drives its episode twice with the same rewards."""
    sys.path.insert(0, str(Path(trackside.__file__).parents[2] / "examples/python"))
    import environment

    lane = environment.LaneChange("step_steer.toml")
    total, info = environment.drive(lane)
    assert abs(info["Y"] - 3.5) < 0.1 and environment.drive(lane) == (total, info), info
    lane.close()


for test in tests.split("+"):
    globals()[test]()
