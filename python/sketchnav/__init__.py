"""Reads sketchnav's running systems and recordings.

Live messages are NumPy structures that look at shared memory itself, read-only and without a copy:

    import sketchnav

    lab = sketchnav.connect("lab")
    for scan in lab.scan:
        print(scan.stamp_s, scan["ranges_m"][: scan["beam_count"]].min())

Recordings are pandas frames:

    run = sketchnav.open("out/demo-001/building-a.mcap")
    run.frame("estimate")[["pose.position.x", "pose.position.y"]].plot()

Readers only: there is no way to write a channel from here.
"""

from .live import Channel, Message, NotRunning, System, TooManyReaders, WrongType, connect, systems
from .recordings import Recording, open_recording

open = open_recording

__all__ = [
    "Channel",
    "Message",
    "NotRunning",
    "Recording",
    "System",
    "TooManyReaders",
    "WrongType",
    "connect",
    "open",
    "systems",
]
