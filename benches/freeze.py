"""Keeps the results of every scenario, and lists what differs between two such files.

    python3 benches/freeze.py run target/debug/trackside before.json [NAME ...]
    python3 benches/freeze.py compare before.json after.json

`run` keeps of each scenario the exit code, the SHA-256 of run.csv, and what `checks` and `analyses` of report.json hold. `compare` prints each
difference; of the numbers of a scenario, the largest relative one. Its exit code is 1 when something differs.
"""

import argparse
import hashlib
import json
import subprocess
import sys
import tempfile
from pathlib import Path

# Smaller relative differences are rounding: sums in another order.
ROUNDING = 1e-9
# The duration of a fit depends on the machine.
DURATION = "seconds"


def leaves(value, path=""):
    """The numbers and texts below `value`, with the path of keys that leads to each."""
    if isinstance(value, dict):
        for key, below in value.items():
            if key != DURATION:
                yield from leaves(below, f"{path}.{key}" if path else key)
    elif isinstance(value, list):
        for index, below in enumerate(value):
            yield from leaves(below, f"{path}[{index}]")
    else:
        yield path, value


def freeze(program, scenario):
    """The results of a run of `scenario`."""
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
    """Sentences about what differs between two results of one scenario."""
    for key in ("exit_code", "csv"):
        if before[key] != after[key]:
            yield f"{name}: {key} {before[key]} -> {after[key]}"
    old, new = before["values"], after["values"]
    worst = (0.0, None)
    for path in sorted(old.keys() | new.keys()):
        a, b = old.get(path), new.get(path)
        numbers = all(isinstance(it, (int, float)) and not isinstance(it, bool) for it in (a, b))
        if a == b:
            continue
        difference = f"{path}: {a!r} -> {b!r}"
        if numbers:
            worst = max(worst, (abs(a - b) / max(abs(a), abs(b)), difference))
        else:
            yield f"{name}: {difference}"
    if worst[0] > ROUNDING:
        yield f"{name}: numbers differ by up to {worst[0]:.2g} of their size, {worst[1]}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    actions = parser.add_subparsers(dest="action", required=True)
    run = actions.add_parser("run")
    run.add_argument("program", type=Path)
    run.add_argument("file", type=Path)
    run.add_argument("names", nargs="*", metavar="NAME", help="scenarios to run (default: all)")
    comparison = actions.add_parser("compare")
    comparison.add_argument("before", type=Path)
    comparison.add_argument("after", type=Path)
    arguments = parser.parse_args()
    if arguments.action == "run":
        scenarios = sorted([*Path("scenarios").glob("*.toml"), *Path("scenarios/manoeuvres").glob("*.toml")])
        if not scenarios:
            sys.exit("no scenarios here: start this in the root of the repository")
        unknown = set(arguments.names) - {it.stem for it in scenarios}
        if unknown:
            sys.exit(f"no scenario in scenarios or scenarios/manoeuvres: {', '.join(sorted(unknown))}")
        chosen = [it for it in scenarios if not arguments.names or it.stem in arguments.names]
        if not arguments.program.is_file():
            sys.exit(f"no program at {arguments.program}: build it, for example by `cargo build`")
        frozen = {str(it): freeze(arguments.program, it) for it in chosen}
        for name, results in frozen.items():
            if results["exit_code"]:
                print(f"{name}: exit code {results['exit_code']}")
        arguments.file.write_text(json.dumps(frozen, indent=1))
        return
    before, after = (json.loads(file.read_text()) for file in (arguments.before, arguments.after))
    different = []
    for name in sorted(before.keys() | after.keys()):
        if name in before and name in after:
            different += compare(name, before[name], after[name])
        else:
            different.append(f"{name}: only in one of the two")
    print("\n".join(different) or f"{len(before)} scenarios give the same")
    sys.exit(bool(different))


main()
