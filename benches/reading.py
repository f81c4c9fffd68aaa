#!/usr/bin/env python3
"""Measures how long it takes to read signals of a run into pandas: from run.parquet, from run.csv, and from run.mcap.

usage: reading.py [--values N] [--program trackside]

Needs pandas, pyarrow, mcap and mcap-protobuf-support. The run has 100 signals. MCAP is read by the readers of others, each field of each
message, into arrays of numbers; `trackside convert` is the other way from there, through Parquet. Each way reads the same numbers.
"""

import argparse
import array
import subprocess
import tempfile
import time
from pathlib import Path

import pandas
import pyarrow.csv
import pyarrow.parquet

SIGNALS = 100


def scenario(rows):
    """A run of so many rows of 100 sines."""
    text = f"[time]\nstep = 0.001\nstop = {(rows - 1) / 1000}\n"
    for place in range(SIGNALS):
        shape = f"sine = {{ amplitude = {1 + place}.0, frequency = {0.1 * (1 + place):.1f} }}"
        text += f'\n[[signal]]\nname = "s.v{place:03}"\nunit = "m/s"\n{shape}\n'
    return text


def from_parquet(folder):
    return pyarrow.parquet.read_table(folder / "run.parquet").to_pandas().set_index("time")


def from_csv(folder):
    frame = pyarrow.csv.read_csv(folder / "run.csv").to_pandas()
    frame.columns = [title.split(" [")[0] for title in frame.columns]
    return frame.set_index("time")


def from_mcap(folder):
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    times, columns = array.array("d"), None
    with open(folder / "run.mcap", "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, message, fields in reader.iter_decoded_messages(topics=["/s/outputs"]):
            if columns is None:
                names = {key[4:]: f"s.{name}" for key, name in channel.metadata.items() if key.startswith("fmi:")}
                columns = {field: array.array("d") for field in names}
            times.append(message.log_time / 1e9)
            for field, column in columns.items():
                column.append(getattr(fields, field))
    frame = pandas.DataFrame({names[field]: column for field, column in columns.items()})
    return frame.set_index(pandas.Index(times, name="time"))


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--values", type=int, default=100_000_000)
    arguments.add_argument("--program", default="target/release/trackside")
    options = arguments.parse_args()
    with tempfile.TemporaryDirectory(dir=".") as name:
        folder = Path(name)
        (folder / "sines.toml").write_text(scenario(options.values // SIGNALS))
        words = [options.program, "run", folder / "sines.toml", "--out", folder / "run", "--rerun", "off", "--parquet", "--csv"]
        begin = time.monotonic()
        subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
        print(f"run with all three recordings: {time.monotonic() - begin:.1f} s")
        first = None
        for file, read in [("run.parquet", from_parquet), ("run.csv", from_csv), ("run.mcap", from_mcap)]:
            begin = time.monotonic()
            frame = read(folder / "run")
            seconds = time.monotonic() - begin
            first = frame if first is None else first
            assert (frame[first.columns].to_numpy() == first.to_numpy()).all(), file
            size = (folder / "run" / file).stat().st_size / 1e6
            print(f"{file}: {size:.0f} MB, {frame.size:,} values in {seconds:.2f} s")


if __name__ == "__main__":
    main()
