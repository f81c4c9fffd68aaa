"""Prints the last time [s] in the closed chunks of an unfinished recording: last_time.py MCAP"""
import sys

from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader

last = 0.0
with open(sys.argv[1], "rb") as file:
    try:
        # Sorting needs the whole file, which is not there.
        for _, _, message in NonSeekingReader(file).iter_messages(log_time_order=False):
            last = max(last, message.log_time * 1e-9)
    except McapError:
        pass
print(last)
