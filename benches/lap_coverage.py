#!/usr/bin/env python3
"""Measures how often the interval of the lap time holds the true lap time: simulated drives of cars whose tires are drawn.

usage: lap_coverage.py [--plant same|whole] [--truths N] [--first SEED] [--samples N] [--nodes N] [--jobs N] [--keep DIR] [--program trackside]

Run it in the workspace, with a release build: cargo build --release --package orchestrator --no-default-features

For each truth, a seed, the road gets a friction, and the tires of both axles a friction and a stiffness of their own, within the box of
the identification. The car is driven at
its limit at three speeds by the controller of the limit handling, its sensors are noisy, and `closed_loop` identifies both axles. Then
`trackside lap CAR TRACK --draws tires_draws.csv` gives the interval, with the true values of all that is not identified, and the fastest lap of the
true car is found on the same nodes. `--plant same` drives the single track that the identification has for a model, on the simple formula;
`whole` drives the dual track with its springs, wheels that turn and tires of a file, of which the simple formula is identified.

The table has the share that is held with its 95 % interval (Clopper and Pearson 1934), the width of the intervals, the mean error of their
middle over its standard error, and where the truth ranks among the draws, in ten bins: even where the draws are right. Each truth
stays in `DIR/PLANT.json`, so that a run that was interrupted goes on. The exit code is 0 when the share of `same` is within 90 to 98 %.
"""

import argparse
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
from collections import Counter
from multiprocessing.pool import ThreadPool
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SHEET = ROOT / "scenarios" / "cars" / "data_sheet" / "car.toml"
TRACK = ROOT / "scenarios" / "tracks" / "oval.csv"
WANTED = (0.90, 0.98)
BINS = 10
# Factors to the tires of the sheet: the friction of the road, which both axles have, that of each axle, and its cornering stiffness.
ROAD = (0.85, 1.15)
FRICTION = (0.97, 1.03)
STIFFNESS = (0.8, 1.2)
# The simple formula about which tires are drawn: near the tires of the sheet at the loads of a corner.
SIMPLE = {"tire_f": {"B": 12.0, "C": 1.5, "D": 1.10, "E": 0.3}, "tire_r": {"B": 12.5, "C": 1.5, "D": 1.13, "E": 0.3}}
# The body of the sheet [SI units].
BODY = {"m": 1250.0, "I_zz": 1850.0, "l_f": 1.18, "l_r": 1.27, "h": 0.47}
AERO = {"rho": 1.225, "area": 1.95, "C_d": 0.34, "C_lf": 0.05, "C_lr": 0.08}
BRAKE_FRONT_SHARE = 0.63
G = 9.81
# Standard deviations of what the sensors add [SI units]: those of the limit handling.
NOISE = {"v_x": 0.05, "v_y": 0.01, "r": 0.01, "a_y": 0.1}
# Of the multisines [Hz], and the share of each: those of the limit handling.
FREQUENCIES, WEIGHTS = [0.25, 0.45, 0.7, 1.0, 1.4], [1.0, 0.8, 0.6, 0.5, 0.35]
SPEEDS = (15.0, 25.0, 35.0)
# Times of a speed [s]: to reach it, two multisines, and flicks with the speed reference as a square wave.
REACH, GENTLE, HARD, FLICKS = 3.5, 6.0, 6.0, 8.0
# Lateral acceleration that is asked for over that at the limit: below it, beyond it, and far beyond, as in the limit handling.
ASKED = {"gentle": 0.56, "hard": 1.06, "flicks": 1.19}


def table(name, values):
    """A table of TOML."""
    lines = "".join(f"{key} = {json.dumps(value)}\n" for key, value in values.items())
    return f"[{name}]\n{lines}"


def drawn_tires(seed):
    """Factors to friction and stiffness of both axles, and the simple formula that has them."""
    chance = random.Random(seed)
    road = chance.uniform(*ROAD)
    factors, simple = {}, {}
    for axle, tire in SIMPLE.items():
        friction, stiffness = road * chance.uniform(*FRICTION), chance.uniform(*STIFFNESS)
        factors[axle] = {"friction": friction, "stiffness": stiffness}
        # K = B C D is stiffness times that of the sheet.
        simple[axle] = {**tire, "B": tire["B"] * stiffness / friction, "D": tire["D"] * friction}
    return factors, simple


class Single:
    """The car of the sheet as a single track on the simple formula: the model of the identification."""

    crate = "plant-fmu"

    def car(self, tires=None):
        """Its file, with these tires by the simple formula."""
        drive = {"front_share": 0.0, "power_max": 190e3}
        text = table("body", BODY) + table("aero", AERO)
        text += table("brake", {"front_share": BRAKE_FRONT_SHARE}) + table("drive", drive)
        return text + "".join(table(axle, it) for axle, it in (tires or {}).items())

    def true_car(self, factors, simple):
        """Its file with the true tires."""
        return self.car(simple)


