"""Stands in for the program `hq`, which the Python package of HyperQueue does not have: its server and workers, and four of its commands.

hq.py FOLDER serve CORES runs a server and a worker in this process; every other line is one of `hq`: submit, job list, job cancel, task list.
"""

import argparse
import json
import os
import sys
import threading
import time
from pathlib import Path

from hyperqueue import Job, LocalCluster
from hyperqueue.client import Client
from hyperqueue.cluster import WorkerConfig

folder = Path(sys.argv[1])
# The jobs of the server by their names, which its interface for Python does not tell.
known = folder / "jobs.json"


def serve(cores):
    known.unlink(missing_ok=True)
    cluster = LocalCluster(str(folder), WorkerConfig(cores=cores))
    (folder / "ready").write_text(str(os.getpid()))
    print(cluster, flush=True)
    while True:
        time.sleep(1)


def jobs():
    return json.loads(known.read_text()) if known.exists() else []


def submit(client, words):
    parser = argparse.ArgumentParser()
    for option in ["--output-mode", "--name", "--array", "--cwd", "--stdout", "--stderr"]:
        parser.add_argument(option, required=True)
    parser.add_argument("command", nargs="+")
    given = parser.parse_args(words)
    first, last = map(int, given.array.split("-"))
    assert first == 0 and given.stderr == "none"
    # As `hq` does: a task that fails ends no other one.
    job = Job(max_fails=None)
    for task in range(last + 1):
        stdout = given.stdout.replace("%{CWD}", given.cwd).replace("%{TASK_ID}", str(task))
        job.program(given.command, cwd=given.cwd, stdout=stdout, stderr=None)
    number = client.submit(job).id
    known.write_text(json.dumps(jobs() + [{"id": number, "name": given.name, "tasks": last + 1}]))
    return {"id": number}


def tasks(client, job):
    """The states of the tasks of a job: the server tells which failed, and whether all ended."""
    failed = client.connection.get_failed_tasks([job["id"]])[job["id"]]
    told, counts = threading.Event(), {}

    def note(progress):
        counts.update(progress[job["id"]])
        told.set()

    wait = threading.Thread(target=client.connection.wait_for_jobs, args=([job["id"]], note), daemon=True)
    wait.start()
    told.wait(5)
    rest = "finished" if counts["completed"] else "running"
    states = {task: "failed" if task in failed else rest for task in range(job["tasks"])}
    return [{"id": task, "state": state} for task, state in states.items()]


def answer(words):
    client = Client(str(folder))
    match words:
        case ["submit", *rest]:
            return submit(client, rest)
        case ["job", "list", "--all", "--output-mode=json"]:
            client.connection.get_failed_tasks([])
            return jobs()
        case ["task", "list", numbers, "--output-mode=json"]:
            wanted = set(map(int, numbers.split(",")))
            return {str(job["id"]): tasks(client, job) for job in jobs() if job["id"] in wanted}
    raise SystemExit(f"unexpected arguments: {words}")


if sys.argv[2] == "serve":
    serve(int(sys.argv[3]))
if not (folder / "ready").exists():
    sys.exit("No online server found: start one by hq server start")
print(json.dumps(answer(sys.argv[2:])), flush=True)
# A thread may wait for the end of a job.
os._exit(0)
