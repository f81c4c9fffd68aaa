#!/usr/bin/env python3
"""Install the files of a release in fresh systems, as their users do, and print a table: seconds from there to the first picture.

    python3 release/try_installs.py DIST [--system debian12]... [--way wheel]...

DIST has one wheel for this machine and the Debian package made of it. A system is a folder that debootstrap fills once, below
`target/systems`: nothing but its base and Python, so neither a compiler nor Rust. Each trial has a copy of it and starts with the
file of the release; it ends when a page with pictures is there and all checks of the scenario have passed. Needs root and network,
except for the trial without network. The exit code is 1 when a trial failed.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SYSTEMS = ROOT / "target" / "systems"
DEBIAN, UBUNTU = "http://deb.debian.org/debian", "http://archive.ubuntu.com/ubuntu"
# Suite, archive, Python. That of the first one is too old for the wheel, its glibc is older than that of RHEL 8.
KNOWN = {
    "ubuntu18": ("bionic", UBUNTU, "3.6"),
    "debian11": ("bullseye", DEBIAN, "3.9"),
    "debian12": ("bookworm", DEBIAN, "3.11"),
    "debian13": ("trixie", DEBIAN, "3.13"),
    "ubuntu22": ("jammy", UBUNTU, "3.10"),
    "ubuntu24": ("noble", UBUNTU, "3.12"),
}
USER = 1000
CERTIFICATES = Path("/etc/ssl/certs/ca-certificates.crt")
FIRST_PICTURE = "trackside examples limit_handling && trackside run limit_handling.toml"


class TrialError(Exception):
    """What a trial expected and did not find."""


@dataclass
class System:
    """A copy of a system, in which programs run with its own files alone."""

    name: str
    root: Path

    def run(self, script: str, *, user: int = 0, folder: str = "/home/user", network: bool = True) -> str:
        """Run a shell script in the system; the mounts end with it."""
        mounts = f"mount --bind /proc {self.root}/proc && mount --rbind /dev {self.root}/dev"
        inner = ["chroot", f"--userspec={user}:{user}", str(self.root), "/usr/bin/env", "-i", "PATH=/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin"]
        inner += ["HOME=/home/user", "LANG=C.UTF-8", "PIP_DISABLE_PIP_VERSION_CHECK=1", f"PIP_CERT={CERTIFICATES}", f"SSL_CERT_FILE={CERTIFICATES}"]
        inner += ["sh", "-ec", f"cd {folder}\n{script}"]
        apart = ["unshare", "--mount", *([] if network else ["--net"]), "sh", "-ec", f"{mounts}\nexec {shlex.join(inner)}"]
        done = subprocess.run(apart, capture_output=True, text=True, stdin=subprocess.DEVNULL)
        if done.returncode != 0:
            lines = (done.stdout + done.stderr).strip().splitlines()
            raise TrialError(f"exit code {done.returncode} of `{script.splitlines()[0]}`: " + " / ".join(lines[-6:]))
        return done.stdout

    def add(self, *files: Path) -> None:
        """Copy files, or what folders have, into the folder of the user."""
        for file in files:
            if file.is_dir():
                shutil.copytree(file, self.root / "home/user" / file.name)
            else:
                shutil.copy2(file, self.root / "home/user" / file.name)

    def expect_picture(self) -> None:
        """End the trial unless the page of the run is there, with pictures."""
        pages = list((self.root / "home/user").rglob("report.html"))
        if not any("<svg" in page.read_text(encoding="utf-8") for page in pages):
            raise TrialError(f"expected a report.html with pictures below /home/user, found {len(pages)} pages")


@dataclass
class Installation:
    """How a file of the release gets into a system: what is prepared outside of the time, the installation, and a run to its page."""

    file: Path
    prepare: Callable[[], object]
    install: Callable[[], object]
    run: Callable[[], object]


def main() -> None:
    """Make the systems, run the trials, and print a row for each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dist", type=Path)
    parser.add_argument("--system", action="append", choices=KNOWN, help="repeated for several (default: all)")
    parser.add_argument("--way", action="append", choices=WAYS, help="repeated for several (default: all)")
    arguments = parser.parse_args()
    if os.geteuid() != 0:
        sys.exit("expected root, since debootstrap and chroot need it")
    if shutil.which("debootstrap") is None:
        sys.exit("expected the program debootstrap, found none: apt-get install debootstrap")
    print("| file | MB | system | glibc | Python | installed after | first picture after |\n|---|---|---|---|---|---|---|", flush=True)
    failed = False
    for name in arguments.system or KNOWN:
        base = base_system(name)
        ways = ["deb"] if name == "ubuntu18" else arguments.way or WAYS
        for way in ways:
            try:
                print(trial(way, name, base, arguments.dist), flush=True)
            except TrialError as error:
                failed = True
                print(f"{name}, {way}: FAILED: {error}", file=sys.stderr, flush=True)
    sys.exit(1 if failed else 0)


