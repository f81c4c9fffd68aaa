#!/usr/bin/env python3
"""Gather all that an installation without network needs: the wheel, what it depends on, and the Rerun viewer of its version.

    python3 python/bundle.py WHEEL FOLDER [--python 3.12]... [--extra viewer]... [--glibc 2.28]

The machine without network then has `pip install --no-index --find-links FOLDER "trackside[viewer]"`.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

OLDEST_GLIBC = 17


def main() -> None:
    """Download for each Python, and print what the folder has."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("wheel", type=Path)
    parser.add_argument("folder", type=Path)
    this = f"{sys.version_info.major}.{sys.version_info.minor}"
    parser.add_argument("--python", action="append", help=f"a Python of the other machine, repeated for several (default: {this})")
    parser.add_argument("--extra", action="append", help="an extra of the wheel, repeated for several (default: viewer)")
    parser.add_argument("--glibc", default="2.28", help="that of the other machine (default: %(default)s)")
    arguments = parser.parse_args()
    wheel = arguments.wheel.resolve(strict=True)
    extras = ",".join(arguments.extra or ["viewer"])
    machine = "aarch64" if wheel.stem.endswith("aarch64") else "x86_64"
    newest = int(arguments.glibc.partition(".")[2])
    platforms = [f"manylinux_2_{minor}_{machine}" for minor in range(newest, OLDEST_GLIBC - 1, -1)] + [f"manylinux2014_{machine}"]
    for python in arguments.python or [this]:
        command = [sys.executable, "-m", "pip", "download", "--quiet", "--only-binary", ":all:", "--python-version", python]
        command += [word for platform in platforms for word in ("--platform", platform)]
        code = subprocess.run([*command, "--dest", arguments.folder, f"{wheel}[{extras}]"]).returncode
        if code != 0:
            sys.exit(f"expected wheels for Python {python} with {extras}, found exit code {code} of pip")
    files = sorted(arguments.folder.iterdir())
    for file in files:
        print(f"{file.stat().st_size / 1e6:7.1f} MB  {file.name}")
    print(f"{sum(file.stat().st_size for file in files) / 1e6:7.1f} MB  together")
    print(f'pip install --no-index --find-links {arguments.folder} "trackside[{extras}]"')


if __name__ == "__main__":
    main()
