"""Drivers in Python: a robot, or another simulator, in place of the simulated world.

    import sketchnav

    with sketchnav.drive("lab") as robot:
        while not robot.is_over:
            robot.odometry(*wheels.pose())
            robot.scan(laser.read())
            robot.tick()
            base.drive(*robot.command())

Start the system with `sketchnav run mission.toml --without world --speed 1 --system lab`. A simulated robot does not depend on
the clock, so use `drive("lab", simulated=True)`, and the default speed.
"""

import json
import math
import signal
import threading
import warnings
from collections.abc import Iterator, Mapping, Sequence
from types import TracebackType
from typing import Any, NamedTuple, Self, TypeVar

from . import _core
from .channels import SCAN, SONAR
from .messages import Channel, Message, _Common

_M = TypeVar("_M", bound=Message)

_TRUTH = _Common("truth")
_CONTACT = _Common("contact")
#: What the robot touches (`BodyKind` in schemas/src/codes.rs).
_BODIES = {"wall": 1, "furniture": 2, "person": 3}
#: The signals that ask a driver to end.
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Velocity(NamedTuple):
    """A velocity for the robot, in its own axes: x ahead, y to the left, turning counter-clockwise."""

    vx_mps: float
    vy_mps: float
    yaw_rate_radps: float


class Position(NamedTuple):
    """A pose of the robot: metres, and radians counter-clockwise from the x axis."""

    x_m: float
    y_m: float
    heading_rad: float


class Floor(NamedTuple):
    """The floor of a mission, in metres. Every corner is a pair (x, y)."""

    #: Faces of the walls, which a laser sees, as pairs of corners.
    faces: list[list[list[float]]]
    #: The walls as convex polygons, counter-clockwise. They may overlap.
    walls: list[list[list[float]]]
    #: The furniture as convex polygons.
    furniture: list[list[list[float]]]

    def segments(self) -> Iterator[list[list[float]]]:
        """Everything that a laser sees, as pairs of corners."""
        yield from self.faces
        for corners in self.furniture:
            yield from ([a, b] for a, b in zip(corners, [*corners[1:], corners[0]]))


def drive(system: str, *, simulated: bool = False) -> "Driver":
    """The driver of a system's robot, for use in a `with` statement.

    For a robot, time passes by itself. For a simulator (`simulated`), it advances by `period_s` from one tick to the next: in
    lockstep as fast as the navigators answer, otherwise by the clock.
    """
    return Driver(system, simulated=simulated)


def _beams(laser: Mapping[str, Any]) -> tuple[float, float]:
    """The direction of a laser's first beam, and the angle to the next one."""
    field_rad = math.radians(laser["field_of_view_deg"])
    # With a full turn, the last beam would coincide with the first.
    steps = laser["beams"] - (laser["field_of_view_deg"] < 360.0)
    return -field_rad / 2, field_rad / steps


