#!/usr/bin/env python3
"""Build the wheel: the program, its FMUs, plugins and scenarios, and the package `trackside`.

    python3 python/build.py [--out DIR] [--target TARGET]... [--glibc 2.17]

needs Rust, gcc and network for maturin, auditwheel and Zig, which go into an environment of their own below `target/wheel`.
It prints the path of the wheel and what auditwheel says about it.
"""

from __future__ import annotations

import argparse
import io
import os
import platform
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WORK = ROOT / "target" / "wheel"
SHARE = WORK / "trackside.data" / "data" / "share" / "trackside"
# The packages that scenarios name by `crate`, with the archives that `trackside pack` makes of them.
FMUS = {
    "plant-fmu": "plant.fmu",
    "controller": "controller.fmu",
    "estimator": "estimator.fmu",
    "plant-dual-fmu": "plant_dual.fmu",
    "driver-fmu": "driver.fmu",
    "friction-fmu": "friction.fmu",
}
# Libraries that the program loads: an analysis, and what `trackside pack --fmu` puts into an archive.
PLUGINS = ["identify", "python-fmu", "system-fmu"]
# Zig links against the symbols of an old glibc; cargo-zigbuild translates the linker's arguments for it.
TOOLS = ["maturin==1.16.0", "auditwheel==6.8.2", "cargo-zigbuild==0.24.1", "ziglang==0.17.1"]


def main() -> None:
    """Build everything, and print where it is."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=WORK / "dist", help="folder for the wheel (default: %(default)s)")
    words = "also put libraries for this target of Rust into the FMUs, e.g. x86_64-pc-windows-gnu"
    parser.add_argument("--target", action="append", default=[], help=words)
    words = "have Zig link for a glibc as old as this, e.g. 2.17; without it gcc links for that of this machine"
    parser.add_argument("--glibc", help=words)
    arguments = parser.parse_args()
    out = arguments.out.resolve()
    tools = tools_folder()
    zig = compilers(tools, arguments.glibc) if arguments.glibc else {}
    build = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve() / "wheel-build"
    environment = environment_of_builds(build) | zig
    packages = ["orchestrator", *FMUS, *PLUGINS]
    names = [word for package in packages for word in ("--package", package)]
    run(["cargo", "build", "--release", "--locked", "--features", "orchestrator/portable", *names], environment)
    gather(build / "release", environment, arguments.target)
    out.mkdir(parents=True, exist_ok=True)
    before = set(out.glob("*.whl"))
    run([tools / "maturin", "build", "--release", "--out", out], environment, ROOT / "python")
    made = sorted(set(out.glob("*.whl")), key=lambda path: path.stat().st_mtime)
    if not made:
        sys.exit(f"expected a wheel in {out}, found {sorted(before)}")
    wheel = made[-1]
    refuse_paths_of_this_machine(wheel)
    if arguments.glibc:
        refuse_newer_glibc(wheel, arguments.glibc)
    run([tools / "auditwheel", "show", wheel], environment)
    print(wheel)


def environment_of_builds(build: Path) -> dict[str, str]:
    """Variables for cargo: nothing in the files tells where they were built, and nothing else is built anew."""
    home = Path(os.environ.get("CARGO_HOME", Path.home() / ".cargo"))
    sysroot = subprocess.run(["rustc", "--print", "sysroot"], check=True, capture_output=True, text=True).stdout.strip()
    places = {str(build): "/build", str(ROOT): "/trackside", str(home): "/cargo", sysroot: "/rust"}
    flags = "\x1f".join(f"--remap-path-prefix={place}={name}" for place, name in places.items())
    c_flags = " ".join(f"-ffile-prefix-map={place}={name}" for place, name in places.items())
    return os.environ | {
        "CARGO_TARGET_DIR": str(build),
        "CARGO_ENCODED_RUSTFLAGS": flags,
        "CARGO_PROFILE_RELEASE_STRIP": "symbols",
        "CFLAGS": f"{os.environ.get('CFLAGS', '')} {c_flags}".strip(),
    }


def compilers(tools: Path, glibc: str) -> dict[str, str]:
    """Variables that have Zig compile C and link, for an old glibc."""
    folder = WORK / "zig"
    folder.mkdir(parents=True, exist_ok=True)
    machine = platform.machine()
    triple = f"{machine}-linux-gnu.{glibc}"
    compiler = folder / f"cc-{triple}"
    script = ROOT / "python/zig_cc.sh"
    compiler.write_text(f'#!/bin/sh\nTOOLS="{tools}" TRIPLE={triple} exec bash "{script}" "$@"\n')
    archiver = folder / "ar"
    archiver.write_text(f'#!/bin/sh\nexec "{tools}/python" -m ziglang ar "$@"\n')
    for program in (compiler, archiver):
        program.chmod(0o755)
    target = f"{machine}_unknown_linux_gnu"
    return {f"CC_{target}": str(compiler), f"AR_{target}": str(archiver), f"CARGO_TARGET_{target.upper()}_LINKER": str(compiler)}


def gather(release: Path, environment: dict[str, str], targets: list[str]) -> None:
    """Put FMUs, plugins and scenarios where an installed program looks for them."""
    shutil.rmtree(WORK / "trackside.data", ignore_errors=True)
    packed = WORK / "fmu"
    shutil.rmtree(packed, ignore_errors=True)
    others = [word for target in targets for word in ("--target", target)]
    run([release / "trackside", "pack", "--out", packed, *others, *FMUS], environment)
    for folder in ("fmu", "plugin"):
        (SHARE / folder).mkdir(parents=True)
    for package, archive in FMUS.items():
        shutil.copy2(packed / archive, SHARE / "fmu" / f"{package}.fmu")
    for package in PLUGINS:
        library = release / f"lib{package.replace('-', '_')}.so"
        shutil.copy2(library, SHARE / "plugin" / f"{package}.so")
    for file in sorted((ROOT / "scenarios").rglob("*")):
        if file.is_file() and (file.suffix != ".toml" or reads_own_files(file)):
            copy = SHARE / "scenarios" / file.relative_to(ROOT / "scenarios")
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(file, copy)
    compile_windows_host()
    shutil.copy2(ROOT / "LICENSE", SHARE / "LICENSE")


def compile_windows_host() -> None:
    """Compile what loads libraries for Windows under Wine, so that nobody else needs MinGW-w64 for it; nothing without that here."""
    compiler = shutil.which("x86_64-w64-mingw32-gcc")
    if compiler is None:
        print("MinGW-w64 is not there: the wheel has no program for Wine", file=sys.stderr)
        return
    sources = ROOT / "crates/fmu-import/src/wine"
    folder = SHARE / "windows-host" / "x86_64"
    folder.mkdir(parents=True)
    library, program = folder / "bcryptprimitives.dll", folder / "trackside-windows-host.exe"
    # The same bytes at any time.
    flags = ["-O2", "-s", "-Wl,--no-insert-timestamp"]
    run([compiler, *flags, "-shared", sources / "bcryptprimitives.c", "-o", library, "-ladvapi32"])
    run([compiler, *flags, "-mwindows", sources / "windows_host.c", "-o", program])


def reads_own_files(scenario: Path) -> bool:
    """Tell whether all paths of a scenario are those of files of the repository: logs of others are no part of it."""
    def paths(value: object) -> Iterator[str]:
        if isinstance(value, dict):
            named = value.get("path", [])
            yield from [named] if isinstance(named, str) else named
            for inner in value.values():
                yield from paths(inner)
        elif isinstance(value, list):
            for inner in value:
                yield from paths(inner)

    named = [(scenario.parent / path).resolve() for path in paths(tomllib.loads(scenario.read_text()))]
    return all(path.is_file() and path.is_relative_to(ROOT) for path in named)


def tools_folder() -> Path:
    """Make an environment with maturin and auditwheel; return the folder of its programs."""
    programs = WORK / "tools" / "bin"
    marker = WORK / "tools" / "complete"
    if not marker.exists() or marker.read_text() != str(TOOLS):
        run([sys.executable, "-m", "venv", "--clear", programs.parent])
        run([programs / "python", "-m", "pip", "install", "--quiet", *TOOLS])
        marker.write_text(str(TOOLS))
    return programs


def refuse_paths_of_this_machine(wheel: Path) -> None:
    """End when a file of the wheel has the path of this repository or of the user's folder in it."""
    places = {str(ROOT), str(Path.home() / ".cargo"), str(Path.home() / ".rustup")}
    for name, content in contents(zipfile.ZipFile(wheel)):
        found = [place for place in places if place.encode() in content]
        if found:
            sys.exit(f"{wheel}: expected no paths of this machine, found {found} in {name}")


