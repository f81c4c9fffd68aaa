#!/usr/bin/env python3
"""Make all files of a release from its wheels: Debian packages, the list of parts (CycloneDX), notes, checksums.

    python3 release/assemble.py VERSION DIST

DIST has the wheels that `python/build.py` made. VERSION is that of `Cargo.toml` and of a section of `CHANGELOG.md`; with
`Unreleased` it takes the section of that name, for a trial. Needs cargo, and dpkg-deb for the Debian packages.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import subprocess
import sys
import tempfile
import tomllib
import uuid
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "python"))
from build import FMUS, PLUGINS  # noqa: E402

# What the wheel is made of.
PARTS = ["orchestrator", *FMUS, *PLUGINS]
ARCHITECTURES = {"x86_64": "amd64", "aarch64": "arm64"}


def main() -> None:
    """Check the version, and write the files."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("version")
    parser.add_argument("dist", type=Path)
    arguments = parser.parse_args()
    workspace = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]
    if arguments.version not in (workspace["version"], "Unreleased"):
        sys.exit(f"expected the version of Cargo.toml, {workspace['version']}, found {arguments.version}")
    wheels = sorted(arguments.dist.glob("trackside-*.whl"))
    if not wheels:
        sys.exit(f"expected wheels in {arguments.dist}, found none: python3 python/build.py --out {arguments.dist}")
    wrong = [wheel.name for wheel in wheels if wheel.name.split("-")[1] != workspace["version"]]
    if wrong:
        sys.exit(f"expected wheels of version {workspace['version']}, found {', '.join(wrong)}")
    (arguments.dist / "NOTES.md").write_text(notes(arguments.version))
    sbom = arguments.dist / f"trackside-{workspace['version']}.cdx.json"
    sbom.write_text(json.dumps(parts_list(workspace), indent=1) + "\n")
    for wheel in wheels:
        make_debian_package(wheel, workspace["version"])
    files = sorted(path for path in arguments.dist.iterdir() if path.suffix in (".whl", ".deb", ".json"))
    sums = [f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}\n" for file in files]
    (arguments.dist / "SHA256SUMS").write_text("".join(sums))
    for file in sorted(arguments.dist.iterdir()):
        print(f"{file.stat().st_size / 1e6:8.2f} MB  {file.name}")


def notes(version: str) -> str:
    """The section of a version in the list of changes."""
    sections = re.split(r"^## ", (ROOT / "CHANGELOG.md").read_text(), flags=re.MULTILINE)[1:]
    found = [section for section in sections if section.split(maxsplit=1)[0] == version]
    if len(found) != 1:
        sys.exit(f"expected one section `## {version}` in CHANGELOG.md, found {len(found)}")
    return found[0].partition("\n")[2].strip() + "\n"


def make_debian_package(wheel: Path, version: str) -> None:
    """Write a Debian package beside a wheel: its program and what comes with it, without the package for Python."""
    glibc = re.search(r"manylinux_2_(\d+)_(x86_64|aarch64)", wheel.name)
    if glibc is None:
        sys.exit(f"expected a wheel for a glibc, such as manylinux_2_17_x86_64, found {wheel.name}")
    architecture = ARCHITECTURES[glibc[2]]
    with tempfile.TemporaryDirectory(prefix="trackside-deb-") as name:
        root = Path(name)
        root.chmod(0o755)
        with zipfile.ZipFile(wheel) as archive:
            for entry in archive.infolist():
                place = place_in_system(entry.filename)
                if place is not None and not entry.is_dir():
                    (root / place).parent.mkdir(parents=True, exist_ok=True)
                    (root / place).write_bytes(archive.read(entry))
                    (root / place).chmod(0o755 if place.startswith("usr/bin/") else 0o644)
        copyright_file = root / "usr/share/doc/trackside/copyright"
        copyright_file.parent.mkdir(parents=True)
        copyright_file.write_text((ROOT / "LICENSE").read_text())
        (root / "DEBIAN").mkdir()
        size = sum(path.stat().st_size for path in root.rglob("*") if path.is_file()) // 1024
        (root / "DEBIAN/control").write_text(
            f"Package: trackside\nVersion: {version}\nArchitecture: {architecture}\nMaintainer: {maintainer()}\n"
            f"Section: science\nPriority: optional\nInstalled-Size: {size}\nDepends: libc6 (>= 2.{glibc[1]})\n"
            "Recommends: python3\nSuggests: gcc, wine64\n"
            "Description: co-simulation of vehicle dynamics\n"
            " FMUs in TOML scenarios, checks, recordings, identification of tires. FMUs and analyses in Python\n"
            " take python3, FMUs of sources a compiler, FMUs for Windows wine64.\n"
        )
        package = wheel.with_name(f"trackside_{version}_{architecture}.deb")
        subprocess.run(["dpkg-deb", "--build", "--root-owner-group", "-Zxz", root, package], check=True, stdout=subprocess.DEVNULL)