def base_system(name: str) -> Path:
    """The folder of a system with its Python; made once."""
    suite, archive, _ = KNOWN[name]
    folder, complete = SYSTEMS / name, SYSTEMS / f"{name}.complete"
    if not complete.exists():
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        # Ubuntu's keys are no part of Debian, and nothing of these folders is kept.
        command = ["debootstrap", "--variant=minbase", "--no-check-gpg", "--include=python3,python3-venv"]
        command += ["--components=main,universe"] if archive == UBUNTU else []
        # All of Ubuntu's scripts are this one; an older debootstrap lacks the names of newer suites.
        script = ["/usr/share/debootstrap/scripts/gutsy"] if archive == UBUNTU else []
        done = subprocess.run([*command, suite, str(folder), archive, *script], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"expected a system {suite} of debootstrap, found exit code {done.returncode}: {done.stdout[-500:]}")
        shutil.copy2("/etc/resolv.conf", folder / "etc/resolv.conf")
        (folder / "etc/ssl/certs").mkdir(parents=True, exist_ok=True)
        shutil.copy2(CERTIFICATES, folder / CERTIFICATES.relative_to("/"))
        complete.touch()
    tools = [tool for tool in ("gcc", "cc", "cargo") if list(folder.glob(f"usr/*bin/{tool}"))]
    if tools:
        sys.exit(f"expected no compiler in {folder}, found {', '.join(tools)}")
    return folder


def trial(way: str, name: str, base: Path, dist: Path) -> str:
    """One row: install a file of the release in a copy of a system, and run a scenario to its page."""
    copy = SYSTEMS / "trial"
    shutil.rmtree(copy, ignore_errors=True)
    subprocess.run(["cp", "--archive", str(base), str(copy)], check=True)
    (copy / "home/user").mkdir()
    os.chown(copy / "home/user", USER, USER)
    system = System(name, copy)
    installation = WAYS[way](system, dist)
    installation.prepare()
    begin = time.monotonic()
    installation.install()
    installed = time.monotonic()
    installation.run()
    picture = time.monotonic()
    system.expect_picture()
    glibc = re.search(r"(\d+\.\d+)$", system.run("ldd --version | head -n 1").strip())
    python = system.run("python3 --version").split()[1]
    file = installation.file
    size = sum(path.stat().st_size for path in ([file] if file.is_file() else file.iterdir())) / 1e6
    shutil.rmtree(copy)
    seconds = f"{installed - begin:.1f} s | {picture - begin:.1f} s"
    return f"| {way}: {file.name} | {size:.1f} | {name} | {glibc[1] if glibc else '?'} | {python} | {seconds} |"


def only(dist: Path, pattern: str) -> Path:
    """The one file of a release with such a name."""
    found = sorted(dist.resolve().glob(pattern))
    if len(found) != 1:
        sys.exit(f"expected one {pattern} in {dist}, found {len(found)}")
    return found[0]


def wheel_by(system: System, dist: Path, install: str, run: str = FIRST_PICTURE, before: str = "true") -> Installation:
    """An installation of the wheel by a command, in which WHEEL stands for it."""
    wheel = only(dist, "trackside-*x86_64.whl")

    def prepare() -> None:
        system.add(wheel)
        system.run(before, user=USER)

    named = f"./{wheel.name}"
    return Installation(
        wheel,
        prepare,
        lambda: system.run(install.replace("WHEEL", named), user=USER),
        lambda: system.run(run.replace("WHEEL", named), user=USER),
    )


def by_wheel(system: System, dist: Path) -> Installation:
    """`pip install` in a clean environment; its own making is no part of the time."""
    return wheel_by(system, dist, "venv/bin/pip install --quiet WHEEL", f"PATH=$PWD/venv/bin:$PATH\n{FIRST_PICTURE}", "python3 -m venv venv")


