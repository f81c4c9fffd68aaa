"""Ask the program why two runs differ, and show its answer."""

from __future__ import annotations

import html
import json
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

from ._program import call
from ._run import Run, _judged


@dataclass(frozen=True)
class Difference:
    """Something that differs between the inputs of two runs."""

    #: What it is, such as `plant.body.m`.
    place: str
    #: What kind of input it is, such as `start_value` or `archive`.
    kind: str
    #: The value of the first run, as text.
    a: str
    #: The value of the second run, as text.
    b: str
    #: The unit of both.
    unit: str | None
    #: What differs inside, of an archive or a file.
    details: tuple[str, ...]
    #: Whether it is a cause; None when no experiment told.
    is_cause: bool | None


class Comparison:
    """Why two runs differ. Jupyter shows the summary and a table of the differences."""

    #: All of `why.json`.
    result: dict[str, Any]

    def __init__(self, result: dict[str, Any], page: str, links: dict[str, Path]) -> None:
        """Keep the answer of the program, its page, and the files that the links of the page lead to."""
        self.result = result
        self._page = page
        self._links = links

    @property
    def same(self) -> bool:
        """Whether no value differs beyond rounding."""
        return bool(self.result["same"])

    @property
    def summary(self) -> str:
        """The answer in one line."""
        return str(self.result["summary"])

    @property
    def causes(self) -> list[str]:
        """The causes, a sentence each."""
        return [str(cause["text"]) for cause in self.result["causes"]]

    @property
    def differences(self) -> list[Difference]:
        """What differs between the inputs."""
        causes = {number for cause in self.result["causes"] for number in cause["differences"]}
        idle = set(self.result["without_effect"])
        return [
            Difference(
                place=entry["place"],
                kind=entry["kind"],
                a=entry["a"],
                b=entry["b"],
                unit=entry.get("unit"),
                details=tuple(entry["details"]),
                is_cause=True if entry["id"] in causes else False if entry["id"] in idle else None,
            )
            for entry in self.result["differences"]
        ]

    @property
    def checks(self) -> list[dict[str, Any]]:
        """The checks by name: of each run (`a`, `b`) value, limit, margin and verdict, `changes` of the check, `flipped_by`, `text`.

        Those whose verdicts differ come first.
        """
        return list(self.result["checks"])

    @property
    def key_figures(self) -> list[dict[str, Any]]:
        """Lap times and collected values: name, unit, a, b."""
        return list(self.result["key_figures"])

    @property
    def first_deviation(self) -> dict[str, Any] | None:
        """The first value that differs: node, variable, time [s], a, b; None when none does."""
        return self.result["first_deviation"]

    def save_page(self, path: str | os.PathLike[str]) -> Path:
        """Write the page of the comparison to a file."""
        page = self._page
        for link, file in self._links.items():
            page = page.replace(link, _link(file, Path(path).resolve().parent))
        Path(path).write_text(page, encoding="utf-8")
        return Path(path)

    def __repr__(self) -> str:
        """Return the summary."""
        return f"<Comparison: {self.summary}>"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{html.escape(it.place)}</td><td>{html.escape(it.a)}</td><td>{html.escape(it.b)}</td>"
            f"<td>{html.escape(it.unit or '')}</td><td>{html.escape('; '.join(it.details))}</td></tr>"
            for it in self.differences
        )
        flips = "".join(f"<p>{html.escape(check['text'])}</p>" for check in self.checks if check["text"])
        head = "<tr><th>input</th><th>A</th><th>B</th><th>unit</th><th>inside</th></tr>"
        return f"<p>{html.escape(self.summary)}</p>{flips}<table>{head}{rows}</table>"


def compare(a: Run | str | os.PathLike[str], b: Run | str | os.PathLike[str], *, runs: int | None = None) -> Comparison:
    """Return why run `b` differs from run `a`: runs, their folders, or a baseline in the place of `a`.

    The program repeats the runs with some of their differences swapped; `runs` is how often at most.

    Raises:
        InputError: when one of them cannot be read.
        FmuError: when an FMU fails in an experiment.
    """
    paths = [run.folder if isinstance(run, Run) else Path(run) for run in (a, b)]
    with tempfile.TemporaryDirectory() as folder:
        words: list[str | os.PathLike[str]] = ["why", *paths, "--json", "--out", folder]
        if runs is not None:
            words += ["--runs", str(runs)]
        ended = call(words)
        _judged(ended)
        page = Path(folder, "why.html").read_text(encoding="utf-8")
        reports = [(run if run.is_dir() else run.parent).resolve() / "report.html" for run in paths]
        links = {_link(report, Path(folder).resolve()): report for report in reports}
        return Comparison(json.loads(ended.stdout), page, links)


def _link(file: Path, folder: Path) -> str:
    """Return how a page in `folder` links a file."""
    return f'href="./{quote(os.path.relpath(file, folder))}"'
