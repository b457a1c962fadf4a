"""Tests with the recording named by SKETCHNAV_RECORDING. tests/house/python_package.rs creates it and runs these."""

import os
import subprocess
import sys

import numpy as np
import pytest

import sketchnav

pytest.importorskip("pandas")
pytest.importorskip("mcap_ros2")
RECORDING = os.environ.get("SKETCHNAV_RECORDING")
pytestmark = pytest.mark.skipif(RECORDING is None, reason="SKETCHNAV_RECORDING names no recording")


def test_every_topic_is_a_frame():
    run = sketchnav.open(RECORDING)
    for topic, count in run.topics.items():
        assert len(run.frame(topic)) == count, topic


def test_fields_are_columns():
    estimates = sketchnav.open(RECORDING).frame("estimate")
    assert estimates.index.is_monotonic_increasing and estimates.index.name == "time_s"
    assert estimates["pose.position.x"].dtype == np.float64
    scans = sketchnav.open(RECORDING).frame("/scan")
    assert isinstance(scans["ranges"].iloc[0], np.ndarray)


def test_a_recording_of_several_files_says_how_to_make_one(tmp_path):
    (tmp_path / "run_0.mcap").touch()
    with pytest.raises(ValueError, match="sketchnav merge"):
        sketchnav.open(tmp_path / "run.mcap")


def test_a_folder_stands_for_its_only_recording(tmp_path):
    """Regression test: every command accepts the folder of a run, but this function did not."""
    (tmp_path / "run.mcap").symlink_to(os.path.abspath(RECORDING))
    assert sketchnav.open(tmp_path).topics == sketchnav.open(RECORDING).topics
    (tmp_path / "other.mcap").touch()
    with pytest.raises(ValueError, match="a folder with one recording, found 2"):
        sketchnav.open(tmp_path)


def test_a_folder_with_a_split_recording_says_how_to_make_one(tmp_path):
    for part in range(2):
        (tmp_path / f"run_{part}.mcap").touch()
    with pytest.raises(ValueError, match=r"sketchnav merge .*run\.mcap"):
        sketchnav.open(tmp_path)


def test_a_topic_that_is_not_there_is_told():
    with pytest.raises(KeyError, match="expected one of"):
        sketchnav.open(RECORDING).frame("wind")


WITHOUT_ICEORYX2 = """
import pathlib, sys
sys.modules["iceoryx2"] = None
import sketchnav
assert sketchnav.open(sys.argv[1]).topics
sketchnav.System("lab", pathlib.Path(sys.argv[2]))
"""


def test_only_a_running_system_needs_the_library_of_shared_memory(tmp_path):
    """Regression test: the package could not be imported without iceoryx2."""
    command = [sys.executable, "-c", WITHOUT_ICEORYX2, RECORDING, tmp_path]
    ended = subprocess.run(command, capture_output=True, text=True)
    assert ended.returncode == 1 and "pip install iceoryx2==" in ended.stderr, ended.stderr