def by_uvx(system: System, dist: Path) -> Installation:
    """`uvx` runs the program of the wheel without an environment of the user."""
    run = FIRST_PICTURE.replace("trackside ", "tools/bin/uvx --quiet --from WHEEL trackside ")
    return wheel_by(system, dist, "true", run, "python3 -m venv tools && tools/bin/pip install --quiet uv")


def by_pipx(system: System, dist: Path) -> Installation:
    """`pipx install`."""
    run = f"PATH=$HOME/.local/bin:$PATH\n{FIRST_PICTURE}"
    return wheel_by(system, dist, "tools/bin/pipx install --quiet WHEEL", run, "python3 -m venv tools && tools/bin/pip install --quiet pipx")


def by_folder(system: System, dist: Path) -> Installation:
    """The folder of `python/bundle.py`, without network, with the viewer, for which there is no Python 3.9."""
    bundle = SYSTEMS / "offline"
    python = KNOWN[system.name][2]
    extra = "pandas" if python == "3.9" else "viewer"

    def prepare() -> None:
        shutil.rmtree(bundle, ignore_errors=True)
        command = [sys.executable, ROOT / "python/bundle.py", only(dist, "trackside-*x86_64.whl"), bundle, "--python", python, "--extra", extra]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise TrialError(f"bundle.py: {done.stderr[-500:]}")
        system.add(bundle)
        system.run("python3 -m venv venv", user=USER)

    def install() -> None:
        system.run(f'venv/bin/pip install --quiet --no-index --find-links offline "trackside[{extra}]"', user=USER, network=False)

    def run() -> None:
        system.run(f"PATH=$PWD/venv/bin:$PATH\n{FIRST_PICTURE}\n{'rerun --version' if extra == 'viewer' else 'true'}", user=USER, network=False)

    return Installation(bundle, prepare, install, run)


def by_deb(system: System, dist: Path) -> Installation:
    """The Debian package, used by somebody who is not root."""
    package = only(dist, "trackside_*_amd64.deb")
    return Installation(
        package,
        lambda: system.add(package),
        lambda: system.run(f"dpkg --install {package.name}"),
        lambda: system.run(FIRST_PICTURE, user=USER),
    )


def by_dockerfile(system: System, dist: Path) -> Installation:
    """The steps of `Dockerfile`, where its image is this system: `trackside test` of a folder that is mounted at /work."""
    copies, commands, user = dockerfile()
    wheel = only(dist, "trackside-*x86_64.whl")

    def prepare() -> None:
        for source, target in copies:
            if not wheel.match(source.rpartition("/")[2]):
                raise TrialError(f"expected COPY of the wheel in Dockerfile, found {source}")
            shutil.copy2(wheel, system.root / target.strip("/"))
        # That the image has a Python outside of the system is the one difference.
        system.run("apt-get update --quiet && apt-get install --quiet --yes --no-install-recommends python3-pip")

    def install() -> None:
        for command in commands:
            system.run(f"export PIP_BREAK_SYSTEM_PACKAGES=1\n{command}")

    def run() -> None:
        identity = int(system.run(f"id -u {user}"))
        if identity == 0:
            raise TrialError("expected a user other than root in Dockerfile, found root")
        (system.root / "work").mkdir()
        os.chown(system.root / "work", identity, identity)
        system.run("trackside examples limit_handling --out /work && trackside test /work", user=identity, folder="/work")
        shutil.copytree(system.root / "work", system.root / "home/user/work")

    return Installation(wheel, prepare, install, run)


def dockerfile() -> tuple[list[tuple[str, str]], list[str], str]:
    """What `Dockerfile` copies, the commands that it runs, and its user."""
    text = (ROOT / "Dockerfile").read_text().replace("\\\n", " ")
    words = [line.split(maxsplit=1) for line in text.splitlines() if line and not line.startswith("#")]
    copies = [tuple(rest.split()) for key, rest in words if key == "COPY"]
    return copies, [rest for key, rest in words if key == "RUN"], next(rest for key, rest in words if key == "USER")


WAYS: dict[str, Callable[[System, Path], Installation]] = {
    "wheel": by_wheel,
    "uvx": by_uvx,
    "pipx": by_pipx,
    "offline folder": by_folder,
    "deb": by_deb,
    "Dockerfile": by_dockerfile,
}


if __name__ == "__main__":
    main()