class Driver:
    """The robot of a system: sends readings, ends instants, receives velocities. Only the thread that entered it may use it.

    An invalid reading is not sent. It raises `ValueError`, which names the field, what was expected and what was found. A
    driver that is started again after its death continues the numbers, the time and the odometry of the previous one.
    """

    def __init__(self, system: str, *, simulated: bool = False):
        self.system, self.is_simulated = system, simulated
        #: True once the robot must remain stationary: the mission or the system is over, or a signal requested the end.
        self.is_over = False
        self._run: Mapping[str, Any] | None = None
        self._handlers: dict[int, Any] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            self._handlers = {number: signal.getsignal(number) for number in _SIGNALS}
        facts = json.loads(_core.driver_join(self.system, self.is_simulated))
        self._run, self._period_ns = facts["run"], facts["period_ns"]
        self._odometry, self._truth = facts["odometry"], facts["truth"]
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, calls: TracebackType | None) -> None:
        self.is_over = True
        _core.driver_leave()
        for number, handler in self._handlers.items():
            if handler is not None:
                signal.signal(number, handler)

    def _of_run(self, key: str) -> Any:
        if self._run is None:
            raise RuntimeError("driver: expected a call inside `with sketchnav.drive(…)`")
        return self._run[key]

    @property
    def mission(self) -> Mapping[str, Any]:
        """The mission, with the keys of its file."""
        return self._of_run("mission")

    @property
    def robot(self) -> Mapping[str, Any]:
        """The robot, with the keys of its file."""
        return self._of_run("robot")

    @property
    def seed(self) -> int:
        """The mission's seed, from which a simulator draws its noise."""
        return self._of_run("seed")

    @property
    def period_s(self) -> float:
        """The time from one tick to the next, according to the robot's file."""
        self._of_run("robot")
        return self._period_ns / 1e9

    @property
    def start(self) -> Position:
        """For simulators: the pose in the world at which the robot begins, or at which it was when the previous driver died."""
        start = self._of_run("mission")["start"]
        at = self._truth or [*start["world"], math.radians(start["world_heading_deg"])]
        return Position(*at)

    @property
    def resumed(self) -> Position | None:
        """The last odometry pose that an earlier driver sent, or None. The first pose of this driver continues there."""
        self._of_run("robot")
        return Position(*self._odometry) if self._odometry else None

    @property
    def now_s(self) -> float:
        """The time of the mission."""
        return _core.driver_now() / 1e9

    def beams_rad(self) -> list[float]:
        """For simulators: the direction of each beam of the robot's laser, from its forward axis."""
        first_rad, step_rad = _beams(self.robot["laser"])
        return [first_rad + i * step_rad for i in range(self.robot["laser"]["beams"])]

    def floor(self) -> Floor:
        """For simulators: the floor of the mission, as described by its world."""
        return Floor(**json.loads(_core.driver_floor()))

    def scan(
        self,
        ranges_m: Sequence[float],
        *,
        age_s: float = 0.0,
        angle_min_rad: float | None = None,
        angle_increment_rad: float | None = None,
        range_min_m: float | None = None,
        range_max_m: float | None = None,
        scan_time_s: float | None = None,
    ) -> None:
        """Sends a scan, taken `age_s` ago: ranges counter-clockwise, infinity without a return, NaN if invalid (REP 117).

        Anything not given is taken from `[laser]` in the robot's file, where beams are spread evenly around the forward axis.
        The angles of another laser must be given together.
        """
        laser = self.robot.get("laser") or {}
        count = len(ranges_m)
        if (angle_min_rad is None) != (angle_increment_rad is None):
            raise ValueError("scan: expected angle_min_rad and angle_increment_rad, found one without the other")
        if angle_min_rad is None or angle_increment_rad is None:
            expected = laser.get("beams")
            if count != expected:
                said = f"{expected} ranges, as [laser] of the robot says" if laser else "a robot with [laser] in its file"
                raise ValueError(
                    f"scan: expected {said}, found {count} ranges; of another laser, give angle_min_rad and angle_increment_rad"
                )
            angle_min_rad, angle_increment_rad = _beams(laser)
        limits = {"range_min_m": range_min_m, "range_max_m": range_max_m}
        for name, limit in limits.items():
            if limit is None and name not in laser:
                raise ValueError(f"scan: expected {name}, because the robot's file has no [laser]")
        self._send(
            SCAN,
            age_s,
            angle_min_rad=angle_min_rad,
            angle_max_rad=angle_min_rad + angle_increment_rad * (count - 1),
            angle_increment_rad=angle_increment_rad,
            scan_time_s=scan_time_s or 1.0 / laser.get("rate_hz", 1.0 / self.period_s),
            ranges_m=ranges_m,
            **{name: laser.get(name) if limit is None else limit for name, limit in limits.items()},
        )

    def odometry(
        self,
        x_m: float,
        y_m: float,
        heading_rad: float,
        *,
        vx_mps: float = 0.0,
        vy_mps: float = 0.0,
        yaw_rate_radps: float = 0.0,
        age_s: float = 0.0,
    ) -> None:
        """Sends the pose by dead reckoning, in its own frame, and the velocity in the robot's own axes, measured `age_s` ago."""
        if self.robot["drive"] == "differential" and abs(vy_mps) > max(0.1, abs(vx_mps)):
            found = f"{vy_mps:.2f} m/s to the left of a differential drive"
            warnings.warn(f"odometry: expected a velocity in the robot's own axes, found {found}", stacklevel=2)
        twist = (vx_mps, vy_mps, yaw_rate_radps)
        _core.driver_odometry(self._stamp_ns(age_s, "odometry"), (x_m, y_m, heading_rad), twist)

    def truth(
        self,
        x_m: float,
        y_m: float,
        heading_rad: float,
        *,
        vx_mps: float = 0.0,
        vy_mps: float = 0.0,
        yaw_rate_radps: float = 0.0,
    ) -> None:
        """For simulators: records the robot's true pose, once before each tick. Only the judge can read it."""
        pose = {
            "x_m": x_m,
            "y_m": y_m,
            "orientation_z": math.sin(heading_rad / 2),
            "orientation_w": math.cos(heading_rad / 2),
        }
        twist = {"vx_mps": vx_mps, "vy_mps": vy_mps, "yaw_rate_radps": yaw_rate_radps}
        self._send(_TRUTH, 0.0, pose=pose, twist=twist)

    def contact(self, x_m: float, y_m: float, *, begins: bool, body: str = "wall", impulse_ns: float = 0.0) -> None:
        """For simulators: records that the robot starts or stops touching something. `body` is wall, furniture or person."""
        if body not in _BODIES:
            raise ValueError(f"contact: body: expected one of {', '.join(_BODIES)}, found {body!r}")
        position_m = [x_m, y_m]
        fields = dict(position_m=position_m, impulse_ns=impulse_ns, body_kind=_BODIES[body], begins=int(begins))
        self._send(_CONTACT, 0.0, **fields)

    def sonar(self, ranges_m: Sequence[float], *, age_s: float = 0.0) -> None:
        """Sends the echoes of the ring of sonars, the first one ahead and the others counter-clockwise (REP 117)."""
        sonar = self.robot.get("sonar")
        if sonar is None or len(ranges_m) != sonar["sonars"]:
            said = f"{sonar['sonars']} ranges, as [sonar] of the robot says" if sonar else "a robot with [sonar] in its file"
            raise ValueError(f"sonar: expected {said}, found {len(ranges_m)} ranges")
        self._send(
            SONAR,
            age_s,
            angle_increment_rad=2 * math.pi / sonar["sonars"],
            half_opening_rad=math.radians(sonar["opening_deg"]) / 2,
            scan_time_s=1.0 / sonar["rate_hz"],
            ranges_m=ranges_m,
            **{name: sonar[name] for name in ("ring_radius_m", "range_min_m", "range_max_m")},
        )

    def send(self, channel: Channel[_M], *, age_s: float = 0.0, **fields: Any) -> None:
        """Sends a reading of any sensor, taken `age_s` ago, with these fields. All others are zero."""
        self._send(channel, age_s, **fields)

    def _send(self, channel: Channel[Any], age_s: float, **fields: Any) -> None:
        number, layout = channel._found(), channel.message._layout
        message = channel.message._of(memoryview(bytearray(layout["size"])))
        message._set(fields)
        _core.driver_send(number, self._stamp_ns(age_s, channel.name), bytes(message))

    def _stamp_ns(self, age_s: float, name: str) -> int:
        if not 0.0 <= age_s < 1e9:
            raise ValueError(f"{name}: age_s: expected seconds since the reading, 0 or more, found {age_s}")
        return max(_core.driver_now() - round(age_s * 1e9), 0)

    def tick(self) -> int:
        """Ends an instant: the navigators answer the readings that were sent before. Returns the number of the instant."""
        return _core.driver_tick()

    def command(self, *, wait_s: float = 0.05) -> Velocity:
        """Returns the velocity at which to drive until the next tick.

        This is the answer to the last tick, if it arrives within `wait_s`. Otherwise it is the latest command, or zero velocity
        if that is older than half a second. A simulator waits until its time may advance. Once the mission is over, the robot
        stands still.
        """
        twist = _core.driver_command(wait_s)
        self.is_over = twist is None
        return Velocity(*(twist or (0.0, 0.0, 0.0)))
