#!/usr/bin/env python3
"""Measures how fast large logs are surveyed: `trackside inspect` with and without `--all`, beside asammdf (MDF 4), mcap (MCAP) and polars (CSV).

usage: large_logs.py PROGRAM [--gigabytes N] [--rounds N] [--mcap-ranges EXAMPLE]

Needs asammdf, mcap, numpy and polars. `EXAMPLE` is the program `mcap_ranges` of the crate `recording`: the readers of MCAP and JSON in Rust. Each peer finds
the least and the largest value of every channel, as `inspect --all` does, which also finds units, rates, gaps and damage. The reader of MCAP in Python is
compared in messages alone: it decodes none. The table has medians of processor time and of wall time [s], the megabytes of the file in a second of
processor time, and the largest memory [MB].
"""

import argparse
import json
import multiprocessing
import os
import statistics
import sys
import tempfile
from pathlib import Path

from processes import measured

CHANNELS = 100
PEERS = {
    "mf4": """
import sys
from asammdf import MDF
with MDF(sys.argv[1]) as log:
    for group, content in enumerate(log.groups):
        for part in log.select([(None, group, index) for index in range(len(content.channels))], raw=True):
            part.samples.min(), part.samples.max()
""",
    "mcap": """
import sys
from mcap.reader import make_reader
with open(sys.argv[1], "rb") as file:
    print(sum(len(message.data) for _, _, message in make_reader(file).iter_messages(log_time_order=False)))
""",
    "csv": """
import sys
import polars
table = polars.scan_csv(sys.argv[1])
table.select(polars.all().min().name.prefix("min "), polars.all().max().name.prefix("max ")).collect(engine="streaming")
""",
}


def write_mf4(path, size):
    import numpy
    from asammdf import MDF, Signal

    rows = 1_000_000
    times = numpy.arange(rows) * 1e-3
    signals = [Signal(numpy.sin(times * (k + 1)), times, name=f"ch{k}", unit="m/s") for k in range(CHANNELS)]
    log = MDF(version="4.10")
    for _ in range(max(1, size // (8 * rows * (CHANNELS + 1)))):
        log.append(signals, common_timebase=True)
    log.save(path, overwrite=True)


def write_mcap(path, size):
    from mcap.writer import CompressionType, Writer

    fields = [f"c{k}" for k in range(40)]
    schema = {"type": "object", "properties": {field: {"type": "number"} for field in fields}}
    message = json.dumps({field: 0.123456789 * k for k, field in enumerate(fields)}).encode()
    with open(path, "wb") as file:
        writer = Writer(file, compression=CompressionType.NONE, chunk_size=4 << 20)
        writer.start()
        number = writer.register_schema("Sample", "jsonschema", json.dumps(schema).encode())
        channel = writer.register_channel("/x", "json", number)
        for k in range(size // len(message)):
            writer.add_message(channel, k * 1_000_000, message, k * 1_000_000)
        writer.finish()


def write_csv(path, size):
    row = ",".join(f"{0.123456789 * k:.6f}" for k in range(CHANNELS))
    with open(path, "w") as file:
        file.write("time [s]," + ",".join(f"c{k} [m/s]" for k in range(CHANNELS)) + "\n")
        for k in range(size // (len(row) + 10)):
            file.write(f"{k * 0.001:.3f},{row}\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=os.path.abspath)
    parser.add_argument("--gigabytes", type=float, default=3.0)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--mcap-ranges", type=os.path.abspath)
    arguments = parser.parse_args()
    print(f"{'log':6} {'program':24} {'processor [s]':>13} {'wall [s]':>9} {'MB/s':>6} {'memory [MB]':>11}")
    for kind, write in {"mf4": write_mf4, "mcap": write_mcap, "csv": write_csv}.items():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"large.{kind}"
            # A process of its own: the largest memory of a child counts from the memory of its parent on.
            writer = multiprocessing.get_context("spawn").Process(target=write, args=(path, int(arguments.gigabytes * 1e9)))
            writer.start()
            writer.join()
            commands = {
                "trackside inspect": [arguments.program, "inspect", str(path)],
                "trackside inspect --all": [arguments.program, "inspect", "--all", str(path)],
                "peer": [sys.executable, "-c", PEERS[kind], str(path)],
            }
            if kind == "mcap" and arguments.mcap_ranges:
                commands["peer in Rust"] = [arguments.mcap_ranges, str(path)]
                commands["peer in Rust, messages"] = [arguments.mcap_ranges, str(path), "--messages"]
            rounds = [{name: measured(words) for name, words in commands.items()} for _ in range(arguments.rounds)]
            for name in commands:
                used, wall, memory = (statistics.median(it[name][k] for it in rounds) for k in range(3))
                speed = path.stat().st_size / 1e6 / used
                print(f"{kind:6} {name:24} {used:13.2f} {wall:9.2f} {speed:6.0f} {memory:11.0f}", flush=True)


if __name__ == "__main__":
    main()
