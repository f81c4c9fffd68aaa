"""Writes measurement files by asammdf, and says what asammdf reads from files.

usage: judge.py write FOLDER    writes *.mf4 of many kinds
       judge.py read FOLDER     writes beside each *.mf4 what is in it: a .json of channels, and a .bin of doubles
"""

import json
import pathlib
import sys

import numpy as np
from asammdf import MDF, Signal, __version__
from asammdf.blocks.conversion_utils import from_dict


def table(**words):
    return from_dict(words)


def conversions():
    """A raw type with a conversion by name. Bounds and keys are whole: asammdf rounds others in long tables."""
    low_high = dict(lower_0=0, upper_0=10, lower_1=20, upper_1=30)
    return {
        "linear": ("i2", table(a=0.1, b=-7.5)),
        "linear of bytes": ("u1", table(a=0.3, b=0)),
        "linear of doubles": ("f8", table(a=1e-3, b=1 / 3)),
        "inverse factor": ("f8", table(P1=0, P2=1, P3=0, P4=0, P5=0, P6=3)),
        "rational": ("f8", table(P1=0.1, P2=2.5, P3=-1, P4=0.01, P5=0.2, P6=3.7)),
        "algebraic": ("f8", table(formula="X1 * 2.5 + (X1 - 3) / 7 - X1 ** 2 * 0.01")),
        # Not exp: asammdf makes eXp of it, and shows raw values.
        "functions": ("f8", table(formula="sin(X) + cosh(X / 100) * sqrt(abs(X)) - arctan(X)")),
        "lines": ("u1", table(raw_0=2, phys_0=0.1, raw_1=17, phys_1=0.9, raw_2=40, phys_2=-5.3, interpolation=True)),
        "lines of doubles": ("f8", table(raw_0=2, phys_0=0.1, raw_1=17, phys_1=0.9, raw_2=40, phys_2=-5.3, interpolation=True)),
        "steps": ("u1", table(raw_0=2, phys_0=0.1, raw_1=17, phys_1=0.9, raw_2=40, phys_2=-5.3)),
        # Not of integers: asammdf finds these in the wrong range.
        "ranges of doubles": ("f8", table(phys_0=1.25, phys_1=2.5, default=-1, **low_high)),
        "keys": ("u1", table(val_0=1, text_0=b"one", val_1=5, text_1="fünf".encode(), default_addr=b"other")),
        "spans": ("u1", table(text_0=b"low", text_1=b"high", default_addr=b"between", **low_high)),
        "keys and scale": ("u1", table(val_0=63, text_0=b"failed", default_addr=dict(a=0.5, b=-40))),
        "bits": ("u1", table(
            mask_0=1, mask_1=6,
            text_0=dict(val_0=0, text_0=b"off", val_1=1, text_1=b"on", default_addr=b""),
            text_1=dict(val_0=2, text_0=b"two", val_1=4, text_1=b"four", default_addr=b"neither"),
        )),
    }


def signals(rows, seed, left_out=()):
    """Signals of all types over one clock."""
    random = np.random.default_rng(seed)
    time = np.arange(rows) * 0.01 + 0.005
    found = []

    def add(name, values, **words):
        found.append(Signal(values, time, name=name, **words))

    add("speed", random.normal(20, 5, rows), unit="m/s", comment="speed of the <car> & its \"driver\"")
    add("angle", random.normal(0, 5, rows).astype("f4"), unit="°", comment="<CNcomment><TX>steering</TX></CNcomment>")
    for kind in ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", ">i2", ">u4", ">i8", ">f4", ">f8"]:
        if kind.endswith(("f4", "f8")):
            values = random.normal(0, 1, rows).astype(kind)
        else:
            limits = np.iinfo(kind)
            values = random.integers(limits.min, limits.max, rows, endpoint=True, dtype=np.dtype(kind).newbyteorder("=")).astype(kind)
            values[:2] = [limits.min, limits.max]
        add(f"type {kind}", values)
    extremes = np.resize([0.0, -0.0, np.inf, -np.inf, np.nan, 5e-324, 1.7976931348623157e308], rows)
    add("extremes", extremes)
    add("sometimes", random.normal(0, 1, rows), invalidation_bits=random.random(rows) < 0.3)
    add("seldom", random.integers(0, 100, rows).astype("u2"), invalidation_bits=random.random(rows) < 0.01)
    for name, (kind, conversion) in conversions().items():
        if name in left_out:
            continue
        whole = random.integers(0, 64, rows)
        raw = whole.astype(kind) if kind != "f8" else np.where(random.random(rows) < 0.2, whole, random.uniform(-5, 60, rows))
        if "spans" in name or "keys" in name:
            raw[:6] = [0, 1, 5, 10, 20, 63]
        add(name, raw, conversion=conversion, unit="u")
    return found


def texts(rows):
    """Texts of any length on a slower clock."""
    time = np.arange(rows) * 0.37
    words = ["", "gear", "a much longer text than the others", "ä°µ"]
    values = np.array([f"{words[row % 4]}{row}".encode() for row in range(rows)])
    return [
        Signal(values, time, name="word", encoding="utf-8"),
        Signal(np.arange(rows, dtype="u1"), time, name="row"),
    ]


