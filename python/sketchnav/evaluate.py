"""Runs an experiment on the workers of a Dask cluster, and prints the same report as a single machine.

    python -m sketchnav.evaluate people --scheduler tcp://head:8786 -- --data /data --sample 4 -o page.html

Arguments after `--` are passed to `sketchnav eval`. A worker needs the program, from the same build, and the suite's files in
the same place. If a worker is lost, another one runs its job.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

#: Where a merged report, not a part, is written.
OUTPUT = ("-o", "--output")


def jobs_of(program, suite, options):
    """The numbers of the experiment's jobs."""
    told = _run(program, suite, options, "--list-jobs", "--json")
    return [job["job"] for job in json.loads(told)["jobs"]]


def drive(program, suite, options, job):
    """Runs one job and returns its part. Called on a worker."""
    with tempfile.TemporaryDirectory() as folder:
        part = pathlib.Path(folder) / "part.json"
        _run(program, suite, options, "--job", str(job), "-o", str(part))
        return part.read_bytes()


def _run(program, suite, options, *more):
    command = [program, "eval", suite, *options, *more]
    ended = subprocess.run(command, capture_output=True, text=True)
    if ended.returncode != 0:
        raise RuntimeError(f"{' '.join(command)}: exit code {ended.returncode}: {ended.stderr.strip()}")
    return ended.stdout


def of_jobs(options):
    """The options that determine what is driven, without those that only affect the report."""
    kept, words = [], iter(options)
    for word in words:
        if word in OUTPUT:
            next(words, None)
        elif word not in ("--json", "--verbose") and not word.startswith("--output="):
            kept.append(word)
    return kept


def main(arguments):
    """Runs the jobs, merges their parts, and prints the report. The exit code is that of `sketchnav eval`."""
    parser = argparse.ArgumentParser(
        prog="python -m sketchnav.evaluate",
        description=__doc__.splitlines()[0],
        epilog="Options after -- are passed to `sketchnav eval`.",
    )
    parser.add_argument("suite")
    parser.add_argument("--scheduler", required=True, help="address of the Dask scheduler, such as tcp://head:8786")
    parser.add_argument("--program", default="sketchnav", help="the program, on this machine and on every worker")
    parser.add_argument("--retries", type=int, default=3, help="how often to repeat a job that failed")
    split = arguments.index("--") if "--" in arguments else len(arguments)
    given, behind = parser.parse_args(arguments[:split]), arguments[split + 1 :]
    import distributed

    options = of_jobs(behind)
    jobs = jobs_of(given.program, given.suite, options)
    with distributed.Client(given.scheduler) as client, tempfile.TemporaryDirectory() as folder:
        futures = {
            client.submit(drive, given.program, given.suite, options, job, retries=given.retries, pure=False): job
            for job in jobs
        }
        for future in distributed.as_completed(futures):
            (pathlib.Path(folder) / f"{futures[future]}.json").write_bytes(future.result())
        merge = [given.program, "eval", given.suite, *behind, "--merge", folder]
        return subprocess.run(merge).returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
