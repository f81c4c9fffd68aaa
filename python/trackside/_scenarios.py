"""List the scenarios that come with the program."""

from __future__ import annotations

from pathlib import Path

from ._program import share


def scenarios() -> dict[str, Path]:
    """Return the files of the scenarios that come with the program, by name. `run` takes name or file.

    Raises:
        TracksideError: when they are not installed.
    """
    return {path.stem: path for path in sorted((share() / "scenarios").glob("*.toml"))}
