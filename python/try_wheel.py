#!/usr/bin/env python3
"""Try a wheel as users get it: in clean environments, without Rust, on each Python that is there.

    python3 python/try_wheel.py WHEEL [--python PYTHON]... [--packages DIR]

Each Python of 3.9 to 3.13 makes an environment, installs the wheel with pandas, runs scenarios, and draws the first picture. A line
for each says how long that took from `pip install` to the picture. The exit code is 1 when something failed.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

VERSIONS = ["3.9", "3.10", "3.11", "3.12", "3.13"]

FIRST_RUN = """
import sys, trackside
run = trackside.run("step_steer")
assert run.passed
shown = run._repr_html_()
assert shown.count("<svg") == len(run.plots()) > 0
open("picture.html", "w", encoding="utf-8").write(shown)
"""

MORE = """
import trackside
run = trackside.run("limit_handling")
assert run.passed and (run.folder / "run.rrd").exists(), run
frame = run.frame(["plant.v_x", "plant.v_y", "plant.r", "plant.a_x", "plant.a_y", "plant.delta"])
assert frame.shape == (10401, 6) and frame.attrs["units"]["plant.r"] == "rad/s"
units = {name.split(".")[1]: unit for name, unit in frame.attrs["units"].items() if "." in name}
frame.columns = [name.split(".")[1] for name in frame.columns]
car = {"body": {"m": 780.0, "I_zz": 1000.0, "l_f": 1.4, "l_r": 1.6, "h": 0.35}, "aero": "none", "drive_front_share": 0.0, "brake_front_share": 0.6}
found = trackside.identify(frame, car=car, units=units, config={"methods": ["least_squares"]})
peak = found.frame().loc["least_squares", "front", "peak"]
assert 1.4 < peak["value"] < 1.8, peak
assert {"step_steer", "double_lane_change"} <= set(trackside.scenarios())
try:
    trackside.run("step_steer", set={"plant.body.mm": 1.0})
except trackside.InputError as error:
    assert "did you mean" in str(error)
"""

MODEL = """
import numpy
from trackside.fmu import Model, output, parameter

class Gain(Model):
    k = parameter(3.0)
    y = output(0.0)

    def step(self, t, h):
        self.y = float(numpy.multiply(self.k, 2.0))
"""

SCENARIO = """
[time]
step = 0.1
stop = 1.0

[[fmu]]
name = "gain"
path = "gain.fmu"

[[check]]
name = "twice"
that = "gain.y == 6"
during = [0.5, 1.0]
"""


def main() -> None:
    """Try the wheel on each Python, and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("wheel", type=Path)
    parser.add_argument("--python", action="append", default=[], help="a Python to use, instead of those that are found")
    parser.add_argument("--packages", type=Path, help="a folder of wheels: nothing is downloaded")
    arguments = parser.parse_args()
    wheel = arguments.wheel.resolve(strict=True)
    source = ["--no-index", "--find-links", str(arguments.packages.resolve())] if arguments.packages else []
    pythons = arguments.python or [found for version in VERSIONS for found in pythons_of(version)]
    if not pythons:
        sys.exit(f"expected a Python of {', '.join(VERSIONS)} on the search path or of pyenv, found none")
    failed = [python for python in pythons if not tried(python, wheel, source)]
    sys.exit(1 if failed else 0)


def pythons_of(version: str) -> list[str]:
    """Find a Python of a version: of pyenv, or on the search path."""
    root = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    found = sorted(root.glob(f"{version}.*/bin/python{version}"))
    if found:
        return [str(found[-1])]
    path = shutil.which(f"python{version}")
    return [path] if path else []


def tried(python: str, wheel: Path, source: list[str]) -> bool:
    """Install and use the wheel with a Python."""
    with tempfile.TemporaryDirectory(prefix="try-wheel-") as name:
        folder = Path(name)
        programs = folder / "venv" / "bin"
        # No compiler, and not this repository: what works does so by the wheel alone.
        clean = {"HOME": name, "LANG": "C.UTF-8", "PATH": str(programs)}
        for variable in ("PIP_CERT", "SSL_CERT_FILE", "PIP_INDEX_URL", "HTTPS_PROXY", "https_proxy"):
            if variable in os.environ:
                clean[variable] = os.environ[variable]

        def run(*words: object) -> None:
            done = subprocess.run([str(word) for word in words], cwd=folder, env=clean, capture_output=True, text=True)
            if done.returncode != 0:
                raise RuntimeError(f"{words[:4]}: exit code {done.returncode}\n{done.stdout}{done.stderr}")

        try:
            run(python, "-m", "venv", folder / "venv")
            begin = time.monotonic()
            run(programs / "python", "-m", "pip", "install", "--quiet", *source, f"{wheel}[pandas]")
            installed = time.monotonic()
            run(programs / "python", "-c", FIRST_RUN)
            picture = time.monotonic()
            run(programs / "python", "-c", MORE)
            scenarios = folder / "venv" / "share" / "trackside" / "scenarios"
            run(programs / "trackside", "explain", "--plugin", "identify", "task")
            run(programs / "trackside", "pack", scenarios / "step_steer.toml", "--fmu", "steer", "--out", folder / "packed")
            if not (folder / "packed" / "steer.fmu").is_file():
                raise RuntimeError(f"expected {folder}/packed/steer.fmu, found none")
            # A scenario that came with the program, in a folder of its own, and an FMU in Python, which needs no compiler.
            for name in ("lap_data_sheet", "tires_from_bench"):
                run(programs / "trackside", "examples", name, "--out", folder / "examples")
            run(programs / "trackside", "run", folder / "examples" / "lap_data_sheet.toml")
            (folder / "gain.py").write_text(MODEL)
            run(programs / "trackside", "pack", "--python", folder / "gain.py", "--out", folder / "scenarios")
            (folder / "scenarios" / "gain.toml").write_text(SCENARIO)
            run(programs / "trackside", "test", folder / "scenarios", "--junit", folder / "results.xml")
        except RuntimeError as error:
            print(f"{python}: FAILED: {error}", flush=True)
            return False
        seconds = f"pip install {installed - begin:.1f} s, first run and picture {picture - installed:.1f} s"
        print(f"{python}: ok: {seconds}, together {picture - begin:.1f} s", flush=True)
        return True


if __name__ == "__main__":
    main()
