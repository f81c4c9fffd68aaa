"""Compares a fitted curve with scipy's: fit_peer.py make CSV | fit_peer.py compare CSV REPORT"""
import json
import sys

import numpy as np
from scipy.optimize import least_squares

TRUTH = np.array([15.0, 2.0, 1.5, 0.8])
LOWER, UPPER = np.array([5.0, 1.0, 0.1, -1.0]), np.array([40.0, 3.0, 2.0, 1.0])


def force(theta, slip):
    b, c, d, e = theta
    u = b * slip
    return d * np.sin(c * np.arctan(u - e * (u - np.arctan(u))))


def jacobian(theta, slip):
    b, c, d, e = theta
    u = b * slip
    bend = u - np.arctan(u)
    v = u - e * bend
    w = np.arctan(v)
    by_v = d * np.cos(c * w) * c / (1 + v * v)
    by_u = by_v * (1 - e + e / (1 + u * u))
    return np.stack([by_u * slip, d * w * np.cos(c * w), np.sin(c * w), -by_v * bend], 1)


if sys.argv[1] == "make":
    random = np.random.default_rng(1)
    slip = np.linspace(-0.6, 0.75, 1000)
    rows = np.stack([np.arange(1000.0), slip, force(TRUTH, slip) + 0.05 * random.standard_normal(1000)], 1)
    np.savetxt(sys.argv[2], rows, delimiter=",", header="t,slip,force", comments="", fmt="%.17g")
else:
    _, slip, measured = np.loadtxt(sys.argv[2], delimiter=",", skiprows=1).T
    fit = least_squares(
        lambda theta: force(theta, slip) - measured, TRUTH, jac=lambda theta: jacobian(theta, slip),
        bounds=(LOWER, UPPER), x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15,
    )
    theta = fit.x
    # The error left by a tolerance on the cost.
    for _ in range(20):
        j = jacobian(theta, slip)
        theta = theta - np.linalg.lstsq(j, force(theta, slip) - measured, rcond=None)[0]
    found = json.load(open(sys.argv[3]))["analyses"]["tire"]
    for method, limit in ("least_squares", 1e-7), ("nelder_mead", 1e-4):
        mean = found[method]["curve"]["mean"]
        distance = np.abs(np.array([mean[name] for name in "BCDE"]) - theta)
        print(method, "differs from scipy's optimum by", distance)
        assert distance.max() < limit, (method, distance)
