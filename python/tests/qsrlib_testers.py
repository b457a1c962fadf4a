"""Runs QSRlib's own testers against `sketchnav.relations.qsrlib`, which replaces QSRlib and ROS.

    python qsrlib_testers.py strands_qsr_lib/qsr_lib/tests [TESTER ...]

Prints how many tests of each tester pass, and the last line of the error for each that does not. An idiom of Python 2 is replaced,
and `argprobd`, which uses random numbers and is rejected, is left out of what `multiple_tester` expects of all calculi together.
"""

import functools
import importlib
import pickle
import re
import sys
import time
import unittest
from pathlib import Path
from types import ModuleType, SimpleNamespace

from sketchnav.relations import qsrlib


class Client:
    """Replaces QSRlib's ROS client: calls the library directly."""

    def __init__(self, *_):
        pass

    def make_ros_request_message(self, message):
        return message

    def request_qsrs(self, message):
        return SimpleNamespace(data=pickle.dumps(qsrlib.QSRlib().request_qsrs(message)))


def provide(name, **contents):
    module = ModuleType(name)
    module.__dict__.update(contents)
    sys.modules[name] = module


def provide_modules(folder):
    """Provides the modules that the testers import."""
    own = {name: getattr(qsrlib, name) for name in qsrlib.__all__}
    for package in ("qsrlib", "qsrlib_io", "qsrlib_ros", "roslib"):
        provide(package, __path__=[])
    for name in ("qsrlib.qsrlib", "qsrlib_io.world_trace", "qsrlib_io.world_qsr_trace"):
        provide(name, **own)
    provide("qsrlib_ros.qsrlib_ros_client", QSRlib_ROS_Client=Client)
    provide("roslib.packages", find_resource=lambda _, name: [str(folder / "data" / name)])
    provide("rospy", init_node=lambda *_: None, wait_for_service=lambda *_: None, ServiceException=OSError)
    provide("rosunit")


def run(folder, tester):
    """Runs a tester."""
    module = ModuleType(tester)
    source = re.sub(r"(\w+)\.items\(\)\[0\]", r"list(\1.items())[0]", (folder / f"{tester}.py").read_text())
    exec(compile(source, f"{tester}.py", "exec"), module.__dict__)
    suite = unittest.defaultTestLoader.loadTestsFromModule(module)
    result = unittest.TestResult()
    started = time.monotonic()
    suite.run(result)
    failed = result.failures + result.errors
    name = tester.removesuffix("_tester")
    print(f"{name}: {result.testsRun - len(failed)} of {result.testsRun} in {time.monotonic() - started:.0f} s", flush=True)
    for test, trace in failed:
        print(f"  {test.id().rpartition('.')[2]}: {trace.strip().splitlines()[-1][:200]}", flush=True)


def main():
    folder = Path(sys.argv[1])
    provide_modules(folder)
    sys.path.insert(0, str(folder))
    # The name of `assertCountEqual` in Python 2.
    unittest.TestCase.assertItemsEqual = unittest.TestCase.assertCountEqual
    # Each test reads all worlds, which takes most of the time, so they are read only once.
    loaders = importlib.import_module("unittests_data_loaders")
    for name in [name for name in vars(loaders) if name.startswith("load_input")]:
        setattr(loaders, name, functools.cache(getattr(loaders, name)))
    utils = importlib.import_module("unittests_utils")
    read = utils.unittest_read_qsrs_as_one_long_list
    utils.unittest_read_qsrs_as_one_long_list = lambda name: [re.sub(r"'argprobd:\w+', ", "", line) for line in read(name)]
    testers = sys.argv[2:] or sorted(path.stem for path in folder.glob("*_tester.py"))
    for tester in testers:
        run(folder, tester if tester.endswith("_tester") else f"{tester}_tester")


if __name__ == "__main__":
    main()
