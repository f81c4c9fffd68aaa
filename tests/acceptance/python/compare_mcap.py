"""Compares every sample of a recording with the table of the same run, bit for bit: compare_mcap.py MCAP CSV"""
import csv
import math
import struct
import sys

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

recording, table = sys.argv[1:]
with open(table, newline="") as file:
    titles, *rows = csv.reader(file)
# Titles have the unit behind the name: `plant.v_x [m/s]`.
names = [title.partition(" [")[0] for title in titles]
columns = {name: column for column, name in enumerate(names)}
units = {name: title.removeprefix(name).strip(" []") for name, title in zip(names, titles)}
assert titles[0] == "time [s]", titles[0]
row_at = {round(float(row[0]) * 1e9): row for row in rows}


def bits(number):
    return struct.pack("<d", number)


with open(recording, "rb") as file:
    reader = make_reader(file, decoder_factories=[DecoderFactory()])
    summary = reader.get_summary()
    assert summary.chunk_indexes, "no chunks"
    for chunk in summary.chunk_indexes:
        assert chunk.compression == "lz4", chunk.compression
        assert chunk.uncompressed_size <= 256 << 10, chunk.uncompressed_size
    fields, seen = {}, set()
    well_known = {"/log": "foxglove.Log", "/tf": "foxglove.FrameTransform"}
    for channel in summary.channels.values():
        if channel.topic in well_known:
            assert summary.schemas[channel.schema_id].name == well_known[channel.topic]
            continue
        node = channel.topic.split("/")[1]
        variables = {key[4:]: name for key, name in channel.metadata.items() if key.startswith("fmi:")}
        fields[channel.topic] = [(field, columns[f"{node}.{name}"]) for field, name in variables.items()]
        for field, name in variables.items():
            unit = channel.metadata[f"unit:{field}"]
            assert units[f"{node}.{name}"] == unit, f"{channel.topic}: {name} is in [{unit}]"
    for outputs in (c for c in summary.channels.values() if c.topic == "/plant/outputs"):
        assert outputs.metadata["unit:v_x"] == "m/s" and outputs.metadata["unit:a_y"] == "m/s2"
    samples = poses = 0
    for _, channel, message, decoded in reader.iter_decoded_messages():
        if channel.topic == "/log":
            continue
        row = row_at[message.log_time]
        if channel.topic == "/tf":
            position, turn = decoded.translation, decoded.rotation
            pose = [float(row[columns[f"plant.{name}"]]) for name in ("X", "Y", "psi")]
            assert [position.x, position.y] == pose[:2] and (decoded.parent_frame_id, decoded.child_frame_id) == ("world", "car")
            heading = 2 * math.atan2(turn.z, turn.w)
            assert abs(math.remainder(heading - pose[2], 2 * math.pi)) < 1e-12 and turn.x == turn.y == 0, heading
            seconds = decoded.timestamp.seconds * 10**9 + decoded.timestamp.nanos
            assert seconds == message.log_time, seconds
            poses += 1
            continue
        for field, column in fields[channel.topic]:
            found, expected = getattr(decoded, field), row[column]
            if isinstance(found, str):
                assert found == expected, f"{names[column]} at {row[0]} s: {found!r} {expected!r}"
                continue
            expected = float(expected)
            assert bits(found) == bits(expected), f"{names[column]} at {row[0]} s: {found!r} {expected!r}"
        seen.add((channel.topic, message.log_time))
        samples += len(fields[channel.topic])
    assert samples == len(rows) * (len(names) - 1), f"{samples} samples in {len(rows)} rows"
    assert len(seen) == len(rows) * len(fields), "a row is missing or there twice"
    # The scenarios with a plant have a pose in their view.
    assert poses == (len(rows) if "/plant/outputs" in fields else 0), poses
    metadata = {entry.name: entry.metadata for entry in reader.iter_metadata()}
    run, end = metadata["run"], metadata["end"]
    assert end["completed"] == "true" and run["step"] == "0.01" and run["seed"] == "1", run
    attached = {attachment.name for attachment in reader.iter_attachments()}
    assert attached == {f"{run['scenario']}.toml", "summary.md"}, attached
print(f"{samples} samples")
