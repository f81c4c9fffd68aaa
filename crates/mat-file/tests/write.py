"""Writes HDF5 as MATLAB and as other programs do, with h5py: write.py FOLDER."""

import sys
from pathlib import Path

import h5py
import numpy as np

folder = Path(sys.argv[1])
kind = lambda name: np.bytes_(name)


def matlab(file):
    """What save('-v7.3') writes: columns first, cells of references, fields of arrays of structs."""
    refs = file.create_group("#refs#")

    def array(where, name, values, as_class, **options):
        made = where.create_dataset(name, data=np.asarray(values), **options)
        made.attrs["MATLAB_class"] = kind(as_class)
        return made

    def text(where, name, value):
        units = np.frombuffer(value.encode("utf-16-le"), "<u2").reshape(-1, 1)
        made = array(where, name, units, "char")
        made.attrs["MATLAB_int_decode"] = np.int32(2)
        return made

    def cell(where, name, members):
        made = where.create_dataset(name, (len(members), 1), dtype=h5py.ref_dtype)
        made[:, 0] = [it.ref for it in members]
        return made

    ramp = np.arange(1000.0).reshape(1, 1000)
    array(file, "speed", ramp, "double", chunks=(1, 300), compression="gzip", shuffle=True)
    array(file, "matrix", np.array([[1, 2], [3, 4], [5, 6]], np.int16), "int16")
    array(file, "single", np.array([[0.5]], "<f4"), "single")
    array(file, "on", np.array([[1, 0]], np.uint8), "logical")
    array(file, "big", np.array([[1.5, -2.5]], ">f8"), "double")
    empty = array(file, "nothing", np.array([0, 3], np.uint64), "double")
    empty.attrs["MATLAB_empty"] = np.uint8(1)
    text(file, "name", "Größe 10\"")
    names = [text(refs, "a", "FX"), text(refs, "b", "P")]
    cell(file, "names", names).attrs["MATLAB_class"] = kind("cell")
    mixed = [names[0], array(refs, "c", np.array([[3.0, 4.0]]), "double")]
    cell(file, "mixed", mixed).attrs["MATLAB_class"] = kind("cell")
    channel = file.create_group("channel")
    channel.attrs["MATLAB_class"] = kind("struct")
    array(channel, "value", np.array([[7.0, 8.0]]), "double")
    runs = file.create_group("run")
    runs.attrs["MATLAB_class"] = kind("struct")
    cell(runs, "FY", [array(refs, f"r{k}", np.array([[k + 0.5]]), "double") for k in (1, 2)])
    sparse = file.create_group("thin")
    sparse.attrs["MATLAB_sparse"] = np.uint64(3)
    array(sparse, "data", np.array([1.0]), "double")
    array(file, "waves", np.array([[1 + 2j]]), "double")
    table = array(file, "table", np.array([[3707764736, 2, 1, 1, 1, 1]], np.uint32), "table")
    table.attrs["MATLAB_object_decode"] = np.int32(3)


def plain(file):
    """A log as h5py writes it, with a unit as attribute."""
    log = file.create_group("log")
    log["time"] = np.arange(5) / 100
    log["v_x"] = np.arange(5, dtype="f4")
    log["v_x"].attrs["units"] = "km/h"
    log["wheels"] = np.arange(20.0).reshape(5, 4)
    log["brake"] = np.array([True, False, True, True, False])
    log["note"] = "dry"
    file["nowhere"] = h5py.SoftLink("/lost")
    file["elsewhere"] = h5py.ExternalLink("lost.h5", "/lost")


path = folder / "matlab.mat"
with h5py.File(path, "w", userblock_size=512) as file:
    matlab(file)
head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\0\2IM"
with open(path, "r+b") as file:
    file.write(head)
for name, version in [("old.h5", "earliest"), ("new.h5", "v110")]:
    with h5py.File(folder / name, "w", libver=(version, "v110")) as file:
        plain(file)
with h5py.File(folder / "circle.h5", "w") as file:
    below = file.create_group("a/b")
    below["up"] = file["a"]
with h5py.File(folder / "linked.h5", "w") as file:
    file["a"] = [1.0]
    file["b"] = h5py.SoftLink("/a")
