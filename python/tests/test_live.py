"""Tests with the running system named by SKETCHNAV_SYSTEM. tests/house/python_package.rs starts it and runs these."""

import itertools
import os

import numpy as np
import pytest

import sketchnav

SYSTEM = os.environ.get("SKETCHNAV_SYSTEM")
pytestmark = pytest.mark.skipif(SYSTEM is None, reason="SKETCHNAV_SYSTEM names no running system")


def test_scans_are_views_of_shared_memory():
    lab = sketchnav.connect(SYSTEM)
    for scan in itertools.islice(lab.scan, 5):
        ranges = scan["ranges_m"]
        assert ranges.base is not None and not ranges.flags.writeable
        assert np.isfinite(ranges[: scan["beam_count"]]).any()
        assert scan.source_seq == scan.seq


def test_messages_that_are_kept_must_be_copied():
    """Regression test: a list of messages failed with an error of the library that did not mention copies."""
    scans = sketchnav.connect(SYSTEM).scan
    with pytest.raises(sketchnav.TooManyMessages, match=r"at most 8 messages.*message\.copy\(\)"):
        list(itertools.islice(scans, 60))
    assert len([scan.copy() for scan in itertools.islice(sketchnav.connect(SYSTEM).scan, 20)]) == 20


def test_nobody_writes_through_a_view():
    scan = next(sketchnav.connect(SYSTEM).scan)
    with pytest.raises((ValueError, TypeError)):
        scan["ranges_m"][0] = 1.0
    with pytest.raises((ValueError, TypeError)):
        scan.data["header"]["seq"] = 1
    mine = scan.copy()
    mine["ranges_m"][0] = 1.0


def test_messages_come_in_order_and_once():
    numbers = [message.seq for message in itertools.islice(sketchnav.connect(SYSTEM).estimate, 40)]
    assert numbers == sorted(set(numbers))


def test_a_latched_channel_hands_over_what_holds():
    sketch = next(sketchnav.connect(SYSTEM).sketch)
    assert sketch.cells.size == sketch["width_px"] * sketch["height_px"]
    assert set(np.unique(sketch.cells)) <= {0, 100}


def test_texts_are_texts():
    status = next(sketchnav.connect(SYSTEM).status)
    assert isinstance(status["name"], str) and status["name"]


def test_what_is_not_there_is_told():
    with pytest.raises(sketchnav.NotRunning, match=SYSTEM):
        sketchnav.connect("nobody")
    lab = sketchnav.connect(SYSTEM)
    with pytest.raises(AttributeError, match="expected one of"):
        lab.wind
    with pytest.raises(LookupError, match="relations"):
        lab.channel("relations")


def test_another_layout_is_refused(monkeypatch):
    from sketchnav import live

    expected, *rest = live.CHANNELS["scan"]
    monkeypatch.setitem(live.CHANNELS, "scan", (expected + "x", *rest))
    with pytest.raises(sketchnav.WrongType, match="another type"):
        sketchnav.connect(SYSTEM).channel("scan")


def test_more_readers_than_there_are_places_leave_the_pipeline_its_own():
    lab = sketchnav.connect(SYSTEM)
    readers = []
    with pytest.raises(sketchnav.TooManyReaders):
        for _ in range(12):
            readers.append(lab.channel("tick"))
    assert 1 <= len(readers) <= 5
