"""Writes a page of the manual from the docstrings of the Python package: what `trackside`, `trackside.fmu` and `trackside.analysis` export."""

from __future__ import annotations

from pathlib import Path

import griffe

LISTS = {
    griffe.DocstringSectionKind.parameters,
    griffe.DocstringSectionKind.attributes,
    griffe.DocstringSectionKind.raises,
    griffe.DocstringSectionKind.returns,
}
MODULES = ["trackside", "trackside.fmu", "trackside.analysis"]


def python_reference(folder: Path) -> str:
    """The page, from the package in a folder. Nothing is imported: the package may lack what it needs."""
    loader = griffe.GriffeLoader(search_paths=[folder])
    package = loader.load("trackside")
    loader.resolve_aliases()
    parts = ["# Reference: Python"]
    for name in MODULES:
        module = package if name == "trackside" else package[name.partition(".")[2]]
        parts += [f"## {name}", text_of(module)]
        for exported in exports_of(module):
            parts += entry(exported)
    return "\n\n".join(part for part in parts if part) + "\n"


def exports_of(module: griffe.Module) -> list[griffe.Object]:
    """What a module exports, by its `__all__` or its names."""
    own = [name for name, it in module.members.items() if not name.startswith("_") and not it.is_alias]
    names = own if module.exports is None else module.exports
    members = [module.members[str(name)] for name in names]
    return [member.final_target if member.is_alias else member for member in members]


def entry(member: griffe.Object, owner: str = "") -> list[str]:
    """Heading, signature and text of a class or function, and those of what a class has."""
    if not (member.is_class or member.is_function):
        return []
    name = f"{owner}.{member.name}" if owner else member.name
    parts = [f"{'####' if owner else '###'} {name}", f"```python\n{declaration(member)}\n```", text_of(member)]
    if member.is_class:
        public = [it for it in member.members.values() if not it.name.startswith("_") and not it.is_alias]
        parts.append("\n".join(attribute(it) for it in public if it.is_attribute))
        parts += [part for it in public if it.is_function for part in entry(it, name)]
    return parts


def declaration(member: griffe.Object) -> str:
    """The line that declares a class or function."""
    if member.is_function:
        return member.signature()
    bases = ", ".join(str(base) for base in member.bases)
    return f"class {member.name}({bases})" if bases else f"class {member.name}"


def attribute(member: griffe.Attribute) -> str:
    """A row for an attribute or property: its type, and its docstring or the `#:` comment above it."""
    kind = f": `{member.annotation}`" if member.annotation else ""
    text = text_of(member) or comment_above(member)
    return f"- `{member.name}`{kind}" + (f" - {' '.join(text.split())}" if text else "")


def comment_above(member: griffe.Attribute) -> str:
    """The comment that Sphinx and pdoc take for the docstring of an attribute."""
    above: list[str] = []
    for line in reversed(Path(member.filepath).read_text().splitlines()[: member.lineno - 1]):
        if not line.strip().startswith("#:"):
            break
        above.insert(0, line.strip().removeprefix("#:").strip())
    return " ".join(above)


def text_of(member: griffe.Object) -> str:
    """The docstring; its sections such as `Args:` become lists."""
    if member.docstring is None:
        return ""
    parts = []
    for section in member.docstring.parse("google", warnings=False):
        if section.kind is griffe.DocstringSectionKind.text:
            parts.append(section.value)
        elif section.kind in LISTS:
            parts.append(f"{section.kind.value.capitalize()}:\n\n" + "\n".join(item(it) for it in section.value))
        else:
            return member.docstring.value
    return "\n\n".join(parts)


def item(element: griffe.DocstringElement) -> str:
    """A row of a section: a name or type, and what is said of it."""
    name = getattr(element, "name", "") or element.annotation
    return f"- `{name}` - {' '.join(element.description.split())}"
