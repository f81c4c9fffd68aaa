#!/usr/bin/env python3
"""Take the pictures of pages that the documents show, in light and dark: `docs/NAME.png` and `docs/NAME_dark.png`.

    python3 docs/pictures.py [NAME]...

Needs the program in `target/debug` and Chromium. Those of the Rerun viewer are taken by hand.
"""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WORK = ROOT / "target" / "pictures"
# Values of Chromium's setting `preferredColorScheme`.
SCHEMES = {"": 1, "_dark": 0}


@dataclass
class Picture:
    """A page of a run, and how much of it is shown."""

    scenario: str
    page: str
    width: int
    height: int


PICTURES = {
    "report": Picture(
        'extends = "../../scenarios/double_lane_change.toml"\n[[check]]\nname = "corners hard"\nthat = "max(abs(plant.a_y)) > 9"\n',
        "report.html",
        1400,
        1000,
    ),
    "excitation": Picture('extends = "../../scenarios/excitation_study.toml"\n', "tires.html", 1120, 1360),
}


def main() -> None:
    """Run the scenarios, and take the pictures."""
    WORK.mkdir(parents=True, exist_ok=True)
    for name in sys.argv[1:] or PICTURES:
        picture = PICTURES[name]
        scenario = WORK / f"{name}.toml"
        scenario.write_text(picture.scenario)
        code = subprocess.run([ROOT / "target/debug/trackside", "run", scenario, "--out", WORK / name, "--rerun", "off"], cwd=ROOT).returncode
        if code not in (0, 1):
            sys.exit(f"expected a run that comes to its end, found exit code {code}: {scenario}")
        for ending, scheme in SCHEMES.items():
            take(WORK / name / picture.page, ROOT / "docs" / f"{name}{ending}.png", picture, scheme)


def take(page: Path, file: Path, picture: Picture, scheme: int) -> None:
    """Take a picture of a page in a colour scheme."""
    command = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", f"--blink-settings=preferredColorScheme={scheme}"]
    command += [f"--window-size={picture.width},{picture.height}", f"--screenshot={file}", page.as_uri()]
    subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
    print(file)


if __name__ == "__main__":
    main()
