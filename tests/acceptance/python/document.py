"""Prints the text of a document in a replay: document.py RRD ENTITY"""
import sys

from rerun.experimental import RrdReader

for chunk in RrdReader(sys.argv[1]).stream():
    if chunk.entity_path == sys.argv[2]:
        for (text,) in chunk.to_record_batch().column("TextDocument:text").to_pylist():
            print(text)
