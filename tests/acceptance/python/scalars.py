"""Prints the scalars of an entity of a replay, with the time [s] and the distance [cm]: scalars.py RRD ENTITY"""
import sys

from rerun.experimental import RrdReader

rows = []
for chunk in RrdReader(sys.argv[1]).stream():
    if chunk.entity_path != sys.argv[2] or chunk.is_static:
        continue
    batch = chunk.to_record_batch()
    times = [time.value * 1e-9 for time in batch.column("sim_time")]
    distances = batch.column("distance_cm").to_pylist()
    scalars = [value for (value,) in batch.column("Scalars:scalars").to_pylist()]
    rows += zip(times, distances, scalars, strict=True)
for row in sorted(rows):
    print(*row)
