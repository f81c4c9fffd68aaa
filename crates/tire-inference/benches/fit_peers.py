#!/usr/bin/env python3
"""Compares the fit of one tire curve with SciPy on the same file, in one run, turn by turn.

usage: fit_peers.py PATH_TO_fit_csv [REPEATS]

`fit_csv` is the example of this crate, built with --release. Both sides start from the same values and exclude reading the
file. SciPy and its BLAS use one thread; ours uses RAYON_NUM_THREADS (1 unless set).
"""
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS"):
    os.environ.setdefault(variable, "1")
import numpy as np
from scipy.optimize import least_squares, minimize

TRUTH = np.array([15.0, 2.0, 1.5, 0.8])
LOWER, UPPER = np.array([5.0, 1.0, 0.1, -1.0]), np.array([40.0, 3.0, 2.0, 1.0])
START = np.array([20.0, 1.5, 1.0, 0.0])


def curve(theta, slip):
    b, c, d, e = theta
    u = b * slip
    return d * np.sin(c * np.arctan(u - e * (u - np.arctan(u))))


def jacobian(theta, slip):
    b, c, d, e = theta
    u = b * slip
    bend = u - np.arctan(u)
    v = u - e * bend
    w = np.arctan(v)
    by_v = d * c * np.cos(c * w) / (1 + v * v)
    by_u = by_v * (1 - e + e / (1 + u * u))
    return np.stack([by_u * slip, d * np.cos(c * w) * w, np.sin(c * w), -by_v * bend], axis=1)


def trf(slip, force):
    return least_squares(lambda t: curve(t, slip) - force, START, jac=lambda t: jacobian(t, slip), bounds=(LOWER, UPPER),
                         x_scale="jac", xtol=1e-12, ftol=1e-14, gtol=1e-12).x


def stationary(slip, force, theta):
    """The optimum to the last digits: steps of Gauss and Newton see the gradient, where TRF ends at the rounding of the cost."""
    for _ in range(200):
        theta = theta - np.linalg.lstsq(jacobian(theta, slip), curve(theta, slip) - force, rcond=None)[0]
    return theta


def simplex(slip, force):
    cost = lambda t: 0.5 * np.sum((curve(t, slip) - force) ** 2)
    return minimize(cost, START, method="Nelder-Mead", bounds=list(zip(LOWER, UPPER)),
                    options=dict(xatol=1e-9, fatol=1e-12, maxiter=4000, maxfev=4000)).x


def clocked(fit, *arguments):
    begin = time.perf_counter()
    theta = fit(*arguments)
    return theta, time.perf_counter() - begin


def ours(program, file, *options):
    start = [str(x) for x in START]
    output = json.loads(subprocess.run([program, *options, file, *start], capture_output=True, check=True, text=True).stdout)
    return np.array(output["theta"]), output["seconds"]


def compare(program, count, repeats, folder):
    random = np.random.default_rng(1)
    slip = 0.75 * (np.arange(count) + 0.5) / count
    force = curve(TRUTH, slip) + 0.05 * random.standard_normal(count)
    file = os.path.join(folder, f"{count}.csv")
    np.savetxt(file, np.column_stack([slip, force]), delimiter=",", header="slip,force", comments="", fmt="%.17g")
    ways = {
        "ours": lambda: ours(program, file),
        "our Nelder-Mead": lambda: ours(program, file, "--nelder-mead"),
        "SciPy TRF": lambda: clocked(trf, slip, force),
        "SciPy Nelder-Mead": lambda: clocked(simplex, slip, force),
    }
    seconds, theta = {name: [] for name in ways}, {}
    for _ in range(repeats):
        for name, way in ways.items():
            theta[name], time_taken = way()
            seconds[name].append(time_taken)
    median = {name: statistics.median(times) for name, times in seconds.items()}
    optimum = stationary(slip, force, theta["SciPy TRF"])
    for name in ways:
        distance = np.max(np.abs(theta[name] - optimum))
        ratio = median[name] / median["ours"]
        print(f"N={count:7d} {name:18s} median {1e3 * median[name]:9.3f} ms (least {1e3 * min(seconds[name]):9.3f}) = "
              f"{ratio:7.1f} x ours, distance from the optimum {distance:.1e}")


def main():
    program, repeats = os.path.abspath(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 7
    with tempfile.TemporaryDirectory() as folder:
        for count in (1_000, 100_000):
            compare(program, count, repeats, folder)


if __name__ == "__main__":
    main()
