#!/usr/bin/env python3
"""Compares variational inference with that of NumPyro, on the same CSV files, in turns: time, and distance from the posterior.

    python3 -m venv VENV && VENV/bin/pip install numpyro==0.17.0 jax==0.5.0 scipy
    cargo build --release -p tire-inference --example svi_csv
    VENV/bin/python crates/tire-inference/benches/svi_peers.py PATH/release/examples/svi_csv PATH/pyro_svi_baseline.py [REPEATS] [STEPS]

Tells wall time, and in brackets processor time, which counts on a busy machine. The peer is a program that prints JSON with `svi`: {mean, std, wall_s, cpu_s} for a file with the columns slip and force, and
takes --only svi and --steps: the method of Goblirsch et al. (IV 2025), a normal distribution over B, C, D and E, whose steps
(50,000 unless given here) are Adam's. Both exclude reading the file; its time holds its compilation, ours the fit that it
starts from. "Exact" is the posterior from our grid, which the tests compare with brute force.
"""
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile

os.environ.setdefault("RAYON_NUM_THREADS", "1")
import numpy as np

TRUTH = (15.0, 2.0, 1.5, 0.8)
NAMES = ("B", "C", "D", "E")


def curve(theta, slip):
    b, c, d, e = theta
    u = b * slip
    return d * np.sin(c * np.arctan(u - e * (u - np.arctan(u))))


def output(*command):
    return json.loads(subprocess.run(command, capture_output=True, check=True, text=True).stdout)


def processor(program, file):
    """Processor time of one of our fits [s]: what 40 more of them take."""
    spent = []
    for fits in ("1", "41"):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        output(program, file, fits)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        spent.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return (spent[1] - spent[0]) / 40


def against(exact, mean, std):
    """Error of each mean in standard deviations of the posterior, and ratio of the standard deviations."""
    return "  ".join(f"{name} {(mean[name] - exact['mean'][name]) / exact['std'][name]:+6.2f} x{std[name] / exact['std'][name]:.2f}"
                     for name in NAMES)


def compare(program, peer, repeats, steps, level, folder):
    # As many points, as evenly spread, as the peer makes of any file.
    slip = np.linspace(0.0, level, 1500)
    force = curve(TRUTH, slip) + 0.05 * np.random.default_rng(42).standard_normal(len(slip))
    file = os.path.join(folder, f"{level}.csv")
    np.savetxt(file, np.column_stack([slip, force]), delimiter=",", header="slip,force", comments="", fmt="%.17g")
    own, other = [], []
    for _ in range(repeats):
        own.append(output(program, file))
        other.append(output(sys.executable, peer, file, "--only", "svi", "--steps", str(steps))["svi"])
    ours, cpu, wall = (statistics.median(times) for times in
                       ([run["seconds"] for run in own], [run["cpu_s"] for run in other], [run["wall_s"] for run in other]))
    busy = processor(program, file)
    last, theirs, told = own[-1], other[-1], own[-1]["svi"]
    print(f"slip to {100 * level:.0f} %, load {os.getloadavg()[0]:.1f}: ours {1e3 * ours:.1f} ms ({1e3 * busy:.1f} ms of processor), {told['steps']} steps, {told['status']}; "
          f"peer {wall:.2f} s ({cpu:.2f} s of processor) = {wall / ours:.0f} x ({cpu / busy:.0f} x) ours")
    print(f"  ours      {against(last['exact'], told['mean'], told['std'])}   k-hat {told['k_hat']:.2f}, trusted: {told['trusted']}")
    print(f"  peer      {against(last['exact'], dict(zip(NAMES, theirs['mean'])), dict(zip(NAMES, theirs['std'])))}")
    published = last["published"]
    print(f"  published {against(last['exact'], published['mean'], published['std'])}   {published['source']}, with verdicts "
          f"{1e3 * published['seconds']:.0f} ms", flush=True)


def main():
    program, peer = (os.path.abspath(path) for path in sys.argv[1:3])
    repeats, steps = (int(sys.argv[k]) if len(sys.argv) > k else usual for k, usual in ((3, 3), (4, 50_000)))
    with tempfile.TemporaryDirectory() as folder:
        for level in (0.02, 0.08, 0.2, 0.75, 1.0):
            compare(program, peer, repeats, steps, level, folder)


if __name__ == "__main__":
    main()
