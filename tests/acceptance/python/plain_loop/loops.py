"""Runs an FMU by loops that share no code with Trackside: bare calls in C, and CVODE by fmpy."""

import json
import os
import shutil
import signal
import struct
import subprocess
import sys
import threading
import zipfile
from pathlib import Path
from urllib.parse import quote
from xml.etree import ElementTree

import fmpy

from archive import LIBRARIES, TEXTS, Model, Refused, Variable

HERE = Path(__file__).resolve().parent
# For CVODE, and for Trackside's own integrator.
TOLERANCE = 1e-10
# Of the loop in C in a communication step, where CVODE does not run.
INTEGRATOR_STEPS = 200
# FMI wants sources without the headers of FMI, and functions without prefixes in a library.
HEADERS = Path(fmpy.__file__).parent / "c-code"
DEFINITIONS = ["-DFMI2_OVERRIDE_FUNCTION_PREFIX", "-DFMI3_OVERRIDE_FUNCTION_PREFIX"]


def finished(command, seconds: float, **more):
    """Exit code and errors of a program that may take some time; what it starts in its group ends with it."""
    process = subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True, **more
    )
    try:
        err = process.communicate(timeout=seconds)[1]
        return process.returncode, err.decode(errors="replace")
    except subprocess.TimeoutExpired:
        return None, ""
    finally:
        try:
            os.killpg(process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        process.wait()


class Machines:
    """The loop in C for each machine that can be had here, compiled when it is first asked for."""

    def __init__(self, folder: Path, prefix: Path | None):
        found = [shutil.which("wine64"), shutil.which("wine"), "/usr/lib/wine/wine64"]
        self.wine = next((it for it in found if it and os.path.exists(it)), None)
        self.environment = dict(os.environ) | {"WINEPREFIX": str(prefix or folder / "prefix"), "WINEDEBUG": "-all"}
        self.folder, self.lock, self.loops = folder, threading.Lock(), {}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        """Ends the server of Wine, which outlives its programs by seconds and still writes into its folder."""
        if self.loops.get("wine64"):
            servers = [shutil.which("wineserver"), str(Path(os.path.realpath(self.wine)).with_name("wineserver"))]
            server = next(it for it in servers if it and os.path.exists(it))
            for how in ("-k", "-w"):
                subprocess.run([server, how], env=self.environment, check=False)

    def loop(self, way: str) -> Path | None:
        machine = "linux" if way == "sources" else way
        with self.lock:
            if machine not in self.loops:
                self.loops[machine] = self.compiled(machine)
            return self.loops[machine]

    def compiled(self, machine: str) -> Path | None:
        source = HERE.parent.parent / "fmu/plain_loop.c"
        flags = ["-O1", "-ffp-contract=off", str(source), "-o"]
        if machine == "linux":
            loop = self.folder / "plain_loop"
            # Some libraries use the mathematical functions of C without saying that they need them.
            subprocess.run(["cc", *flags, str(loop), "-Wl,--no-as-needed", "-ldl", "-lm", "-lpthread"], check=True)
            return loop
        compiler = shutil.which("x86_64-w64-mingw32-gcc")
        if machine != "wine64" or not self.wine or not compiler:
            return None
        loop = self.folder / "plain_loop.exe"
        subprocess.run([compiler, *flags, str(loop)], check=True)
        # Wine makes its folder at the first start, which takes seconds.
        subprocess.run([self.wine, str(loop)], env=self.environment, stderr=subprocess.DEVNULL, check=False)
        return loop


class PlainLoop:
    """One interface of an archive that is unpacked once more for it."""

    def __init__(self, machines: Machines, options, model: Model, interface: str, way: str, folder: Path):
        self.machines, self.options, self.model, self.interface, self.way = machines, options, model, interface, way
        self.folder, self.unpacked = folder, folder / "unpacked"
        self.about = model.interfaces[interface]

    def rows(self, archive: Path, coarse: bool):
        """For each communication point the values in the order of the variables; `coarse` integrates less exactly."""
        if self.model.has_clocks:
            raise Refused("it has clocks, which the importer lets tick")
        try:
            with zipfile.ZipFile(archive) as file:
                for entry in file.infolist():
                    entry.filename = entry.filename.replace("\\", "/")
                    file.extract(entry, self.unpacked)
            if self.interface == "co-simulation":
                return self.bare_calls(0)
            if self.way.startswith("wine"):
                return self.bare_calls(INTEGRATOR_STEPS // 2 if coarse else INTEGRATOR_STEPS)
            return self.cvode(10 * TOLERANCE if coarse else TOLERANCE)
        finally:
            shutil.rmtree(self.unpacked, ignore_errors=True)

    def bare_calls(self, integrator_steps: int):
        loop = self.machines.loop(self.way)
        if loop is None:
            raise Refused("there is no plain loop for this machine")
        library = self.library()
        plan, values = self.folder / "plan.txt", self.folder / "values.txt"
        plan.write_text("\n".join(self.plan(integrator_steps)) + "\n", encoding="utf-8")
        values.unlink(missing_ok=True)
        start = [self.machines.wine] if self.way.startswith("wine") else []
        command = [*start, str(loop), *map(self.place, (library, plan, values))]
        code, err = finished(command, self.options.seconds, env=self.machines.environment, cwd=self.folder)
        *rows, last = (values.read_text().splitlines() if values.exists() else []) or [""]
        if not last.startswith("end "):
            raise Refused("it takes too long" if code is None else f"it ends with exit code {code}")
        how = last.removeprefix("end ")
        if not rows or how not in ("well", "of its own accord", "at an event"):
            raise Refused(" ".join(f"{how}: {err.strip()[-200:]}".split()))
        return [decoded_row(row, self.model.variables) for row in rows]

    def place(self, path: Path) -> str:
        return "Z:" + str(path).replace("/", "\\") if self.way.startswith("wine") else str(path)

    def plan(self, integrator_steps: int) -> list[str]:
        drive = "/Z:" if self.way.startswith("wine") else ""
        resources = self.unpacked / "resources"
        if self.model.version == 3:
            location = self.place(resources) + ("\\" if drive else "/") if resources.is_dir() else ""
        else:
            location = f"file://{drive}" + quote(str(self.unpacked if self.model.version == 1 else resources))

        def claims(*flags: str) -> int:
            return int(any(self.about.get(flag) in ("true", "1") for flag in flags))

        model = self.model
        return [
            f"version {model.version}",
            f"identifier {self.about.get('modelIdentifier', '')}",
            f"guid {model.guid}",
            f"resources {location}",
            f"start {model.start!r}",
            f"step {model.step!r}",
            f"steps {self.options.steps}",
            f"tolerance {model.tolerance!r}",
            f"event_mode {claims('hasEventMode')}",
            f"early_return {claims('hasEventMode', 'mightReturnEarlyFromDoStep')}",
            f"variable_step {claims('canHandleVariableCommunicationStepSize')}",
            f"integrator_steps {integrator_steps}",
            f"states {model.states}",
            f"indicators {model.indicators}",
            *[f"get {it.kind} {it.count} {it.reference}" for it in model.variables],
        ]

    def library(self) -> Path:
        identifier = self.about.get("modelIdentifier", "")
        if self.way == "sources":
            return self.compiled(identifier)
        suffix = ".so" if self.way == "linux" else ".dll"
        for folder in LIBRARIES[self.way]:
            place = self.unpacked / "binaries" / folder
            found = sorted(place.glob(f"*{suffix}"))
            own = place / f"{identifier}{suffix}"
            if own in found or len(found) == 1:
                return own if own in found else found[0]
        raise Refused("there is no library of this name")

    def compiled(self, identifier: str) -> Path:
        sources = self.unpacked / "sources"
        files, words = self.about.get("files") or [], [f"-I{sources}"]
        build = sources / "buildDescription.xml"
        if build.exists():
            found = ElementTree.parse(build).getroot().iter("BuildConfiguration")
            own = next(it for it in found if it.get("modelIdentifier") in (None, identifier))
            files = [it.get("name") for it in own.iter("SourceFile")]
            words += [f"-D{it.get('name')}={it.get('value', '')}" for it in own.iter("PreprocessorDefinition")]
            words += [f"-I{sources / it.get('name')}" for it in own.iter("IncludeDirectory")]
        else:
            words.append(f"-DFMI_VERSION={self.model.version}")
        paths = [sources / it for it in files] or sorted(sources.glob("*.c"))
        library = self.unpacked / f"{identifier}.so"
        command = ["cc", "-shared", "-fPIC", "-O1", "-w", "-ffp-contract=off", *words, f"-I{HEADERS}", *DEFINITIONS]
        command += [*map(str, paths), "-o", str(library), "-lm"]
        code, err = finished(command, 6 * self.options.seconds, cwd=sources)
        if code != 0:
            first = next((line for line in err.splitlines() if "error" in line), "no message")
            raise Refused(f"the sources do not compile: {first.replace(str(self.unpacked), '')}")
        return library

    def cvode(self, tolerance: float):
        library = self.library()
        if self.way == "sources":
            place = self.unpacked / "binaries" / LIBRARIES["linux"][self.model.version < 3]
            place.mkdir(parents=True, exist_ok=True)
            shutil.move(library, place)
        request = {
            "fmu": str(self.unpacked),
            "start": self.model.start,
            "step": self.model.step,
            "steps": self.options.steps,
            "tolerance": tolerance,
            # The recorder of fmpy knows no texts.
            "names": [it.name for it in self.model.variables if it.kind not in TEXTS],
        }
        answer = self.folder / "cvode.json"
        answer.unlink(missing_ok=True)
        command = [sys.executable, "-B", str(HERE / "cvode.py"), json.dumps(request), str(answer)]
        code, err = finished(command, 3 * self.options.seconds, cwd=self.folder)
        if not answer.exists():
            lines = [line for line in err.splitlines() if line.strip()]
            raise Refused(f"fmpy: {lines[-1][:200]}" if lines else f"fmpy ends with exit code {code}")
        return [[row.get(it.name) for it in self.model.variables] for row in json.loads(answer.read_text())]


def decoded_row(row: str, variables: list[Variable]):
    words = iter(row.split(" ")[2:])
    return [[decoded_value(next(words)) for _ in range(it.count)] for it in variables]


def decoded_value(text: str):
    if text.startswith("x"):
        return struct.unpack(">d", bytes.fromhex(text[1:]))[0]
    if text.startswith("s"):
        return bytes.fromhex(text[1:])
    return int(text)