def refuse_newer_glibc(wheel: Path, oldest: str) -> None:
    """End when a library or program needs a newer glibc, also in an FMU, where auditwheel does not look."""
    for name, content in contents(zipfile.ZipFile(wheel)):
        needed = {int(minor) for minor in re.findall(rb"GLIBC_2\.(\d+)", content)} if content.startswith(b"\x7fELF") else set()
        if max(needed, default=0) > int(oldest.partition(".")[2]):
            sys.exit(f"{wheel}: expected nothing that needs a glibc after {oldest}, found 2.{max(needed)} in {name}")


def contents(archive: zipfile.ZipFile) -> Iterator[tuple[str, bytes]]:
    """Read all files of an archive, and those of the archives in it."""
    with archive:
        for name in archive.namelist():
            content = archive.read(name)
            yield name, content
            if name.endswith(".fmu"):
                for inner, bytes_of_inner in contents(zipfile.ZipFile(io.BytesIO(content))):
                    yield f"{name}/{inner}", bytes_of_inner


def run(command: list[object], environment: dict[str, str] | None = None, folder: Path = ROOT) -> None:
    """Run a command; end with its exit code when it fails."""
    words = [str(word) for word in command]
    print("$", *words, file=sys.stderr, flush=True)
    code = subprocess.run(words, cwd=folder, env=environment).returncode
    if code != 0:
        sys.exit(f"expected exit code 0, found {code}: {' '.join(words)}")


if __name__ == "__main__":
    main()
