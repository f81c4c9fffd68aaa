"""Runs a command and measures what it took."""

import os
import subprocess
import sys
import tempfile
import time


def measured(command, passes=(0,)):
    """Processor time [s] with that of its children, wall time [s] and largest memory [MB]; other exit codes than `passes` end the benchmark."""
    with tempfile.TemporaryFile() as said:
        begin = time.perf_counter()
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=said)
        _, status, used = os.wait4(process.pid, 0)
        wall = time.perf_counter() - begin
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode not in passes:
            said.seek(0)
            sys.exit(f"{command}: exit code {process.returncode}\n{said.read().decode(errors='replace')}")
    return used.ru_utime + used.ru_stime, wall, used.ru_maxrss / 1e3
