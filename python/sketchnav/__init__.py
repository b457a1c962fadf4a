"""Navigators and drivers for sketchnav, and readers of its running systems and recordings.

A navigator in Python is a program that contains all of `sketchnav` along with this navigator. See `sketchnav.navigator`:

    raise SystemExit(sketchnav.main([NAVIGATOR]))

A driver is a robot, or another simulator, in place of the simulated world. See `sketchnav.driver`:

    with sketchnav.drive("lab") as robot: ...

Live messages are NumPy structures on the shared memory itself, read-only and without a copy:

    import numpy
    import sketchnav

    lab = sketchnav.connect("lab")
    for scan in lab.scan:
        # +inf is no return, and NaN an invalid reading, which nanmin skips.
        print(scan.stamp_s, numpy.nanmin(scan["ranges_m"][: scan["beam_count"]]))

Recordings are read into pandas frames, which need matplotlib to plot:

    run = sketchnav.open("out/demo-001/building-a.mcap")
    run.frame("estimate")[["pose.position.x", "pose.position.y"]].plot()

Each name is imported when it is first used. Navigators and drivers need no other package, and live messages need NumPy.
"""

import importlib

_HOMES = {
    "driver": ["Driver", "Floor", "Position", "Velocity", "drive"],
    "live": ["NotRunning", "System", "TooManyMessages", "TooManyReaders", "WrongType", "connect", "systems"],
    "recordings": ["Recording", "open_recording"],
    "messages": [
        "Array", "Channel", "Code", "Count", "Header", "Message", "Part", "PoseM", "PosePx", "Text", "Twist", "Zero", "f32", "f64",
        "u32", "u64",
    ],
    "navigator": [
        "Account", "Agenda", "Incoming", "Instant", "Navigator", "Outbox", "Run", "Stage", "Summary", "main", "program",
    ],
}  # fmt: skip
_HOME = {name: home for home, names in _HOMES.items() for name in names} | {"open": "recordings"}

__all__ = sorted(_HOME)


def __getattr__(name):
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = importlib.import_module(f".{_HOME[name]}", __name__)
    value = getattr(home, "open_recording" if name == "open" else name)
    globals()[name] = value
    return value


def __dir__():
    return __all__
