"""Use the Python package as its users do: package.py TEST FOLDER."""

import inspect
import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

test, folder = sys.argv[1:]
program = os.environ["TRACKSIDE_PROGRAM"]
os.environ.pop("LD_LIBRARY_PATH", None)
os.chdir(folder)

import pandas  # noqa: E402
import pyarrow  # noqa: E402
import pyarrow.parquet  # noqa: E402
import trackside  # noqa: E402


def raised(kind, call):
    """Insist on an exception; return its message."""
    try:
        call()
    except kind as error:
        return str(error)
    raise AssertionError(f"expected {kind.__name__}")


def frames():
    run = trackside.run("step_steer", set={"plant.body.m": 900.0, "plant.start.v_x": "100 km/h"}, csv=True, replay=False)
    assert run.passed and run.verdict == "pass" and all(check.passed for check in run.checks), run
    assert run.report["set"] == ["plant.body.m=900.0", "plant.start.v_x=100 km/h"], run.report["set"]
    frame = run.frame()
    table = pandas.read_csv(run.folder / "run.csv")
    table.columns = [title.split(" [")[0] for title in table.columns]
    table = table.set_index("time")
    assert (frame == table[frame.columns]).all().all() and (frame.index == table.index).all()
    assert frame.attrs["units"]["plant.v_x"] == run.units["plant.v_x"] == "m/s"
    assert list(run.frame("plant.v_?").columns) == ["plant.v_x", "plant.v_y"]
    assert run.arrow(["plant.r"]).schema.names == ["time", "plant.r"]
    assert run.polars("plant.r").columns == ["time", "plant.r"]
    assert run.signals == list(frame.columns)
    assert "did you mean plant.v_x" in raised(KeyError, lambda: run.frame("plant.vx"))
    assert run.page.exists() and run.recording.exists() and not (run.folder / "run.rrd").exists()
    first = frame["plant.v_x"].iloc[0]
    assert abs(first - 100 / 3.6) < 1e-12, first


def folders():
    first = trackside.run("step_steer", replay=False)
    second = trackside.run("step_steer", set={"driver.delta.step.after": 3.0}, replay=False)
    assert (first.folder.name, second.folder.name) == ("step_steer", "step_steer_2")
    assert not first.frame("plant.r").equals(second.frame("plant.r"))
    del first
    assert trackside.run("step_steer", replay=False).folder.name == "step_steer"


def failures():
    failed = trackside.run("step_steer", set={"plant.tire_f.D": 0.2}, replay=False)
    assert not failed.passed and failed.verdict == "fail"
    check = failed.checks[0]
    assert not check.passed and check.reason and check.margin < 0.0 and check.first is not None, check
    assert "FAILED" in failed._repr_html_()
    wrong = raised(trackside.InputError, lambda: trackside.run("step_steer", set={"plant.body.mm": 1.0}))
    assert "did you mean `body.m`?" in wrong, wrong
    assert "no_such.toml" in raised(trackside.InputError, lambda: trackside.run("no_such.toml"))
    assert "plant.body.m" in raised(trackside.InputError, lambda: trackside.run("step_steer", set={"plant.body.m": None}))
    assert "report.json" in raised(trackside.InputError, lambda: trackside.load("."))
    os.environ["TRACKSIDE_PROGRAM"] = "/nowhere/trackside"
    assert "/nowhere/trackside" in raised(trackside.TracksideError, lambda: trackside.run("step_steer"))
    os.environ["TRACKSIDE_PROGRAM"] = program


def failing_fmu():
    try:
        trackside.run("case.toml")
    except trackside.FmuError as error:
        assert "node `tank`" in str(error) and "t = 0.5 s" in str(error), error
        run = error.run
    assert run.verdict == "error" and not (run.folder / "run.parquet").exists()
    rows = run.frame()
    assert len(rows) == 5 and rows.index[-1] == 0.4, rows
    assert "node `tank`" in run._repr_html_()
    # What is wrong before the run has nothing to do with the run that is there.
    try:
        trackside.run("crash.toml", out=run.folder)
    except trackside.FmuError as error:
        assert error.run is None and error.folder == run.folder and "tank" in str(error), (error, error.run)
    else:
        raise AssertionError("expected FmuError")


