"""Reads and changes archives of FMUs: variables of their descriptions, and constants of their Linux libraries."""

import re
import struct
import xml.etree.ElementTree as ElementTree
import zipfile
from bisect import bisect_right
from dataclasses import dataclass
from functools import cache
from html import escape, unescape
from pathlib import Path

DESCRIPTION = "modelDescription.xml"
# Sections of constants.
CONSTANTS = (".rodata", ".data")
# Scalar arithmetic on a double at an address relative to the instruction: movsd, sqrtsd, addsd, mulsd, subsd, minsd, divsd, maxsd.
ARITHMETIC = re.compile(
    rb"\xf2[\x40-\x4f]?\x0f[\x10\x51\x58\x59\x5c\x5d\x5e\x5f][\x05\x0d\x15\x1d\x25\x2d\x35\x3d](....)", re.S
)
# The same with AVX in its two-byte prefix.
ARITHMETIC_AVX = re.compile(
    rb"\xc5.[\x10\x51\x58\x59\x5c\x5d\x5e\x5f][\x05\x0d\x15\x1d\x25\x2d\x35\x3d](....)", re.S
)
# Packages that every FMU uses to read files and to be called: their constants say little about the model.
INTERFACES = {"fmu_export", "tire_file", "diagnostics", "text_encoding", "log_file"}


@dataclass(frozen=True)
class Variable:
    name: str
    type: str
    causality: str
    start: str | None
    unit: str | None
    optional: bool


@dataclass(frozen=True)
class Constant:
    """A double in a library; `offset` in the file, `function` is the symbol of one that uses it."""

    offset: int
    value: float
    function: str


def read_member(archive, name):
    with zipfile.ZipFile(archive) as file:
        return file.read(name)


@cache
def description(archive):
    """The text of the description."""
    return read_member(archive, DESCRIPTION).decode()


@cache
def variables(archive):
    """The variables of FMI 2.0 and 3.0 by their names."""
    root = ElementTree.fromstring(description(archive))
    found = {}
    for entry in root.find("ModelVariables"):
        body = entry[0] if entry.tag == "ScalarVariable" else entry
        found[entry.get("name")] = Variable(
            entry.get("name"), body.tag, entry.get("causality", "local"), body.get("start"), body.get("unit"),
            entry.find(".//Optional") is not None,
        )  # fmt: skip
    return found


def library_name(archive):
    """The member of the archive that is the library for Linux on x86-64."""
    with zipfile.ZipFile(archive) as file:
        names = [it for it in file.namelist() if re.fullmatch(r"binaries/(linux64|x86_64-linux)/[^/]+\.so", it)]
    return names[0] if names else None


def replace_members(archive, members, target):
    """Writes a copy of the archive with other contents of some members."""
    with zipfile.ZipFile(archive) as old, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as new:
        for info in old.infolist():
            new.writestr(info.filename, members.get(info.filename, old.read(info)))


def replace_attribute(text, variable, attribute, value):
    """The description with another value of an attribute of a variable, which has it already."""
    name = re.escape(escape(variable))
    pattern = rf'(<\w+\s[^>]*?name="{name}"(?:(?!</ScalarVariable>).)*?\s{attribute}=")[^"]*(")'
    changed, count = re.subn(pattern, rf"\g<1>{escape(value)}\g<2>", text, count=1, flags=re.S)
    if not count:
        raise ValueError(f"the description has no {attribute} of {variable}")
    return changed


def replace_root_attribute(text, attribute, value):
    """The description with another value of an attribute of `<fmiModelDescription>`, which gets it if it has none."""
    begin = text.index("<fmiModelDescription")
    end = text.index(">", begin)
    head = re.sub(rf'\s{attribute}="[^"]*"', "", text[begin:end])
    return text[:begin] + f'{head} {attribute}="{escape(value)}"' + text[end:]


def root_attribute(text, attribute):
    match = re.search(rf'<fmiModelDescription[^>]*\s{attribute}="([^"]*)"', text, re.S)
    return unescape(match[1]) if match else None


def sections(library):
    """The sections of an ELF file of 64 bits: (address, offset, size) by name."""
    (table,) = struct.unpack_from("<Q", library, 0x28)
    count, names = struct.unpack_from("<HH", library, 0x3C)
    headers = [struct.unpack_from("<IIQQQQIIQQ", library, table + 64 * i) for i in range(count)]
    texts = headers[names][4]
    text_at = lambda offset: library[texts + offset : library.index(b"\0", texts + offset)].decode()
    return {text_at(header[0]): header[3:6] for header in headers}


def functions(library, found):
    """Addresses and names of functions, in order; empty when the library was stripped."""
    if ".symtab" not in found:
        return []
    (_, offset, size), (_, texts, _) = found[".symtab"], found[".strtab"]
    symbols = []
    for name, info, _, _, address, _ in struct.iter_unpack("<IBBHQQ", library[offset : offset + size]):
        if info & 15 == 2 and address:
            symbols.append((address, library[texts + name : library.index(b"\0", texts + name)].decode()))
    return sorted(symbols)


@cache
def library_constants(archive, packages=()):
    """Doubles of the Linux library that its arithmetic uses, in functions of these packages, or of any without them."""
    library = read_member(archive, library_name(archive))
    found = sections(library)
    symbols = functions(library, found)
    addresses = [it[0] for it in symbols]
    # `7vehicle` in a path, or `vehicle..` in the type of an implementation.
    own = re.compile("|".join(rf"(?<!\d){len(it)}{it}|\b{it}\.\." for it in packages)) if packages and symbols else None
    address, offset, size = found[".text"]
    code = library[offset : offset + size]
    used = {}
    for pattern in (ARITHMETIC, ARITHMETIC_AVX):
        for match in pattern.finditer(code):
            target = address + match.end() + struct.unpack("<i", match[1])[0]
            index = bisect_right(addresses, address + match.start()) - 1
            function = symbols[index][1] if index >= 0 else ""
            if own is None or own.search(function):
                used.setdefault(target, function)
    constants = []
    for target, function in sorted(used.items()):
        for name in CONSTANTS:
            begin, place, length = found.get(name, (0, 0, 0))
            if begin <= target <= begin + length - 8 and target % 8 == 0:
                (value,) = struct.unpack_from("<d", library, place + target - begin)
                if 1e-9 < abs(value) < 1e9:
                    constants.append(Constant(place + target - begin, value, function))
    return constants


def flip_bit(library, offset, bit):
    """The library with one other bit of the double at an offset, and that double."""
    changed = bytearray(library)
    changed[offset + bit // 8] ^= 1 << bit % 8
    return bytes(changed), struct.unpack_from("<d", changed, offset)[0]


def workspace_packages(root):
    """Names of the packages of a workspace of Cargo as symbols have them."""
    folders = [it.parent.name for pattern in ("*/Cargo.toml", "crates/*/Cargo.toml") for it in Path(root).glob(pattern)]
    return tuple(sorted({it.replace("-", "_") for it in folders} - INTERFACES))