def place_in_system(entry: str) -> str | None:
    """Where a file of a wheel lies in a system; nothing for the package of Python."""
    inside = re.match(r"trackside-[^/]+\.data/(?:(scripts)|data)/(.+)", entry)
    if inside is None:
        return None
    return f"usr/bin/{inside[2]}" if inside[1] else f"usr/{inside[2]}"


def maintainer() -> str:
    """Who makes the package, by Debian's variables or by Git."""
    def git(key: str) -> str:
        return subprocess.run(["git", "config", key], capture_output=True, text=True, cwd=ROOT).stdout.strip()

    name = os.environ.get("DEBFULLNAME") or git("user.name")
    address = os.environ.get("DEBEMAIL") or git("user.email")
    if not (name and address):
        sys.exit("expected the maintainer of the Debian package in DEBFULLNAME and DEBEMAIL, or in the settings of Git")
    return f"{name} <{address}>"


def parts_list(workspace: dict[str, str]) -> dict[str, object]:
    """The crates that the release is made of, in the form of CycloneDX, without those of tests and build scripts."""
    lock_text = (ROOT / "Cargo.lock").read_text()
    lock = {(part["name"], part["version"]): part.get("checksum") for part in tomllib.loads(lock_text)["package"]}
    command = ["cargo", "metadata", "--locked", "--format-version", "1", "--filter-platform", "x86_64-unknown-linux-gnu"]
    metadata = json.loads(subprocess.run(command, check=True, capture_output=True, cwd=ROOT).stdout)
    packages = {package["id"]: package for package in metadata["packages"]}
    uses = {
        node["id"]: [use["pkg"] for use in node["deps"] if any(kind["kind"] is None for kind in use["dep_kinds"])]
        for node in metadata["resolve"]["nodes"]
    }
    roots = [identity for identity, package in packages.items() if package["name"] in PARTS and package["source"] is None]
    reached, left = set(roots), list(roots)
    while left:
        left += (new := [use for use in uses[left.pop()] if use not in reached])
        reached.update(new)

    def reference(identity: str) -> str:
        return f"pkg:cargo/{packages[identity]['name']}@{packages[identity]['version']}"

    components, dependencies = [], []
    for identity in sorted(reached, key=reference):
        package = packages[identity]
        component = {"type": "library", "bom-ref": reference(identity), "name": package["name"], "version": package["version"]}
        if package["license"]:
            component["licenses"] = [{"expression": package["license"].replace("/", " OR ")}]
        checksum = lock.get((package["name"], package["version"]))
        if package["source"] and checksum:
            component |= {"purl": reference(identity), "hashes": [{"alg": "SHA-256", "content": checksum}]}
        components.append(component)
        dependencies.append({"ref": reference(identity), "dependsOn": sorted({reference(use) for use in uses[identity]})})
    own = {"type": "application", "bom-ref": "trackside", "name": "trackside", "version": workspace["version"]}
    own["licenses"] = [{"expression": workspace["license"]}]
    dependencies.append({"ref": "trackside", "dependsOn": sorted(reference(root) for root in roots)})
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        # The same crates give the same list.
        "serialNumber": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, lock_text)}",
        "version": 1,
        "metadata": {"component": own},
        "components": components,
        "dependencies": dependencies,
    }


if __name__ == "__main__":
    main()