class Whole(Single):
    """The car of the sheet as it is: springs, wheels that turn, camber and toe, a differential, and tires of a file."""

    crate = "plant-dual-fmu"

    def car(self, tires=None):
        text = re.sub(r"(?ms)^\[tire_[fr]\]\n[^[]*", "", SHEET.read_text())
        return text + "".join("\n" + table(axle, it) for axle, it in (tires or {}).items())

    def true_car(self, factors, simple):
        text = self.car()
        for axle, file in (("tire_f", "front"), ("tire_r", "rear")):
            it = factors[axle]
            path = SHEET.parent.parent / "sport" / f"{file}.tir"
            text += f"\n[{axle}]\ntir = {{ text_of = {json.dumps(str(path))} }}\n"
            text += "".join(f"{key} = {it['friction']}\n" for key in ("LMUX", "LMUY"))
            text += "".join(f"{key} = {it['stiffness']}\n" for key in ("LKX", "LKY"))
        return text


PLANTS = {"same": Single(), "whole": Whole()}


def references(limit):
    """Signals of speed and yaw rate, of a car that corners with at most `limit` [m/s2], and the time at which they end [s]."""
    times, values, speed, yaw = [0.0], [SPEEDS[0]], "", ""
    begin = 0.0
    for number, v in enumerate(SPEEDS):
        gentle = begin + (REACH if number else 1.0)
        hard, flicks = gentle + GENTLE, gentle + GENTLE + HARD
        end = flicks + FLICKS
        times += [gentle, end]
        values += [v, v]
        part = '[[signal.part]]\nfrom = {}\nuntil = {}\nfade_out = 0.5\n{}\n'
        speed += part.format(flicks, end, "square = { amplitude = 3.0, period = 2.0, phase = 2.513274 }")
        for start, stop, asked in ((gentle, hard, "gentle"), (hard, flicks, "hard")):
            sines = f"frequencies = {FREQUENCIES}, weights = {WEIGHTS}"
            sines = f"multisine = {{ peak = {ASKED[asked] * limit / v}, {sines} }}"
            yaw += part.format(start, stop, "fade_in = 0.5\n" + sines)
        yaw += part.format(flicks, end, f"square = {{ amplitude = {ASKED['flicks'] * limit / v}, period = 4.0, sharpness = 3.0 }}")
        begin = end
    held = f"[[signal.part]]\ntable = {{ time = {times}, value = {values} }}\n"
    text = f'[[signal]]\nname = "reference.v"\nunit = "m/s"\n{held}{speed}'
    return text + f'[[signal]]\nname = "reference.r"\nunit = "rad/s"\n{yaw}', begin


def drive(plant, seed, simple):
    """The scenario: the drive of the car on these tires, its noisy sensors, and the identification."""
    signals, end = references(min(tire["D"] for tire in simple.values()) * G)
    weight, base = BODY["m"] * G, BODY["l_f"] + BODY["l_r"]
    # Stiffnesses [N/rad] that are too low, as of one who has not measured them.
    nominal = {"C_f": 15.0 * weight * BODY["l_r"] / base, "C_r": 15.0 * weight * BODY["l_f"] / base}
    car = table("start.body", {key: BODY[key] for key in ("m", "I_zz", "l_f", "l_r")}) + table("start.nominal", nominal)
    car = car.replace("[start", "[fmu.start")
    text = f'title = "A drive at the limit"\nseed = {seed}\n[time]\nstep = 0.01\nstop = {end}\n'
    text += f'[[fmu]]\nname = "plant"\ncrate = "{plant.crate}"\nparameters = "car.toml"\nunused = "tell"\n'
    text += f"start = {{ start.v_x = {SPEEDS[0]} }}\n"
    text += f'[[fmu]]\nname = "estimator"\ncrate = "estimator"\n[fmu.start]\nstart.v_x = {SPEEDS[0]}\n{car}'
    limits = "limit.F_x_min = -6000.0\nlimit.F_x_max = 5000.0\n"
    text += f'[[fmu]]\nname = "controller"\ncrate = "controller"\n[fmu.start]\nmode = 0\npsi_ref = 0.0\n{limits}{car}{signals}'
    wire = '[[connect]]\nfrom = "{}"\nto = "{}"\n{}\n'
    for name in ("F_x", "delta"):
        for node in ("plant", "estimator"):
            text += wire.format(f"controller.{name}", f"{node}.{name}", 'at = "start"')
    for name, std in NOISE.items():
        text += wire.format(f"plant.{name}", f"estimator.{name}_meas", f"noise = {{ std = {std} }}")
    for name in "vr":
        text += wire.format(f"reference.{name}", f"controller.{name}_ref", 'at = "end"')
    text += wire.format("plant.psi", "controller.psi", "")
    for name in ("v_x", "v_y", "r", "xi_x", "xi_y", "xi_psi"):
        text += wire.format(f"estimator.{name}", f"controller.{name}", "")
    taken = {name: f"estimator.{name}_meas" for name in NOISE}
    taken |= {name: f"estimator.{name}" for name in ("F_x", "delta")}
    # A model that does not fit is a result: `whole` has more than the model of the identification.
    text += '[[analysis]]\nname = "tires"\ncrate = "identify"\nexpect = "any"\n'
    text += table("analysis.signals", taken) + table("analysis.config", {"task": "closed_loop", "node": "plant"})
    car = {"exact": True, "brake_front_share": BRAKE_FRONT_SHARE}
    text += table("analysis.config.car", car) + table("analysis.config.car.body", BODY)
    return text + table("analysis.config.car.aero", AERO)


