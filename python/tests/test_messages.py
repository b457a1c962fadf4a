"""Tests of messages and channels as classes: declared, filled and read. `tests/missions/python.rs` runs them with the wheel."""

import ast
import enum
import json
import pathlib
from typing import Annotated

import sketchnav
from sketchnav import Array, Channel, Code, Count, Message, Part, PoseM, Text, Zero, f32, f64, navigator, u32, u64
from sketchnav.channels import SONAR


class State(enum.IntEnum):
    WAITING = 1
    TIMED_OUT = 2


class Wall(Part):
    """A wall."""

    from_m: Annotated[memoryview, Array(f64, 2), "Where it begins."]
    certainty: f32
    points: u32


class Room(Message, version=3, frame="map"):
    """A room."""

    pose: Annotated[PoseM, "Where the robot is."]
    walls: Annotated[list[Wall], Array(Wall, 4, count="wall_count"), "The walls."]
    wall_count: Annotated[u32, Count()]
    state: Annotated[u32, Code(State)]
    name: Annotated[str, Text(24), "The name of the room."]
    seen_m: Annotated[memoryview, Array(f32, 4, count="seen_count")]
    seen_count: Annotated[u32, Count()]
    reserved: Annotated[u32, Zero()]


def refused(call, error, words):
    try:
        call()
    except error as found:
        assert words in str(found), found
    else:
        raise AssertionError(f"expected: {words}")


ROOMS = Channel("rooms", Room, role="detail", writer="localizer", readers=["pad"])
ROOMS._declare("rooms")
assert "uint32 TIMED_OUT=2" in ROOMS.definition and "sketchnav_msgs/Wall[] walls" in ROOMS.definition, ROOMS.definition

room = Room._of(memoryview(bytearray(Room._layout["size"])))
walls = [{"from_m": [1, 2], "certainty": 0.5, "points": 3}, {"points": 4}]
room._set({"pose": {"x_m": 2.0}, "walls": walls, "name": "küche", "state": State.TIMED_OUT, "seen_m": [0.5, 1.5]})
assert (room.pose.x_m, room.name, room.state, room.wall_count, room.seen_count) == (2.0, "küche", 2, 2, 2)
assert isinstance(room.walls[0], Wall) and room.walls[0].from_m.tolist() == [1.0, 2.0] and len(room.walls) == 2
assert room.seen_m.tolist() == [0.5, 1.5] and room.seen_m.format == "f"
copy = room.copy()
assert copy == room
copy.pose.x_m = 3.0
assert copy != room
room.name = "ü" * 20
assert room.name == "ü" * 12, "cut at a character"

refused(lambda: room._set({"nam": "x"}), TypeError, "expected one of header, pose, walls")
refused(lambda: setattr(room, "walls", [{}] * 5), ValueError, "Room.walls: expected at most 4 entries, found 5")
refused(lambda: setattr(room, "state", -1), ValueError, "Room.state")
refused(lambda: setattr(room, "misspelt", 1), AttributeError, "misspelt")


class Gap(Message):
    small: f32
    large: u64


gap = Channel("gap", Gap, role="detail", writer="localizer", readers=[])
refused(lambda: gap._declare("gaps"), ValueError, "Gap.large: expected no gap before the field")
refused(lambda: Channel("a b", Room, role="detail", writer="localizer", readers=[])._declare("gaps"), ValueError, "a name of at most")
refused(lambda: Channel("gap", Room, role="command", writer="localizer", readers=[])._declare("gaps"), ValueError, "role: expected")
refused(lambda: Channel("gap", Room, role="detail", writer="nobody", readers=[])._declare("gaps"), ValueError, "expected one of world")

scan = SONAR.message._of(memoryview(bytearray(SONAR.message._layout["size"])))
scan.ranges_m = [1.0, 2.0]
assert scan.sonar_count == 2 and json.dumps(scan.ranges_m.tolist()) == "[1.0, 2.0]"

# The error of a stage names a line of the stage's file, not the line of the package that raised the exception.
try:
    scan._set({"rangs_m": [1.0]})
except Exception as error:
    file, _, calls = navigator._calls(error.__traceback__, 10)
    assert file == __file__ and "rangs_m" in calls and "in _set" not in calls, calls
else:
    raise AssertionError("expected: no such field")

stub = ast.parse(pathlib.Path(sketchnav.__file__).with_suffix(".pyi").read_text())
names = {alias.asname for line in stub.body if isinstance(line, ast.ImportFrom) for alias in line.names}
assert names == set(sketchnav.__all__), names ^ set(sketchnav.__all__)
