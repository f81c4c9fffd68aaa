"""Makes an environment for the Python packages that a comparison needs."""

import subprocess
import sys
import venv
from pathlib import Path


def environment(folder, packages):
    """The Python of an environment in a folder with packages, which are installed there; without a folder this Python."""
    if folder is None:
        return sys.executable
    python = Path(folder) / "bin" / "python"
    if not python.exists():
        venv.create(folder, with_pip=True)
    for package in packages:
        command = [python, "-m", "pip", "install", "--quiet", package]
        if subprocess.run(command).returncode:
            print(f"{package} cannot be installed", file=sys.stderr)
    return str(python)
