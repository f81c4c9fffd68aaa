#!/usr/bin/env python3
"""Compares the published posterior with dense NUTS on the same points, at five levels of excitation.

usage: nuts_peers.py PATH_TO_svi_csv [SAMPLES]

`svi_csv` is the example of this crate, built with --release. Needs numpyro and jax. NUTS has no way between modes far
apart: two chains that differ by more than a tenth of a standard deviation are told, and then the comparison says nothing.
"""
import json
import os
import subprocess
import sys
import tempfile
import time

os.environ.setdefault("JAX_PLATFORMS", "cpu")
import jax
import jax.numpy as jnp
import numpy as np
import numpyro
import numpyro.distributions as dist
from numpyro.infer import MCMC, NUTS

jax.config.update("jax_enable_x64", True)
TRUTH = (15.0, 2.0, 1.5, 0.8)
LEVELS = (0.02, 0.08, 0.2, 0.75, 1.0)
NAMES = ("B", "C", "D", "E", "K")


def curve(b, c, d, e, slip):
    u = b * slip
    return d * jnp.sin(c * jnp.arctan(u - e * (u - jnp.arctan(u))))


def model(slip, force):
    b = numpyro.sample("B", dist.Uniform(5.0, 40.0))
    c = numpyro.sample("C", dist.Uniform(1.0, 3.0))
    d = numpyro.sample("D", dist.Uniform(0.1, 2.0))
    e = numpyro.sample("E", dist.Uniform(-1.0, 1.0))
    # As wide as the prior 1/sigma that ours has.
    sigma = numpyro.sample("sigma", dist.LogUniform(1e-3, 1.0))
    numpyro.sample("force", dist.Normal(curve(b, c, d, e, slip), sigma), obs=force)


def nuts(slip, force):
    kernel = NUTS(model, dense_mass=True, target_accept_prob=0.98, max_tree_depth=10)
    chains = MCMC(kernel, num_warmup=2000, num_samples=5000, num_chains=2, chain_method="sequential", progress_bar=False)
    begin = time.perf_counter()
    chains.run(jax.random.PRNGKey(0), slip, force)
    seconds = time.perf_counter() - begin
    draws = chains.get_samples(group_by_chain=True)
    draws["K"] = draws["B"] * draws["C"] * draws["D"]
    draws = np.stack([np.asarray(draws[name]) for name in NAMES], axis=-1)
    return draws, seconds


def main():
    program, count = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 1500
    with tempfile.TemporaryDirectory() as folder:
        for level in LEVELS:
            random = np.random.default_rng(7)
            slip = level * (np.arange(count) + 0.5) / count
            force = np.asarray(curve(*TRUTH, slip)) + 0.05 * random.standard_normal(count)
            file = os.path.join(folder, "points.csv")
            np.savetxt(file, np.column_stack([slip, force]), delimiter=",", header="slip,force", comments="", fmt="%.17g")
            output = subprocess.run([program, file], capture_output=True, check=True, text=True).stdout
            ours = json.loads(output)["exact"]
            draws, seconds = nuts(slip, force)
            whole = draws.reshape(-1, len(NAMES))
            mean, std = whole.mean(axis=0), whole.std(axis=0, ddof=1)
            apart = np.max(np.abs(draws[0].mean(axis=0) - draws[1].mean(axis=0)) / std)
            told = ", ".join(f"{name} {(ours['mean'][name] - mean[i]) / std[i]:+.3f} x{ours['std'][name] / std[i]:.3f}"
                             for i, name in enumerate(NAMES))
            print(f"{100 * level:5.0f} %: {told}; chains {apart:.2f} std apart; ours {ours['seconds']:.3f} s, "
                  f"NUTS {seconds:.0f} s", flush=True)


if __name__ == "__main__":
    main()
