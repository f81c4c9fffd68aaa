"""Runs each FMU below some folders by trackside and by a plain loop, and prints how many agree: plain_loop FOLDER...

Co-simulation is compared with bare calls in C, to the bit. Model exchange is compared relative to the range of each variable: with fmpy
and CVODE, under Wine with the method of Runge and Kutta in C up to the first event. None of them shares code with Trackside. Exit code 1
when values differ, or when trackside refuses what a plain loop runs.
"""

import argparse
import hashlib
import os
import re
import sys
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from loops import Machines
from trial import outcomes_of

COLUMNS = ["equal", "explained", "alone", "neither", "differs", "refused"]


def archives(folders: list[Path]) -> list[Path]:
    """All archives below some folders, those of equal bytes once."""
    paths = [it for given in folders for it in ([given] if given.is_file() else given.rglob("*.fmu")) if it.is_file()]
    once = {hashlib.sha256(it.read_bytes()).digest(): it for it in sorted(paths, reverse=True)}
    return sorted(once.values())


def in_general(what: str, path: Path) -> str:
    """A reason without what belongs to one FMU only."""
    what = what.replace(str(path), "it")
    for pattern, general in ((r"`[^`]*`", "`…`"), (r"\([^)]*\)", "(…)"), (r"(/[\w.+{}\-]+)+", "…")):
        what = re.sub(pattern, general, what)
    return re.sub(r"\b[\d.]+(e[+-]?\d+)?\b", "N", what)[:160]


def print_table(counts: Counter, reasons: Counter):
    print("| interface | FMI | run by | archives | " + " | ".join(COLUMNS) + " |")
    print("|---" * (4 + len(COLUMNS)) + "|")
    for kind in sorted({it[:3] for it in counts}):
        own = [counts[kind + (it,)] for it in COLUMNS]
        print("| " + " | ".join(map(str, [*kind, sum(own), *own])) + " |")
    for (kind, what), count in sorted(reasons.items(), key=lambda it: (it[0][0], -it[1])):
        print(f"{count:5} {kind}: {what}")


def main() -> int:
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("folders", nargs="+", type=Path)
    words.add_argument("--trackside", default=os.environ.get("TRACKSIDE_PROGRAM", "trackside"))
    words.add_argument("--steps", type=int, default=50)
    words.add_argument("--seconds", type=float, default=10.0, help="the time that one program may take")
    words.add_argument("--all-ways", action="store_true", help="also run what an archive has beside a library for Linux")
    words.add_argument("--only", default="", help="an interface, a way, or both: `co-simulation wine64`")
    words.add_argument("--jobs", type=int, default=1, help="how many archives are run at once")
    words.add_argument("--list", type=Path, default=os.devnull, help="a file with one line for each trial")
    words.add_argument("--prefix", type=Path, help="the folder of Wine that the plain loop uses")
    options = words.parse_args()
    counts, reasons, paths = Counter(), Counter(), archives(options.folders)
    with (
        tempfile.TemporaryDirectory(prefix="plain-loop-") as options.scratch,
        Machines(Path(options.scratch), options.prefix) as machines,
        open(options.list, "w", encoding="utf-8") as table,
    ):
        print("archive", "interface", "FMI", "tool", "run by", "outcome", "detail", sep="\t", file=table)
        pool = ThreadPoolExecutor(options.jobs)
        for path, outcomes in zip(paths, pool.map(lambda path: outcomes_of(machines, options, path), paths)):
            for it in outcomes:
                version, tool = (it.model.version, it.model.tool) if it.model else ("", "")
                detail = " ".join(it.detail.split())
                print(path, it.interface, version, tool, it.way, it.kind, detail, sep="\t", file=table, flush=True)
                if it.kind in COLUMNS:
                    counts[it.interface, version, it.way, it.kind] += 1
                if it.kind != "equal":
                    reasons[it.kind, in_general(detail, path)] += 1
                if it.kind in ("differs", "refused"):
                    print(f"{path}: {it.kind} ({it.interface}, {it.way}): {detail}", file=sys.stderr)
    print_table(counts, reasons)
    return int(any(kind[3] in ("differs", "refused") for kind in counts))


if __name__ == "__main__":
    sys.exit(main())