def called(program, words, folder, environment, codes):
    """Runs a command in the workspace; what it says where it fails is the error."""
    ended = subprocess.run(
        [program, *map(str, words)], cwd=ROOT, capture_output=True, text=True, env=environment, check=False
    )
    (folder / f"{words[0]}.txt").write_text(ended.stdout + ended.stderr)
    if ended.returncode not in codes:
        raise RuntimeError(f"trackside {words[0]}: {(ended.stderr or ended.stdout).strip()[-400:]}")


def lap(arguments, folder, environment, name, more=()):
    """Numbers of the fastest lap of a car in the folder."""
    out = folder / f"lap_{name}"
    words = ["lap", folder / f"{name}.toml", TRACK, "--nodes", arguments.nodes, "--out", out, *more]
    called(arguments.program, words, folder, environment, (0,))
    return json.loads((out / "lap.json").read_text())


def measure(arguments, folder, seed):
    """What becomes of one truth."""
    plant = PLANTS[arguments.plant]
    environment = dict(os.environ)
    if arguments.jobs > 1:
        environment["RAYON_NUM_THREADS"] = "1"
    factors, simple = drawn_tires(seed)
    truth = plant.true_car(factors, simple)
    (folder / "car.toml").write_text(truth)
    (folder / "drive.toml").write_text(drive(plant, seed, simple))
    found = {"factors": factors}
    try:
        found["truth"] = lap(arguments, folder, environment, "car")["lap_time"]
        words = ["run", folder / "drive.toml", "--rerun", "off", "--out", folder / "run"]
        called(arguments.program, words, folder, environment, (0,))
        report = json.loads((folder / "run" / "report.json").read_text())["analyses"]["tires"]
        found["fits"] = report["model"]["verdict"] == "fits"
        curves = {"tire_f": report["pem"]["front"], "tire_r": report["pem"]["rear"]}
        found["found"] = {axle: it["mean"] for axle, it in curves.items()}
        found["std"] = {axle: it["std"] for axle, it in curves.items()}
        # The lap from which those of the draws start is that of the tires that were found.
        shape = lambda it: {key: it["mean"][key] for key in "BCDE"}
        (folder / "found.toml").write_text(plant.car({axle: shape(it) for axle, it in curves.items()}))
        file = folder / "run" / "tires_draws.csv"
        if not file.exists():
            raise RuntimeError(next(it for it in report["summary"] if it.startswith("No draws")))
        draws = ["--draws", file, "--samples", arguments.samples]
        laps = lap(arguments, folder, environment, "found", draws)
        found |= {"middle": laps["lap_time"], **laps["interval"]}
        # The true lap once more, from the same lap as those of the draws: of near minima it may be another one.
        columns = [f"{axle}.{key}" for axle in simple for key in "BCDE"]
        values = [str(simple[axle][key]) for axle in simple for key in "BCDE"]
        if arguments.plant == "same":
            (folder / "true.csv").write_text(",".join(columns) + "\n" + ",".join(values) + "\n")
            again = lap(arguments, folder, environment, "found", ["--draws", folder / "true.csv"])
            found["truth_from_found"] = again["interval"]["lap_times"][0]
    except (RuntimeError, OSError, KeyError) as error:
        found["error"] = str(error).replace(str(folder), "")
    return found


def binomial_tail(count, least, share):
    """Probability of `least` successes or more of `count`."""
    if share in (0.0, 1.0):
        return 1.0 if least == 0 or share == 1.0 else 0.0
    term = lambda k: math.lgamma(count + 1) - math.lgamma(k + 1) - math.lgamma(count - k + 1)
    log = lambda k: term(k) + k * math.log(share) + (count - k) * math.log1p(-share)
    return sum(math.exp(log(k)) for k in range(least, count + 1))


