"""Runs an experiment on two Dask workers, kills one of them while it works, and prints the report of `sketchnav.evaluate`.

    two_workers.py PROGRAM SUITE [OPTION ...]

tests/house/python_package.rs runs this and compares the report with that of a single machine.
"""

import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

import distributed


def worker(address):
    command = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nworkers", "1", "--nthreads", "1"]
    # Without a nanny, the worker is not restarted.
    command += ["--no-nanny", "--no-dashboard"]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)


def busy_pid(client, evaluation):
    """Returns the process of a worker that is running a job."""
    while evaluation.poll() is None:
        for address, keys in client.processing().items():
            if keys:
                return client.run(os.getpid, workers=[address])[address]
        time.sleep(0.01)
    sys.exit("the evaluation ended before a worker was seen at work")


def main():
    program, suite, *options = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "scheduler.json"
        command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--scheduler-file", str(file)]
        command += ["--port", "0", "--host", "127.0.0.1", "--no-dashboard"]
        scheduler = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        workers = []
        try:
            while not file.exists():
                assert scheduler.poll() is None, "the scheduler has ended"
                time.sleep(0.02)
            with distributed.Client(scheduler_file=str(file)) as client:
                address = client.scheduler.address
                workers += [worker(address), worker(address)]
                client.wait_for_workers(2)
                arguments = [sys.executable, "-m", "sketchnav.evaluate", suite, "--scheduler", address]
                arguments += ["--program", program, "--", *options]
                evaluation = subprocess.Popen(arguments)
                os.kill(busy_pid(client, evaluation), signal.SIGKILL)
                sys.exit(evaluation.wait())
        finally:
            for process in [*workers, scheduler]:
                process.kill()
                process.wait()


if __name__ == "__main__":
    main()
