"""Say why a call of the program failed: the errors of this package."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ._run import Run


class TracksideError(Exception):
    """The program did not do what it was asked for; the message is its own."""


class InputError(TracksideError):
    """The input is wrong: the message says in which file, line and word, and what to do."""


class FmuError(TracksideError):
    """An FMU or a plugin failed: the message says which one, in which call, at which time.

    Attributes:
        run: what was recorded until then; None when nothing was, or when a crash left the recording open.
        folder: the folder of the run. What a crash left there is for `trackside recover`.
        node, time: of a session, the node that failed and the time [s].
    """

    def __init__(
        self,
        message: str,
        folder: Path | None = None,
        run: Run | None = None,
        *,
        node: str | None = None,
        time: float | None = None,
    ) -> None:
        super().__init__(message)
        self.folder = folder
        self.run = run
        self.node = node
        self.time = time