def write(folder):
    for version in ["4.00", "4.10", "4.11", "4.20"]:
        for compression in [0, 1, 2]:
            for fragment in [None, 4000]:
                with MDF(version=version) as mdf:
                    mdf.configure(write_fragment_size=fragment or 0)
                    mdf.append(signals(500, compression), acq_name="fast", comment="made")
                    mdf.append(texts(101), acq_name="slow")
                    mdf.append(Signal(np.zeros(0), np.zeros(0), name="empty"))
                    name = f"{version}_{compression}_{'fragments' if fragment else 'whole'}.mf4"
                    mdf.save(folder / name, compression=compression, overwrite=True)
    # MDF 3 has no bits as texts; of X1 in a formula asammdf makes X11 there.
    no_such = ["bits", "algebraic"]
    for version in ["2.14", "3.00", "3.10", "3.20", "3.30"]:
        with MDF(version=version) as mdf:
            mdf.append(signals(500, 3, no_such), acq_name="fast", comment="made")
            mdf.append(texts(101), acq_name="slow")
            mdf.append(Signal(np.zeros(0), np.zeros(0), name="empty"))
            saved = mdf.save(folder / f"{version}.mdf", overwrite=True)
            pathlib.Path(saved).rename(folder / f"{version}.mf4")
    with MDF(version="4.10") as mdf:
        time = np.arange(300) * 0.1
        rows = np.arange(300 * 6).reshape(300, 2, 3)
        image = np.rec.fromarrays([rows.astype("u2")], dtype=np.dtype([("map", "<u2", (2, 3))]))
        mdf.append(Signal(image, time, name="map"))
        mdf.append(Signal(np.arange(300), time, name="same"))
        mdf.append(Signal(np.arange(200) / 3, np.arange(200) / 7, name="same"))
        mdf.save(folder / "arrays.mf4", overwrite=True)
    rows = 1_000_000
    random = np.random.default_rng(7)
    for compression in [0, 2]:
        with MDF(version="4.10") as mdf:
            time = np.arange(rows) * 0.001
            mdf.append([
                Signal(np.cumsum(random.normal(0, 1, rows)), time, name="walk"),
                Signal(random.integers(0, 2**16, rows).astype("u2"), time, name="count", conversion=table(a=0.01, b=2)),
                Signal(random.integers(-(2**63), 2**63 - 1, rows), time, name="wide"),
            ])
            mdf.save(folder / f"million_{compression}.mf4", compression=compression, overwrite=True)


def text_of(values, encoding):
    encoding = {"utf-16-le": "utf-16-le", "utf-16-be": "utf-16-be", "latin-1": "latin-1"}.get(encoding, "utf-8")

    def one(value):
        if isinstance(value, bytes):
            # numpy drops zeros at the end, also the upper half of a character.
            if encoding == "utf-16-le" and len(value) % 2:
                value += b"\0"
            try:
                # It writes UTF-8 into tables of MDF 3, and reads them as Latin-1.
                return value.decode("utf-8" if encoding == "latin-1" else encoding).split("\0")[0]
            except UnicodeDecodeError:
                return value.decode(encoding).split("\0")[0]
        return str(value)

    return [one(value) for value in values.tolist()]


def channel(mdf, group, index):
    """The values of a channel as asammdf has them."""
    described = mdf.groups[group].channels[index]
    signal = mdf.get(group=group, index=index, ignore_invalidation_bits=True)
    samples = signal.samples
    invalid = signal.invalidation_bits
    said = {
        "group": group,
        "name": described.name,
        # It leaves out the unit of a conversion, which counts where the channel has none.
        "unit": signal.unit or getattr(described.conversion, "unit", ""),
        "comment": signal.comment,
        "invalid": np.nonzero(invalid)[0].tolist() if invalid is not None else [],
    }
    arrays = [signal.timestamps.astype("f8")]
    if samples.dtype.names:
        grid = samples[samples.dtype.names[0]]
        said["elements"] = [list(place) for place in np.ndindex(grid.shape[1:])]
        arrays += [np.ascontiguousarray(grid[(slice(None), *place)]).astype("f8") for place in said["elements"]]
    elif samples.dtype.kind in "SO":
        said["texts"] = text_of(samples, signal.encoding)
    else:
        if samples.dtype.kind in "iu" and samples.dtype.itemsize == 8 and len(samples) < 10_000:
            said["integers"] = [str(value) for value in samples.tolist()]
        arrays.append(samples.astype("f8"))
    return said, arrays


def read(folder):
    for path in sorted(folder.glob("*.mf4")):
        said, refused, data = [], [], bytearray()
        with MDF(path) as mdf:
            for group, content in enumerate(mdf.groups):
                for index, described in enumerate(content.channels):
                    # Elements that asammdf adds to an array; of two dimensions their places are wrong, those in the array are right.
                    if described.name.endswith("]"):
                        continue
                    try:
                        one, arrays = channel(mdf, group, index)
                    except Exception as error:  # what the judge cannot read it does not judge
                        refused.append(f"{described.name}: {error!r}")
                        continue
                    one["at"], one["lengths"] = len(data), [len(array) for array in arrays]
                    for array in arrays:
                        data += array.astype("<f8").tobytes()
                    said.append(one)
            start = mdf.header.start_time.timestamp()
        path.with_suffix(".bin").write_bytes(data)
        path.with_suffix(".json").write_text(json.dumps({"channels": said, "refused": refused, "start": start}))


if __name__ == "__main__":
    {"write": write, "read": read}[sys.argv[1]](pathlib.Path(sys.argv[2]))
    print(__version__)
