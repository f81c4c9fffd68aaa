"""Measures how often `trackside why` names the cause of a change: seeded changes of twelve kinds, over all scenarios.

    python3 benches/why.py PROGRAM [--count 200] [--seed 1] [--only KIND] [--jobs 1] [--keep FOLDER] [--out result.json]
    python3 benches/why.py PROGRAM --judge-only FOLDER [--only KIND] [--out result.json]
    python3 benches/why.py PROGRAM --real FOLDER [--plants OLD.fmu NEW.fmu]
    python3 benches/why.py --self-test

Each scenario runs as it is (A) and with one change (B). Then `why A B --json` has to name the place of the change, or that no value
differs. A cause elsewhere is wrong, a cause that is not known is none. `--real` takes FMUs of the same name from the subfolders of
FOLDER, such as versions of the Reference FMUs; `--plants` takes two archives of our own plant. The exit code is 0 when at least 95 % are
right and none is wrong. README.md beside this file has more.
"""

import argparse
import itertools
import json
import math
import os
import random
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import archives
import changes
from gathered import Scenario, gather

# Values that differ by less of their range may count as equal or not: sums in another order.
ROUNDING = 1e-6
RIGHT_SHARE = 0.95
# A draw that has no effect is kept this often, so that most of the changes have one.
KEPT_WITHOUT_EFFECT = 0.25
# Draws that were not taken, after which a kind goes without.
MOST_REFUSALS = 500


def run(program, scenario, folder, limit, *options):
    """Runs a scenario into a folder: (duration [s], None), or (duration, what went wrong)."""
    shutil.rmtree(folder, ignore_errors=True)
    command = [program, "run", scenario, "--rerun", "off", *options, "--limit", str(limit), "--out", folder]
    begin = time.perf_counter()
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=2 * limit + 30, check=False)
    except subprocess.TimeoutExpired:
        return time.perf_counter() - begin, "it did not end"
    duration = time.perf_counter() - begin
    if done.returncode not in (0, 1):
        return duration, f"exit code {done.returncode}: {(done.stdout + done.stderr).strip()[-300:]}"
    return duration, None


def number(text):
    try:
        return float(text)
    except ValueError:
        return {"true": 1.0, "false": 0.0}.get(text)


def cells_by_time(lines):
    """The cells of lines of a CSV file by their time [ns]."""
    return {round(float(line[: line.index(",")]) * 1e9): line.rstrip("\r").split(",") for line in lines if line}


