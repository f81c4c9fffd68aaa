#!/usr/bin/env python3
"""Package the libraries for the registry of Rust, as `trackside-*`, or publish them; list what they offer.

    python3 release/crates.py [--verify] [--publish]
    python3 release/crates.py --api [--check]
    python3 release/crates.py --semver [--since COMMIT]

The names `units`, `tire` or `plugin` are not free, so a copy of the libraries below `target/crates` has others; in code they keep
theirs. Without arguments nothing is compiled: cargo checks manifests, versions and files. `--verify` builds each package by itself.

`--api` writes the public interface of each library to `release/api`, one line for each item. With `--check` it compares instead, and
prints what differs. It needs cargo-public-api in the path. `--semver` has cargo-semver-checks compare
each library with the version that is published, or with a commit, and ends if the new version promises more than it holds.
"""

from __future__ import annotations

import argparse
import difflib
import json
import os
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
LISTINGS = ROOT / "release" / "api"
# The one that reads what rustdoc 1.95 writes (format 57); a newer Rust wants a newer one, here and in .ci/run.
PUBLIC_API = "0.52.0"


def main() -> None:
    """Copy, and call cargo."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--verify", action="store_true", help="build each package from its own files")
    parser.add_argument("--publish", action="store_true", help="publish them, the ones that others need first")
    parser.add_argument("--api", action="store_true", help="write the listings of the public interfaces")
    parser.add_argument("--check", action="store_true", help="with --api: compare with the listings, and write nothing")
    parser.add_argument("--semver", action="store_true", help="compare with the published versions")
    parser.add_argument("--since", metavar="COMMIT", help="with --semver: compare with a commit in place of the published versions")
    arguments = parser.parse_args()
    if arguments.api:
        api(arguments.check)
        return
    if arguments.semver and arguments.since:
        packages = [word for name in LIBRARIES for word in ("--package", name)]
        run(["cargo", "semver-checks", "--all-features", "--baseline-rev", arguments.since, *packages])
        return
    workspace = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]
    crates = needed(LIBRARIES)
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    (WORK / "Cargo.toml").write_text(workspace_manifest(workspace, crates))
    shutil.copy2(ROOT / "Cargo.lock", WORK / "Cargo.lock")
    for name in crates:
        copy_crate(name, workspace)
    check_rust_versions(crates)
    if arguments.semver:
        semver()
        return
    command = ["cargo", "publish" if arguments.publish else "package", "--workspace", "--allow-dirty"]
    command += [] if arguments.verify or arguments.publish else ["--no-verify"]
    code = subprocess.run(command, cwd=WORK).returncode
    if code != 0:
        sys.exit(f"expected exit code 0, found {code}: {' '.join(command)}")
    for file in sorted((target_folder(WORK) / "package").glob("*.crate")):
        print(f"{file.stat().st_size / 1e3:8.1f} kB  {file.name}")


def api(check: bool) -> None:
    """Write the public interface of each library, or end with the differences from what is written."""
    different = False
    LISTINGS.mkdir(exist_ok=True)
    for name, found in listings().items():
        file = LISTINGS / f"{name}.txt"
        if not check:
            file.write_text(found)
            continue
        known = file.read_text() if file.is_file() else ""
        path = str(file.relative_to(ROOT))
        lines = difflib.unified_diff(known.splitlines(), found.splitlines(), path, "the code", lineterm="", n=0)
        different |= known != found
        print("".join(f"{line}\n" for line in lines), end="")
    if different:
        sys.exit(
            "expected the public interfaces of release/api, found others: see above. If that is meant, write them by\n"
            "`python3 release/crates.py --api` and commit them. A line that is gone or another one (-) breaks code of others: the next\n"
            "version is then a new minor one as long as it is 0.x, and CHANGELOG.md says what to write instead."
        )


def semver() -> None:
    """Compare the copies with what is published, from the second version of a library on."""
    for name in LIBRARIES:
        ask = ["cargo", "info", "--registry", "crates-io", PREFIX + name]
        answer = subprocess.run(ask, cwd=ROOT, capture_output=True, text=True)
        if answer.returncode == 0:
            run(["cargo", "semver-checks", "--all-features", "--package", PREFIX + name], folder=WORK)
        elif "could not find" in answer.stderr:
            print(f"{PREFIX}{name}: no version is published yet, so there is nothing to compare with")
        else:
            sys.exit(f"expected an answer of the registry about {PREFIX}{name}, found: {answer.stderr}")


def listings() -> dict[str, str]:
    """The public interface of each library with all its features, without what each type has of the compiler and by `derive`."""
    wrapper = target_folder(ROOT) / "rustdoc-json"
    wrapper.parent.mkdir(exist_ok=True)
    # For rustdoc alone: dependencies look for this variable when they are built, and all would be built again.
    wrapper.write_text('#!/bin/sh\nRUSTC_BOOTSTRAP=1 exec rustdoc "$@"\n')
    wrapper.chmod(0o755)
    variables = {"RUSTDOC": str(wrapper), "RUSTDOCFLAGS": "-Z unstable-options --output-format json --cap-lints allow"}
    # The features of shared dependencies are then those of the workspace, so that what was checked before serves.
    command = ["cargo", "doc", "--locked", "--no-deps", "--lib", "--all-features", "--package", "unified-features"]
    for name in LIBRARIES:
        command += ["--package", name]
    run(command, {**os.environ, **variables})
    program = "cargo-public-api"
    found = {}
    for name in LIBRARIES:
        file = target_folder(ROOT) / "doc" / f"{name.replace('-', '_')}.json"
        command = [program, "public-api", "-sss", "--color", "never", "--rustdoc-json", str(file)]
        found[name] = run(command, stdout=subprocess.PIPE, text=True).stdout
    return found


def run(command: list[str], variables: dict[str, str] | None = None, folder: Path = ROOT, **options: object) -> subprocess.CompletedProcess:
    """Run a command, which must succeed."""
    try:
        ended = subprocess.run(command, cwd=folder, env=variables, **options)
    except FileNotFoundError:
        sys.exit(f"expected the program {command[0]}, found none: cargo install --locked cargo-public-api@{PUBLIC_API}")
    if ended.returncode != 0:
        sys.exit(f"expected exit code 0, found {ended.returncode}: {' '.join(command)}")
    return ended


def target_folder(workspace: Path) -> Path:
    """Where cargo builds a workspace."""
    return Path(os.environ.get("CARGO_TARGET_DIR", workspace / "target"))


def check_rust_versions(crates: list[str]) -> None:
    """End if a crate promises an older Rust than one of its dependencies, which cargo does not look at."""
    ask = ["cargo", "metadata", "--format-version", "1", "--all-features"]
    packages = json.loads(run(ask, folder=WORK, stdout=subprocess.PIPE, text=True).stdout)["packages"]
    needs = {f"{it['name']} {it['version']}": version_numbers(it["rust_version"] or "0") for it in packages}
    wrong = []
    for name in crates:
        ask = ["cargo", "tree", "--edges", "normal,build", "--all-features", "--prefix", "none", "--format", "{p}", "--package", PREFIX + name]
        lines = run(ask, folder=WORK, stdout=subprocess.PIPE, text=True).stdout.splitlines()
        used = {f"{words[0]} {words[1].removeprefix('v')}" for words in map(str.split, lines) if words}
        promised = manifest(name)["package"]["rust-version"]
        most = max(used, key=needs.__getitem__)
        if needs[most] > version_numbers(promised):
            wrong.append(f"{name}: expected a rust-version of at least {'.'.join(map(str, needs[most]))} as of {most}, found {promised}")
    if wrong:
        sys.exit("\n".join(wrong))


def version_numbers(text: str) -> list[int]:
    """The numbers of a version of Rust, without the last one where it says nothing."""
    numbers = [int(number) for number in text.split(".")]
    return numbers[:2] if numbers[2:] == [0] else numbers


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
    lines = ["[workspace]", 'resolver = "2"', f"members = {crates!r}", ""]
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
    take_in_files(source, copy)


def take_in_files(source: Path, copy: Path) -> None:
    """Copy what the code includes from outside of its crate: a package has only what lies below it."""
    for code in sorted((copy / "src").rglob("*.rs")):
        text = code.read_text()
        for path in re.findall(r'include_str!\("([^"]+)"\)', text):
            file = ((source / code.relative_to(copy)).parent / path).resolve()
            if not file.is_relative_to(source):
                shutil.copy2(file, code.parent / file.name)
                text = text.replace(f'include_str!("{path}")', f'include_str!("{file.name}")')
        code.write_text(text)


if __name__ == "__main__":
    main()
