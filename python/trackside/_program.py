"""Find the program and run it as a process, which ends with the call that started it."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import sysconfig
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ._errors import InputError, TracksideError

#: A run closes its recordings within this time [s] after Ctrl-C; then it is told a second time, and ends at once.
GRACE = 10.0


@dataclass(frozen=True)
class Ended:
    """How a process ended, and what it said."""

    code: int
    stdout: str
    stderr: str

    @property
    def message(self) -> str:
        """What the program says about a failure."""
        return self.stderr.strip() or self.stdout.strip() or self.reason

    @property
    def reason(self) -> str:
        """The end of the process in words."""
        if self.code >= 0:
            return f"the program ended with exit code {self.code}"
        try:
            name = signal.Signals(-self.code).name
        except ValueError:
            name = f"signal {-self.code}"
        return f"{name} ended the program"


def program() -> Path:
    """Return the program: that of the variable TRACKSIDE_PROGRAM, of this installation, or of the search path.

    Raises:
        TracksideError: when there is none.
    """
    chosen = os.environ.get("TRACKSIDE_PROGRAM")
    if chosen:
        if not Path(chosen).is_file():
            raise TracksideError(f"TRACKSIDE_PROGRAM: expected a program, found nothing at {chosen}")
        return Path(chosen)
    for folder in _script_folders():
        if (folder / "trackside").is_file():
            return folder / "trackside"
    found = shutil.which("trackside")
    if found is None:
        folders = ", ".join(str(folder) for folder in _script_folders())
        raise TracksideError(
            f"expected the program `trackside` in {folders} or on the search path, found none: "
            "install the wheel, or name a program in the variable TRACKSIDE_PROGRAM"
        )
    return Path(found)


def _script_folders() -> Iterator[Path]:
    """Name the folders that pip puts programs into: of the environment, of the user, and of `--target`."""
    yield Path(sysconfig.get_path("scripts"))
    user = f"{os.name}_user"
    if user in sysconfig.get_scheme_names():
        yield Path(sysconfig.get_path("scripts", user))
    yield Path(__file__).resolve().parent.parent / "bin"


def share() -> Path:
    """Return the folder of what comes with the program: scenarios, FMUs, plugins.

    Raises:
        TracksideError: when it is not there.
    """
    # In a clone of the repository this package is beside the scenarios.
    clone = Path(__file__).resolve().parent.parent.parent
    if (clone / "Cargo.toml").is_file() and (clone / "scenarios").is_dir():
        return clone
    installed = program().resolve().parent.parent / "share" / "trackside"
    if (installed / "scenarios").is_dir():
        return installed
    raise TracksideError(f"expected the scenarios that come with the program in {installed}, found none: install the wheel")


def call(arguments: Sequence[str | os.PathLike[str]], folder: Path | None = None) -> Ended:
    """Run the program to its end, in this folder or the current one, and return what it says.

    Ctrl-C goes to the program, which closes its recordings, and then to the caller as KeyboardInterrupt.
    """
    words = [os.fspath(program()), *(os.fspath(word) for word in arguments)]
    # In a session of its own the program gets one signal for each Ctrl-C: ours, none of the terminal.
    process = subprocess.Popen(
        words,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        errors="replace",
        start_new_session=True,
        cwd=folder,
        env=os.environ | {"NO_COLOR": "1"},
    )
    try:
        stdout, stderr = process.communicate()
    except BaseException:
        _end(process)
        raise
    return Ended(process.returncode, stdout, stderr)


def _end(process: subprocess.Popen[str]) -> None:
    """End a program as Ctrl-C does, after a while as a second one does, and at last by force with all that it started."""
    try:
        for _ in range(2):
            process.send_signal(signal.SIGINT)
            try:
                process.communicate(timeout=GRACE)
                return
            except subprocess.TimeoutExpired:
                continue
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()


def settings(values: Mapping[str, object] | Sequence[str] | None, seed: int | None) -> list[str]:
    """Write values and a seed as arguments of the program."""
    words: list[str] = []
    if isinstance(values, Mapping):
        entries = [f"{name}={text(name, value)}" for name, value in values.items()]
    elif isinstance(values, str):
        entries = [values]
    else:
        entries = [str(entry) for entry in values or ()]
    for entry in entries:
        words += ["--set", entry]
    if seed is not None:
        words += ["--seed", str(seed)]
    return words


def text(name: str, value: object) -> str:
    """Write a value as `--set` takes it: numbers with all digits, texts as they are, such as `100 km/h`."""
    item = getattr(value, "item", None)
    if callable(item):
        value = item()  # A number of numpy, polars or Arrow.
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, str)):
        return str(value)
    if isinstance(value, float):
        return repr(value)
    raise InputError(f"set: expected a number, a text or a Boolean for {name}, found {value!r}")


def environment_with_scripts() -> dict[str, str]:
    """Return the variables of this process, with the programs of this Python first on the search path."""
    scripts = sysconfig.get_path("scripts")
    return os.environ | {"PATH": os.pathsep.join([scripts, str(Path(sys.executable).parent), os.environ.get("PATH", "")])}