def largest_difference(a, b):
    """Largest difference of two CSV files of runs at common times, relative to the largest absolute value of its column.

    A text or a NaN that differs counts as 1. Where a part of the rows differs already, it is that of these rows.
    """
    texts = [it.read_text() for it in (a, b)]
    if texts[0] == texts[1]:
        return 0.0
    (titles_a, *lines_a), (titles_b, *lines_b) = (it.split("\n") for it in texts)
    titles_a, titles_b = titles_a.split(","), titles_b.split(",")
    # Runs of two versions of an FMU may have other variables: whether that is a difference of values is open.
    least = 0.0 if titles_a == titles_b else ROUNDING / 2
    columns = [(index, titles_b.index(it)) for index, it in enumerate(titles_a) if index and it in titles_b]
    for part in (max(1, len(lines_a) // 200), 1):
        # From the end, where most differences are largest.
        rows_a, rows_b = cells_by_time(lines_a[::-part]), cells_by_time(lines_b if len(lines_a) != len(lines_b) else lines_b[::-part])
        difference = max(least, rows_difference(rows_a, rows_b, columns))
        if difference >= ROUNDING or part == 1:
            return difference
    return least


def rows_difference(rows_a, rows_b, columns):
    pairs = [(row, rows_b[it]) for it, row in rows_a.items() if it in rows_b]
    worst = 0.0
    for p, q in columns:
        different = [(number(a[p]), number(b[q])) for a, b in pairs if a[p] != b[q]]
        if any(x is None or y is None or math.isnan(x) != math.isnan(y) for x, y in different):
            return 1.0
        difference = max((abs(x - y) for x, y in different), default=0.0)
        if difference:
            # Whatever the unit: values around a millionth of a millionth are rounding.
            largest = max(max(abs(number(a[p]) or 0.0), abs(number(b[q]) or 0.0)) for a, b in pairs)
            worst = max(worst, difference / max(largest, 1e-6))
    return worst


def names_change(place, truth):
    """Whether a place of a report is one of the places of a change, or below one. Spelling of blanks and quotes is free."""

    def plain(text):
        return re.sub(r"\s+|[\"'`]", "", text).replace("→", "->")

    place = plain(place)
    for known in map(plain, truth):
        if place == known or (place.startswith(known) and place[len(known)] in ".[("):
            return True
        # A file may be named from another folder.
        if "." in known and "/" in place and place.endswith("/" + known):
            return True
    return False


def judge(report, pair):
    """The verdict on a report of `why`, `right`, `wrong` or `none`, and why."""
    places = {it["id"]: it["place"] for it in report.get("differences", [])}
    named = [places.get(it, f"difference {it}") for cause in report.get("causes", []) for it in cause["differences"]]
    elsewhere = sorted({it for it in named if not names_change(it, pair["places"])})
    if elsewhere:
        return "wrong", f"names {', '.join(elsewhere)}"
    if report.get("same"):
        if pair["difference"] >= ROUNDING:
            return "wrong", f"says that no value differs; they differ by {pair['difference']:.2g}"
        return ("wrong", "names a cause where no value differs") if named else ("right", "no value differs")
    if named:
        if pair["difference"] == 0.0:
            return "wrong", "says that values differ; they do not"
        return "right", f"names {', '.join(sorted(set(named)))}"
    if pair["difference"] == 0.0 and not report.get("unexplained"):
        return "right", "no effect"
    return "none", report.get("unexplained") or report.get("summary") or "names no cause"


def ask(program, folder, limit):
    """The verdict on one pair in its folder."""
    pair = json.loads((folder / "pair.json").read_text())
    command = [program, "why", folder / "run_a", folder / "run_b", "--json"]
    begin = time.perf_counter()
    verdict, text, report = "none", "", None
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=limit, check=False)
        report = json.loads(done.stdout)
        verdict, text = judge(report, pair)
    except subprocess.TimeoutExpired:
        text = f"it did not end within {limit:.0f} s"
    except (ValueError, KeyError, TypeError, AttributeError) as wrong:
        text = f"no report, exit code {done.returncode}: {(done.stderr or done.stdout).strip()[-300:] or wrong}"
    seconds = time.perf_counter() - begin
    with tempfile.TemporaryDirectory() as again:
        # At the same load of the machine.
        single, _ = run(program, folder / pair["longer"], Path(again, "run"), limit)
    listed = any(names_change(it["place"], pair["places"]) for it in (report or {}).get("differences", []))
    return pair | {
        "folder": folder.name, "verdict": verdict, "because": text, "listed": listed, "why_seconds": seconds, "run_seconds": single,
        "ratio": seconds / single, "report": report,
    }  # fmt: skip


class Bases:
    """The scenarios without a change, each run once."""

    def __init__(self, program, folder, limit, scenarios):
        self.program, self.folder, self.limit = program, folder, limit
        self.scenarios, self.runs = scenarios, {}

    def run(self, scenario):
        """(folder, duration of the run [s], what went wrong)."""
        if scenario.name not in self.runs:
            folder = self.folder / scenario.name.replace("/", "_")
            file, known = scenario.write(folder / "scenario"), folder / "base.json"
            if known.exists() and (folder / "run/run.csv").exists():
                seconds, problem = json.loads(known.read_text())
            else:
                seconds, problem = run(self.program, file, folder / "run", self.limit, "--csv")
                known.write_text(json.dumps([seconds, problem]))
            self.runs[scenario.name] = (folder, seconds, problem)
            if problem:
                print(f"{scenario.name} is left out: {problem}", file=sys.stderr)
        return self.runs[scenario.name]


def make_pair(bases, folder, kind, changed, change, draw=0):
    """Runs the changed scenario and writes the pair into a folder; returns what went wrong."""
    base, seconds, problem = bases.run(next(it for it in bases.scenarios if it.name == changed.name))
    if problem:
        return problem
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    if change.report:
        shutil.copytree(base / "run", folder / "run_b")
        file = folder / "run_b/report.json"
        report = json.loads(file.read_text())
        report["versions"] |= change.report
        file.write_text(json.dumps(report, indent=2))
        again = seconds
    else:
        scenario = changed.write(folder / "scenario")
        again, problem = run(bases.program, scenario, folder / "run_b", bases.limit, "--csv")
        if problem:
            return problem
    os.symlink(os.path.relpath(base / "run", folder), folder / "run_a")
    difference = largest_difference(base / "run/run.csv", folder / "run_b/run.csv")
    (folder / "run_b/run.csv").unlink()
    longer = next((base if seconds >= again else folder).glob("scenario/*.toml"))
    pair = {
        "kind": kind, "scenario": changed.name, "change": change.text, "places": change.places, "difference": difference,
        "seconds": [seconds, again], "longer": os.path.relpath(longer, folder), "draw": draw,
    }  # fmt: skip
    (folder / "pair.json").write_text(json.dumps(pair, indent=1))
    return None


def scenario_order(scenarios, kind, seed):
    order = list(scenarios)
    random.Random(f"{seed}/{kind}").shuffle(order)
    return order


def make_kind(bases, folder, kind, seed, refused):
    """Makes a pair of one kind with each step of the iteration, as evenly over the scenarios as they have something of the kind.

    Pairs that are there already are taken; draws that were not taken are added to `refused`.
    """
    order, seen, draw, refusals = scenario_order(bases.scenarios, kind, seed), set(), 0, 0
    for number in itertools.count():
        stem = f"{kind.replace(' ', '_')}_{number:02}_"
        there = next(iter(folder.glob(f"{stem}*/pair.json")), None)
        if there:
            pair = json.loads(there.read_text())
            draw = pair["draw"] + 1
            seen.add((pair["scenario"], pair["change"]))
            yield there.parent
            continue
        name = None
        while name is None:
            if refusals > MOST_REFUSALS:
                return
            scenario, chance = order[draw % len(order)], random.Random(f"{seed}/{kind}/{draw}")
            drawn = changes.draw(kind, scenario, chance)
            draw += 1
            if drawn is None or (scenario.name, drawn[1].text) in seen:
                refusals += 1
                continue
            changed, change = drawn
            seen.add((scenario.name, change.text))
            name = f"{stem}{scenario.name.replace('/', '_')}"
            problem = try_pair(bases, folder / name, kind, changed, change, draw - 1)
            # Most pairs shall have an effect.
            if problem is None and kind not in changes.OFTEN_WITHOUT_EFFECT:
                pair = json.loads((folder / name / "pair.json").read_text())
                if pair["difference"] < ROUNDING and chance.random() > KEPT_WITHOUT_EFFECT:
                    problem = "no effect"
            if problem:
                shutil.rmtree(folder / name, ignore_errors=True)
                refused.append({"kind": kind, "scenario": scenario.name, "change": change.text, "because": problem})
                refusals += 1
                name = None
        print(f"{name}: {change.text}", flush=True)
        yield folder / name


def try_pair(bases, folder, kind, changed, change, draw):
    """Makes a pair of a draw; returns what went wrong."""
    try:
        return make_pair(bases, folder, kind, changed, change, draw)
    except (ValueError, OSError) as wrong:
        return str(wrong)


def gathered_scenarios(root, fmus, most_steps):
    files = [it for it in sorted(root.rglob("*.toml")) if "cars" not in it.relative_to(root).parts]
    found = [gather(it, root, fmus, most_steps) for it in files]
    return [it for it in found if it]


def standalone(name, archive):
    """A scenario of one FMU, the node `model`, by itself, with the communication step of a hundredth of a second."""
    node = {"name": "model", "path": "fmu/model.fmu", "unconnected": "start"}
    return Scenario(name, {"title": name, "time": {"step": 0.01, "stop": 3.0}, "fmu": [node]}, {node["path"]: archive})


def make_real(program, folder, limit, versions, plants, scenarios):
    """Pairs of two archives: of the same name in the subfolders of `versions`, and of our own plant in each scenario that has one."""
    pairs = []
    if versions:
        folders = sorted(it for it in versions.iterdir() if it.is_dir())
        archives_of = [{file.name: file.resolve() for file in it.rglob("*.fmu")} for it in folders]
        for index, (old, new) in enumerate(zip(archives_of, archives_of[1:])):
            for name in sorted(old.keys() & new.keys()):
                label = f"{Path(name).stem}_{folders[index].name}_{folders[index + 1].name}".replace(".", "_")
                a, b = standalone(label, old[name]), standalone(label, new[name])
                pairs.append((a, b, "model", f"{name} of {folders[index].name} -> {folders[index + 1].name}"))
    for scenario in scenarios if plants else []:
        for node in scenario.list("fmu"):
            if archives.root_attribute(archives.description(scenario.archive(node)), "modelName") != "plant":
                continue
            a, b = scenario.copy(), scenario.copy()
            for it in (a, b):
                it.name = f"{scenario.name}_{node['name']}"
            a.files[node["path"]], b.files[node["path"]] = (it.resolve() for it in plants)
            pairs.append((a, b, node["name"], f"{node['name']} of {scenario.name}: {plants[0]} -> {plants[1]}"))
    bases = Bases(program, folder / "base", limit, [it[0] for it in pairs])
    for _, changed, node, text in pairs:
        kind = "real"
        place = folder / "pairs" / f"real_{changed.name.replace('/', '_')}"
        problem = make_pair(bases, place, kind, changed, changes.Change(text, [f"fmu.{node}", f"fmu/{node}.fmu"]))
        print(f"{text}: {problem or 'made'}", flush=True)
        if problem:
            shutil.rmtree(place, ignore_errors=True)


def print_results(results):
    kinds = [*changes.KINDS, "real"]
    print(f"\n{'kind':14} {'pairs':>5} {'effect':>6} {'right':>5} {'none':>5} {'wrong':>5} {'ratio: median':>14} {'worst':>7}")
    for kind in [*kinds, None]:
        rows = [it for it in results if kind in (None, it["kind"])]
        if not rows:
            continue
        verdicts, ratios = Counter(it["verdict"] for it in rows), [it["ratio"] for it in rows]
        effects = sum(it["difference"] >= ROUNDING for it in rows)
        print(
            f"{kind or 'all':14} {len(rows):5} {effects:6} {verdicts['right']:5} {verdicts['none']:5} {verdicts['wrong']:5} "
            f"{statistics.median(ratios):14.1f} {max(ratios):7.1f}"
        )
    for verdict in ("wrong", "none"):
        for it in results:
            if it["verdict"] == verdict:
                print(f"{verdict}: {it['folder']}: {it['change']} (differs by {it['difference']:.2g}): {it['because']}")
    unlisted = [it["folder"] for it in results if not it["listed"] and it["report"]]
    if unlisted:
        print(f"not among the differences of the report: {', '.join(unlisted)}")


def self_test():
    """The judgement of reports that are made up."""
    change = {"places": ["plant.body.m", "fmu.plant.start.body.m"], "difference": 0.1}
    still = change | {"difference": 0.0}

    def report(*places, same=False, unexplained=None):
        differences = [{"id": index, "place": place} for index, place in enumerate(places)]
        causes = [{"differences": [it["id"]], "effect": "all"} for it in differences]
        return {"same": same, "differences": differences, "causes": causes, "unexplained": unexplained}

    cases = [
        (report("plant.body.m"), change, "right"),
        (report("plant.body.m_x"), change, "wrong"),
        (report("plant.body.m", "seed"), change, "wrong"),
        (report("estimator.body.m"), change, "wrong"),
        (report(unexplained="the FMU is gone"), change, "none"),
        (report(), change, "none"),
        (report(same=True), change, "wrong"),
        (report(same=True), still, "right"),
        (report("plant.body.m", same=True), still, "wrong"),
        (report("plant.body.m"), still, "wrong"),
        (report("plant.body.m"), change | {"difference": 1e-9}, "right"),
        (report(same=True), change | {"difference": 1e-9}, "right"),
        (report(unexplained="not deterministic"), still, "none"),
    ]
    for index, (made, pair, expected) in enumerate(cases):
        verdict, because = judge(made, pair)
        assert verdict == expected, f"case {index}: expected {expected}, found {verdict}: {because}"
    connection = ["connect.driver.delta -> plant.delta"]
    names = [
        ("connect.driver.delta->plant.delta.gain", connection, True),
        ("connect.driver.delta -> plant.delta_f", connection, False),
        ("connect.plant.delta.gain", [*connection, "connect.plant.delta"], True),
        ("cars/touring/aero.csv", ["cars/touring/aero.csv"], True),
        ("/tmp/b/cars/touring/aero.csv", ["cars/touring/aero.csv"], True),
        ("cars/touring/engine.csv", ["cars/touring/aero.csv"], False),
        ("fmu.plant.library", ["fmu.plant"], True),
        ("fmu.plant_dual", ["fmu.plant"], False),
        ("signal.driver.delta[0].constant", ["signal.driver.delta"], True),
    ]
    for place, truth, expected in names:
        assert names_change(place, truth) == expected, f"{place} of {truth}"
    with tempfile.TemporaryDirectory() as folder:
        a, b = Path(folder, "a.csv"), Path(folder, "b.csv")
        a.write_text("time,x,on\n0,1,true\n0.1,2,true\n")
        tables = [
            ("0,1,true\n0.1,2,true\n", 0.0),
            ("0,1,true\n0.05,9,true\n0.1,2.5,true\n", 0.2),
            ("0,1,true\n0.1,2,false\n", 1.0),
        ]
        for text, expected in tables:
            b.write_text("time,x,on\n" + text)
            assert math.isclose(largest_difference(a, b), expected), text
        # A program that names the place of one pair, and a wrong one for the other.
        fake = Path(folder, "fake")
        fake.write_text(
            "#!/usr/bin/env python3\nimport json, sys\nprint(json.dumps({'same': False, 'differences': [{'id': 0, 'place': 'seed'}],"
            " 'causes': [{'differences': [0], 'effect': 'all', 'text': ''}]}))\nsys.exit(1)\n"
        )
        fake.chmod(0o755)
        for place, expected in [("seed", "right"), ("time.step", "wrong")]:
            pair = {"kind": "seed", "change": "", "scenario": "x", "places": [place], "difference": 0.5, "longer": "x.toml"}
            Path(folder, "pair.json").write_text(json.dumps(pair))
            result = ask(fake, Path(folder), 30.0)
            assert result["verdict"] == expected and result["ratio"] > 0, result
        fake.write_text("#!/bin/sh\necho broken >&2\nexit 2\n")
        assert ask(fake, Path(folder), 30.0)["verdict"] == "none"
    print(f"{len(cases)} judgements and {len(names)} names are as expected")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path, nargs="?", help="the built program, such as target/debug/trackside")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=changes.KINDS, metavar="KIND", help=f"one of {', '.join(changes.KINDS)}")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="keep the pairs there, and take those that are there")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write all results there")
    parser.add_argument("--make-only", action="store_true", help="make the pairs, and ask nothing")
    parser.add_argument("--judge-only", type=Path, metavar="FOLDER", help="ask about the pairs that --keep left")
    parser.add_argument("--scenarios", type=Path, default=Path("scenarios"), help="folder of scenarios [default: %(default)s]")
    parser.add_argument("--fmus", type=Path, help="folder of the packed FMUs [default: fmu beside the program]")
    parser.add_argument("--limit", type=float, default=30.0, help="longest duration of a run [s]")
    parser.add_argument("--steps", type=int, default=10000, help="most steps without manoeuvre [default: %(default)s]")
    parser.add_argument("--real", type=Path, metavar="FOLDER", help="FMUs of the same name in its subfolders instead")
    parser.add_argument("--plants", type=Path, nargs=2, metavar=("OLD", "NEW"), help="two archives of our own plant instead")
    parser.add_argument("--self-test", action="store_true", help="test the judgement and end")
    arguments = parser.parse_args()
    if arguments.self_test:
        self_test()
        return
    if arguments.program is None or not arguments.program.is_file():
        sys.exit(f"no program at {arguments.program}: build it, for example by `cargo build`")
    program = arguments.program.resolve()
    with tempfile.TemporaryDirectory() as temporary:
        folder = (arguments.judge_only or arguments.keep or Path(temporary)).resolve()
        if not arguments.judge_only:
            fmus = arguments.fmus or program.parent / "fmu"
            scenarios = gathered_scenarios(arguments.scenarios.resolve(), fmus, arguments.steps)
            if not scenarios:
                sys.exit("no scenarios here: start this in the root of the repository")
            make_pairs(arguments, program, folder, scenarios)
        if arguments.make_only:
            return
        pairs = sorted(it.parent for it in (folder / "pairs").glob("*/pair.json"))
        if arguments.only:
            pairs = [it for it in pairs if it.name.startswith(arguments.only.replace(" ", "_") + "_")]
        if not pairs:
            sys.exit(f"no pairs in {folder}")
        # Far above the goal of 20 times a run, so that a slow answer is measured, not cut.
        answer = lambda pair: ask(program, pair, 100 * arguments.limit)
        with ThreadPoolExecutor(arguments.jobs) as pool:
            results = list(pool.map(answer, pairs))
    print_results(results)
    if arguments.out:
        arguments.out.write_text(json.dumps(results, indent=1))
    verdicts = Counter(it["verdict"] for it in results)
    sys.exit(verdicts["wrong"] > 0 or verdicts["right"] < RIGHT_SHARE * len(results))


