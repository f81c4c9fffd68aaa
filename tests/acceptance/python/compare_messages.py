"""Insists that a recovered recording is whole and holds every message of the broken one: compare_messages.py BROKEN RECOVERED"""
import sys

from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader, make_reader


def messages(iterator):
    return [(channel.topic, message.log_time, message.data) for _, channel, message in iterator]


found = []
with open(sys.argv[1], "rb") as file:
    try:
        for _, channel, message in NonSeekingReader(file).iter_messages(log_time_order=False):
            found.append((channel.topic, message.log_time, message.data))
    except McapError:
        pass
with open(sys.argv[2], "rb") as file:
    reader = make_reader(file)
    whole = messages(reader.iter_messages(log_time_order=False))
    summary = reader.get_summary()
# What was not in the file yet comes from the one beside it.
assert found and whole[: len(found)] == found, (len(whole), len(found))
assert summary.statistics.message_count == len(whole)
print(len(whole), "messages")