def control_c():
    """Press Ctrl-C while a scenario runs, as a terminal and Jupyter do."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    text = Path("case.toml").read_text()
    assert "stop = 10000.0" in text

    def press():
        while not Path("out/run.mcap.tail").exists():
            time.sleep(0.02)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=press, daemon=True).start()
    raised(KeyboardInterrupt, lambda: trackside.run("case.toml", out="out", replay=False, arguments=["--realtime", "1"]))
    run = trackside.load("out")
    assert run.verdict == "interrupted" and not run.passed
    assert len(run.frame()) == run.report["steps"] + 1
    process = run.report["process"]
    assert not Path(f"/proc/{process}").exists(), process


def pictures():
    text = Path("case.toml").read_text()
    assert "<script>" in text
    run = trackside.run("case.toml", replay=False)
    shown = run._repr_html_()
    assert "<script>" not in shown and "&lt;script&gt;" in shown and shown.count("<svg") == len(run.plots()) > 0
    plot = run.plot(["plant.v_?"])
    assert plot.svg.count("<polyline") == 2 and plot._repr_svg_() == str(plot) == plot.svg
    import xml.etree.ElementTree as tree

    corners = [line.get("points").split() for line in tree.fromstring(plot.svg).iter("{http://www.w3.org/2000/svg}polyline")]
    assert all(len(points) > 100 for points in corners)
    places = [tuple(map(float, corner.split(","))) for points in corners for corner in points]
    assert all(0.0 <= x <= 640.0 and 0.0 <= y <= 360.0 for x, y in places)


def viewing():
    run = trackside.run("step_steer", replay=False)
    opened = Path("opened")
    browser = Path("browser")
    browser.write_text(f"#!/bin/sh\necho \"$1\" > {opened.resolve()}\n")
    browser.chmod(0o755)
    os.environ["BROWSER"] = f"{browser.resolve()} %s"
    assert run.view() == "page"
    while not (opened.exists() and opened.read_text().strip()):
        time.sleep(0.02)
    assert opened.read_text().strip() == run.page.as_uri()


def earlier_runs():
    """Read a run that the program made without Python and without Parquet."""
    subprocess.run([program, "run", trackside.scenarios()["step_steer"], "--out", "bare", "--rerun", "off"], check=True)
    assert not Path("bare/run.parquet").exists()
    run = trackside.load("bare")
    whole = trackside.run("step_steer", replay=False)
    assert run.frame().reset_index(drop=True).equals(whole.frame().reset_index(drop=True))
    assert run.units == whole.units
    csv = subprocess.run([program, "convert", "bare", "--out", "bare.csv"], check=True, capture_output=True, text=True)
    assert csv.stdout.strip() == "bare.csv" and len(pandas.read_csv("bare.csv")) == len(whole.frame())
    wrong = subprocess.run([program, "convert", "bare", "--out", "bare.xlsx"], capture_output=True, text=True)
    assert wrong.returncode == 2 and "expected a file that ends in .parquet, .csv, .mf4 or .ld" in wrong.stderr, wrong.stderr


def identification():
    run = trackside.run("limit_handling", replay=False)
    signals = ["v_x", "v_y", "r", "a_x", "a_y", "delta"]
    frame = run.frame([f"plant.{signal}" for signal in signals])
    frame.columns = signals
    car = {
        "exact": True,
        "body": {"m": 780.0, "I_zz": 1000.0, "l_f": 1.4, "l_r": 1.6, "h": 0.35},
        "aero": {"rho": 1.225, "area": 1.5, "C_d": 0.3, "C_lf": 0.0, "C_lr": 0.0},
        "drive_front_share": 0.0,
        "brake_front_share": 0.6,
    }
    config = {"methods": ["least_squares"]}
    missing = raised(trackside.InputError, lambda: trackside.identify(frame.rename_axis("time"), car=car))
    assert "`" not in missing and "v_x" in missing and "units=" in missing, missing
    frame.attrs["units"] = {signal: run.units[f"plant.{signal}"] for signal in signals}
    found = trackside.identify(frame, car=car, config=config)
    table = found.frame()
    for axle in ("front", "rear"):
        peak = table.loc["least_squares", axle, "peak"]
        assert abs(peak["value"] - 1.6) < 0.1 and peak["low"] < peak["value"] < peak["high"], peak
    assert found.page.exists() and found.start_values.exists() and found.summary and "peak" in found._repr_html_()
    assert set(table["verdict"]) <= {"identified", "weak", "not_identifiable"}
    # The same log in other units and with other titles.
    other = pandas.DataFrame({"Speed [km/h]": frame["v_x"] * 3.6, "t": frame.index})
    for signal in signals[1:]:
        other[signal.upper()] = frame[signal].to_numpy()
    columns = {signal: signal.upper() for signal in signals[1:]} | {"v_x": "Speed"}
    units = {signal: frame.attrs["units"][signal] for signal in signals[1:]}
    again = trackside.identify(pyarrow.Table.from_pandas(other.reset_index(drop=True)), car=car, config=config, columns=columns, units=units, time="t")
    again = again.frame()["value"]
    assert ((again - table["value"]).abs() <= 1e-6 + 1e-3 * table["value"].abs()).all(), (again, table["value"])
    no_car = raised(trackside.InputError, lambda: trackside.identify(frame, car={}, config=config))
    assert "car" in no_car, no_car


def logs():
    """Frames of all kinds become the same log, and TOML says what Python says."""
    import polars
    from trackside import _identify

    index = pandas.to_datetime(["2026-01-01T00:00:00", "2026-01-01T00:00:02"])
    columns = {"v_x [km/h]": [1.0, 2.0], "r": [0.0, 1.0]}
    seconds = {"time": [0.0, 2.0], **columns}
    pandas.DataFrame(seconds).to_csv("log.csv", index=False)
    pyarrow.parquet.write_table(pyarrow.table(seconds), "log.parquet")
    frames = [
        pandas.DataFrame(columns, index=index),
        pandas.DataFrame(columns, index=[0.0, 2.0]),
        pandas.DataFrame(seconds),
        polars.DataFrame(seconds),
        pyarrow.table(seconds),
        seconds,
        "log.csv",
        Path("log.parquet"),
    ]
    for frame in frames:
        table, units = _identify._table(frame, None)
        assert table.select(["time", "v_x", "r"]).to_pydict() == {"time": [0.0, 2.0], "v_x": [1.0, 2.0], "r": [0.0, 1.0]}, frame
        assert units["v_x"] == "km/h", units
    car = {"body": {"m": 982, "I_zz": 1.6e3}}
    for words, says in [
        (dict(frame={"v_x": [1.0]}), "'time'"),
        (dict(frame={"time [ms]": [1.0], "v_x": [1.0]}), "'ms'"),
        (dict(frame={"time": [1.0], "speed": [1.0]}), "columns={...}"),
        (dict(frame=seconds, columns={"v_x": "speed"}), "'speed'"),
        (dict(frame=seconds, columns={"velocity": "v_x"}), "'velocity'"),
        (dict(frame=seconds), "units={'r': 'rad/s'}"),
        (dict(frame=seconds, units="imperial"), "'imperial'"),
        (dict(frame=seconds, units="SI", task="curves"), "'curves'"),
    ]:
        message = raised(trackside.InputError, lambda: trackside.identify(car=car, **words))
        assert says in message, message
    value = {"a b": [1, 2.5, True, 'ü"\n\x7f'], "n": {"x": float("inf")}, "path": Path("/x")}
    if sys.version_info >= (3, 11):
        import tomllib

        assert tomllib.loads("value = " + _identify.toml(value)) == {"value": value | {"path": "/x"}}


def sweeps():
    """Vary when an FMU fails, and what its check asks for: one variant fails in each way, and one passes."""
    sweep = trackside.sweep("vary.toml", jobs=2, set={"tank.u": 0.25}, seed=7)
    assert len(sweep) == 3 and abs(sweep.share - 1 / 3) < 1e-12 and sweep.folder == Path("target/sweeps/vary").resolve()
    assert (sweep.variants("passed"), sweep.variants("failed"), sweep.variants("error")) == ([2], [1], [0])
    frame = sweep.frame(["tank.at", "verdict", "margin.*", "collect.*", "error*", "seed"])
    assert frame.index.name == "variant" and list(frame["tank.at"]) == [0.5, 2.0, 2.0]
    assert "node `tank`" in frame["error"][0] and frame["error.node"][0] == "tank" and frame["error.time"][0] == 0.5, frame.T
    assert frame["margin.late"][1] < 0.0 <= frame["margin.late"][2] and list(frame["collect.end"][1:]) == [1.0, 1.0], frame.T
    assert set(frame["seed"]) == {7}
    assert sweep.units == sweep.frame().attrs["units"] and sweep.polars("verdict").height == 3
    assert sweep.page == sweep.folder / "sweep.html" and sweep.summary["passed"] == 1, sweep.summary
    assert "node `tank`" in sweep._repr_html_() and "33.3% passed" in repr(sweep)
    failed = sweep.replay(1)
    assert failed.verdict == "fail" and failed.folder == sweep.folder / "variants" / "1"
    assert failed.checks[0].margin == frame["margin.late"][1] and len(failed.frame()) == 11
    try:
        sweep.replay(0)
    except trackside.FmuError as error:
        assert error.run.verdict == "error" and error.run.report["steps"] == 4, error.run.report
    else:
        raise AssertionError("expected FmuError")
    assert "3" in raised(trackside.InputError, lambda: sweep.replay(3))
    # The same call takes what is there; another sweep needs a word.
    assert trackside.sweep("vary.toml", set={"tank.u": 0.25}, seed=7).arrow().equals(sweep.arrow())
    assert "--replace" in raised(trackside.InputError, lambda: trackside.sweep("vary.toml", seed=8))
    assert set(trackside.sweep("vary.toml", seed=8, replace=True).frame("seed")["seed"]) == {8}
    assert "sweep.parquet" in raised(trackside.InputError, lambda: trackside.Sweep("."))


def documented():
    """Every public name has a docstring, and every public function types."""
    for name in trackside.__all__:
        thing = getattr(trackside, name)
        assert inspect.getdoc(thing), name
        members = vars(thing).items() if inspect.isclass(thing) and not issubclass(thing, Exception) else [(name, thing)]
        for member, value in members:
            if member.startswith("_") or not (inspect.isfunction(value) or isinstance(value, property)):
                continue
            function = value.fget if isinstance(value, property) else value
            assert inspect.getdoc(function), f"{name}.{member}"
            parameters = [it for it in inspect.signature(function).parameters.values() if it.name != "self"]
            assert all(it.annotation is not it.empty for it in parameters), f"{name}.{member}"
            assert inspect.signature(function).return_annotation is not inspect.Signature.empty, f"{name}.{member}"
    assert (Path(trackside.__file__).parent / "py.typed").exists()
    assert "step_steer" in trackside.scenarios() and trackside.program() == Path(program)


globals()[test]()
