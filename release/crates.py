#!/usr/bin/env python3
"""Package the libraries for the registry of Rust, as `trackside-*`, or publish them.

    python3 release/crates.py [--verify] [--publish]

The names `units`, `tire` or `plugin` are not free, so a copy of the libraries below `target/crates` has others; in code they keep
theirs. Without arguments nothing is compiled: cargo checks manifests, versions and files. `--verify` builds each package by itself.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WORK = ROOT / "target" / "crates"
LIBRARIES = ["fmu-import", "fmu-export", "cosim", "kalman", "tire", "units", "expression", "plugin"]
PREFIX = "trackside-"


def main() -> None:
    """Copy, and call cargo."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--verify", action="store_true", help="build each package from its own files")
    parser.add_argument("--publish", action="store_true", help="publish them, the ones that others need first")
    arguments = parser.parse_args()
    workspace = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]
    crates = needed(LIBRARIES)
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    (WORK / "Cargo.toml").write_text(workspace_manifest(workspace, crates))
    shutil.copy2(ROOT / "Cargo.lock", WORK / "Cargo.lock")
    for name in crates:
        copy_crate(name, workspace)
    command = ["cargo", "publish" if arguments.publish else "package", "--workspace", "--allow-dirty"]
    command += [] if arguments.verify or arguments.publish else ["--no-verify"]
    code = subprocess.run(command, cwd=WORK).returncode
    if code != 0:
        sys.exit(f"expected exit code 0, found {code}: {' '.join(command)}")
    for file in sorted((WORK / "target" / "package").glob("*.crate")):
        print(f"{file.stat().st_size / 1e3:8.1f} kB  {file.name}")


def manifest(name: str) -> dict[str, object]:
    """The manifest of a crate."""
    return tomllib.loads((ROOT / "crates" / name / "Cargo.toml").read_text())


def needed(names: list[str]) -> list[str]:
    """These crates of ours and all that they need; tests need none, as they are not published."""
    found, left = set(), list(names)
    while left:
        name = left.pop()
        if name not in found:
            found.add(name)
            uses = manifest(name).get("dependencies", {})
            left += [use for use in uses if (ROOT / "crates" / use).is_dir()]
    return sorted(found)


def workspace_manifest(workspace: dict[str, dict[str, object]], crates: list[str]) -> str:
    """The manifest above the copies: the same versions and lints, without what is not copied."""
    text = (ROOT / "Cargo.toml").read_text()
    version = workspace["package"]["version"]
    lines = ["[workspace]", 'resolver = "3"', f"members = {crates!r}", ""]
    kept = False
    for line in text.splitlines():
        if line.startswith("["):
            kept = line.startswith("[workspace.")
        ours = re.match(r'([a-z0-9-]+) = \{ path = "crates/([a-z0-9-]+)"', line)
        if not kept or line == "publish = false" or (ours and ours[2] not in crates):
            continue
        if ours:
            line = line.replace(f'path = "crates/{ours[2]}"', f'package = "{PREFIX}{ours[2]}", version = "{version}", path = "{ours[2]}"')
        lines.append(line)
    return "\n".join(lines) + "\n"


def copy_crate(name: str, workspace: dict[str, dict[str, object]]) -> None:
    """Copy a crate without its tests and benches, under its name of the registry."""
    source, copy = ROOT / "crates" / name, WORK / name
    ignored = shutil.ignore_patterns("target", "tests", "benches", "tests.rs")
    shutil.copytree(source, copy, ignore=ignored)
    shutil.copy2(ROOT / "LICENSE", copy / "LICENSE")
    text = (source / "Cargo.toml").read_text()
    text = re.sub(r"\n\[\[(test|bench)\]\]\n(.+\n)*", "\n", text)
    text = re.sub(r"\n\[dev-dependencies\]\n(.+\n)*", "\n", text)
    text = text.replace(f'name = "{name}"\n', f'name = "{PREFIX}{name}"\n', 1).replace("publish.workspace = true\n", "")
    if "repository" in workspace["package"]:
        text = text.replace("license.workspace = true\n", "license.workspace = true\nrepository.workspace = true\n")
    library = f'[lib]\nname = "{name.replace("-", "_")}"\n'
    text = text.replace("[lib]\n", library) if "[lib]\n" in text else f"{text}\n{library}"
    (copy / "Cargo.toml").write_text(text)


if __name__ == "__main__":
    main()