def keep_seed(file, seed):
    """Ends when the folder has the pairs of another seed."""
    if file.exists() and file.read_text() != str(seed):
        sys.exit(f"{file.parent} has the pairs of seed {file.read_text()}, not of {seed}: choose another folder")
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(str(seed))


def make_pairs(arguments, program, folder, scenarios):
    """Makes the pairs that the command line asks for, in `folder/pairs`."""
    if arguments.real or arguments.plants:
        make_real(program, folder, arguments.limit, arguments.real, arguments.plants, scenarios)
        return
    keep_seed(folder / "seed", arguments.seed)
    changes.PACKAGES = archives.workspace_packages(arguments.scenarios.resolve().parent)
    kinds = [arguments.only] if arguments.only else list(changes.KINDS)
    bases, refused = Bases(program, folder / "base", arguments.limit, scenarios), []
    with ThreadPoolExecutor(arguments.jobs) as pool:
        bases.scenarios = [it for it, (_, _, problem) in zip(scenarios, pool.map(bases.run, scenarios)) if not problem]
        makers = {it: make_kind(bases, folder / "pairs", it, arguments.seed, refused) for it in kinds}
        # Round by round, so that an interrupted making has all kinds.
        for first in range(0, arguments.count, len(kinds)):
            asked = kinds[: arguments.count - first]
            for kind, made in zip(asked, pool.map(lambda kind: next(makers[kind], None), asked)):
                if made is None:
                    print(f"{kind}: no other pair", file=sys.stderr)
    (folder / "refused.json").write_text(json.dumps(refused, indent=1))
    for file in (folder / "base").glob("*/run/run.csv"):
        file.unlink()


main()