def clopper_pearson(held, count):
    """The 95 % interval of a share (Clopper and Pearson, Biometrika 26, 1934), by bisection."""

    def where(rises):
        low, high = 0.0, 1.0
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if rises(middle) else (middle, high)
        return low

    lower = where(lambda share: binomial_tail(count, held, share) >= 0.025) if held else 0.0
    upper = where(lambda share: 1.0 - binomial_tail(count, held + 1, share) <= 0.025) if held < count else 1.0
    return lower, upper


def told(plant, results, samples):
    """Prints the table; the share that is held."""
    laps = [it for it in results if "quantiles" in it]
    fit = sum(it.get("fits", False) for it in results)
    print(f"{plant}: {len(laps)} of {len(results)} truths have an interval, and the model of the identification fits {fit}")
    for error, count in Counter(it["error"] for it in results if "error" in it).items():
        print(f"  {count} without: {error}")
    if len(laps) < 2:
        return 0.0
    holds = lambda it: it["quantiles"][0] <= it["truth"] <= it["quantiles"][2]
    held = sum(map(holds, laps))
    low, high = clopper_pearson(held, len(laps))
    widths = [it["quantiles"][2] - it["quantiles"][0] for it in laps]
    errors = [it["quantiles"][1] - it["truth"] for it in laps]
    standard_error = statistics.stdev(errors) / math.sqrt(len(errors))
    mean = statistics.mean(errors)
    unsolved = sum(it["unsolved"] for it in laps)
    share = lambda it: sum(time < it["truth"] for time in it["lap_times"]) / len(it["lap_times"])
    counts = [0] * BINS
    for it in laps:
        counts[min(int(BINS * share(it)), BINS - 1)] += 1
    # Near minima: the same car from another start may end in another one.
    moved = [it["truth_from_found"] - it["truth"] for it in laps if "truth_from_found" in it]
    near = [it for it in laps if "truth_from_found" in it]
    kept = sum(it["quantiles"][0] <= it["truth_from_found"] <= it["quantiles"][2] for it in near)
    again = f"{kept} of {len(near)} held; {max(map(abs, moved), default=0.0):.4f} s off at most"
    percent = statistics.median(100.0 * width / it["truth"] for width, it in zip(widths, laps))
    rows = [
        ("lap time held", f"{held} of {len(laps)}: {100 * held / len(laps):.1f} % [{100 * low:.1f}, {100 * high:.1f}]"),
        ("lap time, median", f"{statistics.median(it['truth'] for it in laps):.3f} s"),
        ("width of the interval, median", f"{statistics.median(widths):.4f} s, {percent:.3f} % of the lap"),
        ("mean error", f"{mean:+.4f} s, {mean / standard_error:+.1f} standard errors"),
        ("truth from the lap of the draws", again),
        ("root mean square error", f"{math.sqrt(statistics.mean(it * it for it in errors)):.4f} s"),
        ("rank of the truth, ten bins", " ".join(map(str, counts))),
        ("draws that were not solved", f"{unsolved} of {samples * len(laps)}"),
    ]
    for name, value in rows:
        print(f"  {name:30} {value}")
    return held / len(laps)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plant", choices=PLANTS, default="same")
    parser.add_argument("--truths", type=int, default=100)
    parser.add_argument("--first", metavar="SEED", type=int, default=1)
    parser.add_argument("--samples", type=int, default=100)
    parser.add_argument("--nodes", type=int, default=100)
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--program", default="target/release/trackside", type=os.path.abspath)
    arguments = parser.parse_args()
    seeds = range(arguments.first, arguments.first + arguments.truths)
    with tempfile.TemporaryDirectory() as temporary:
        keep = arguments.keep or Path(temporary)
        keep.mkdir(parents=True, exist_ok=True)
        file = keep / f"{arguments.plant}.json"
        settings = {"samples": arguments.samples, "nodes": arguments.nodes}
        kept = json.loads(file.read_text()) if file.exists() else {"settings": settings, "truths": {}}
        if kept["settings"] != settings:
            sys.exit(f"{file}: is of {kept['settings']}, expected {settings}")

        def one(seed):
            folder = Path(temporary) / f"{arguments.plant}_{seed}"
            folder.mkdir()
            found = measure(arguments, folder, seed)
            shutil.rmtree(folder)
            return seed, found

        missing = [seed for seed in seeds if str(seed) not in kept["truths"]]
        with ThreadPool(arguments.jobs) as pool:
            for seed, found in pool.imap_unordered(one, missing):
                kept["truths"][str(seed)] = found
                written = file.with_suffix(".partial")
                written.write_text(json.dumps(kept, indent=1))
                written.replace(file)
        results = [kept["truths"][str(seed)] for seed in seeds]
    share = told(arguments.plant, results, arguments.samples)
    sys.exit(arguments.plant == "same" and not WANTED[0] <= share <= WANTED[1])


if __name__ == "__main__":
    main()
