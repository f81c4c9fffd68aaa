"""Freezes what every scenario gives, and says what differs between two frozen states.

    python3 benches/freeze.py run target/debug/trackside before.json [NAME ...]
    python3 benches/freeze.py compare before.json after.json

`run` keeps for each scenario the SHA-256 of run.csv, the exit code, and all numbers, verdicts and texts of `checks` and `analyses` of
report.json. `compare` expects equal hashes; of numbers it tells the largest relative difference, of all else each one.
Exit code 1: something differs.
"""

import hashlib
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

# Differences below this are rounding: sums in another order.
ROUNDING = 1e-9
# What depends on the machine and the moment.
VOLATILE = ("duration", "time_s", "seconds", "elapsed", "written", "page", "path", "file")


def leaves(value, path=""):
    """The numbers and texts below `value`, with the path of keys that leads to each."""
    if isinstance(value, dict):
        for key, below in value.items():
            if key not in VOLATILE:
                yield from leaves(below, f"{path}.{key}" if path else key)
    elif isinstance(value, list):
        for index, below in enumerate(value):
            yield from leaves(below, f"{path}[{index}]")
    else:
        yield path, value


def freeze(program, scenario):
    """What a run of `scenario` gives."""
    with tempfile.TemporaryDirectory() as folder:
        command = [program, "run", scenario, "--csv", "--rerun", "off", "--out", folder]
        code = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, check=False).returncode
        table, report = Path(folder, "run.csv"), Path(folder, "report.json")
        frozen = {"exit_code": code, "csv": None, "values": {}}
        if table.exists():
            frozen["csv"] = hashlib.sha256(table.read_bytes()).hexdigest()
        if report.exists():
            whole = json.loads(report.read_text())
            frozen["values"] = dict(leaves({key: whole.get(key) for key in ("checks", "analyses")}))
        return frozen


def compare(name, before, after):
    """Sentences about what differs between two frozen runs of one scenario."""
    for key in ("exit_code", "csv"):
        if before[key] != after[key]:
            yield f"{name}: {key} {before[key]} -> {after[key]}"
    old, new = before["values"], after["values"]
    worst = (0.0, None)
    for path in sorted(old.keys() | new.keys()):
        a, b = old.get(path), new.get(path)
        numbers = all(isinstance(it, (int, float)) and not isinstance(it, bool) for it in (a, b))
        if a == b or (numbers and math.isnan(a) and math.isnan(b)):
            continue
        if not numbers:
            yield f"{name}: {path}: {a!r} -> {b!r}"
            continue
        relative = abs(a - b) / max(abs(a), abs(b))
        worst = max(worst, (relative, f"{path}: {a!r} -> {b!r}"))
    if worst[0] > ROUNDING:
        yield f"{name}: numbers differ by up to {worst[0]:.2g} of their size, {worst[1]}"


def main():
    if sys.argv[1] == "compare":
        before, after = (json.loads(Path(file).read_text()) for file in sys.argv[2:4])
        different = []
        for name in sorted(before.keys() | after.keys()):
            if name in before and name in after:
                different += compare(name, before[name], after[name])
            else:
                different.append(f"{name}: only in one of the two")
        print("\n".join(different) or f"{len(before)} scenarios give the same")
        sys.exit(bool(different))
    program, file, *names = sys.argv[2:]
    scenarios = sorted([*Path("scenarios").glob("*.toml"), *Path("scenarios/manoeuvres").glob("*.toml")])
    frozen = {str(it): freeze(program, it) for it in scenarios if not names or it.stem in names}
    Path(file).write_text(json.dumps(frozen, indent=1))


main()
