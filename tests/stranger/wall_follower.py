"""A complete navigator in Python that is not part of this project: that of `wall_follower.rs`, with the same messages.

It follows the wall on the robot's right by sonar. The file is also a program, which consists of all of `sketchnav` and this
navigator: `python wall_follower.py run mission.toml`. `tests/missions/python.rs` drives with it.

    [navigator]
    kind = "wall-follower"
    [[task]]
    seconds = 20.0          # of driving, simulated
"""

import json
import math
from typing import Annotated

import sketchnav
from sketchnav import Account, Agenda, Channel, Message, Navigator, Stage, f64
from sketchnav.channels import SONAR

#: Distance that the robot keeps from the wall, in metres.
BESIDE_M = 0.6
#: Distance of an obstacle ahead, in metres, below which the robot turns away.
AHEAD_M = 0.9
#: Weight of the previous distance in the smoothed distance. Distances are smoothed because sonars are noisy.
MEMORY = 0.5


class Walls(Message, version=1, frame="base_link"):
    """The walls around the robot, as its sonars measure them."""

    ahead_m: Annotated[f64, "The nearest echo ahead, metres from the robot's centre."]
    right_m: Annotated[f64, "The nearest echo to the right, metres from the robot's centre."]


WALLS = Channel("walls", Walls, role="situation", writer="localizer", readers=["planner", "pad"])


def seconds(mission):
    for i, task in enumerate(mission["task"], 1):
        if not isinstance(task.get("seconds"), (int, float)):
            raise ValueError(f"task {i}.seconds: expected a number of seconds")
    return [float(task["seconds"]) for task in mission["task"]]


def nearest(scan, direction_rad):
    """The nearest echo within about 30° of a direction, in metres from the robot's centre, or the maximum range if there is none."""
    first, step = scan.angle_min_rad, scan.angle_increment_rad
    ranges = [r for i, r in enumerate(scan.ranges_m) if math.cos(first + i * step - direction_rad) > 0.85]
    return scan.ring_radius_m + min([scan.range_max_m] + [max(r, 0.0) for r in ranges])


class Silent(Stage):
    """Takes no input."""

    form = "wall-follower sketcher 1"


class Ears(Stage):
    """Measures how far away the walls are."""

    form = "wall-follower localizer 1"

    def __init__(self, run):
        self.walls_m = None

    def step(self, instant, out):
        scan = instant.fresh(SONAR)
        if scan is not None:
            now = [nearest(scan, 0.0), nearest(scan, -math.pi / 2)]
            before = self.walls_m or now
            self.walls_m = [MEMORY * b + (1.0 - MEMORY) * n for b, n in zip(before, now)]
        ahead_m, right_m = self.walls_m or [0.0, 0.0]
        out.send(WALLS, ahead_m=ahead_m, right_m=right_m)

    def save(self):
        return json.dumps(self.walls_m).encode()

    def restore(self, state):
        self.walls_m = json.loads(state)


class Driver(Stage):
    """Drives the robot."""

    form = "wall-follower planner 1"

    def __init__(self, run):
        self.seconds, self.agenda = seconds(run.mission), Agenda(run)

    def receive(self, incoming):
        self.agenda.receive(incoming)

    def is_ready(self):
        return self.agenda.is_ready()

    def step(self, instant, out):
        walls = instant.newest(WALLS)
        if walls is None or self.agenda.begin_step(instant) is None:
            return
        if not self.drives():
            speed_mps, yaw_rate_radps = 0.0, 0.0
        elif walls.ahead_m < AHEAD_M:
            speed_mps, yaw_rate_radps = 0.0, 0.8
        else:
            speed_mps, yaw_rate_radps = 0.25, max(-0.5, min(BESIDE_M - walls.right_m, 0.5))
        self.agenda.send(out, speed_mps, yaw_rate_radps)

    def drives(self):
        if self.agenda.due() == "stand":
            return False
        if self.agenda.elapsed_s >= self.seconds[self.agenda.task]:
            self.agenda.end("reached", "for as long as it should")
            return False
        return self.agenda.keep_going("along the wall")

    def save(self):
        return self.agenda.save()

    def restore(self, state):
        self.agenda.restore(state)


class Diary(Account):
    """Reports how far the robot was from its wall."""

    def __init__(self):
        self.right_m = []

    def receive(self, incoming):
        if walls := incoming.on(WALLS):
            self.right_m.append((walls.header.stamp_ns / 1e9, walls.right_m))

    def summarize(self, summary):
        nearest_m = min((right_m for _, right_m in self.right_m), default=math.inf)
        summary.figure("nearest wall on the right", f"{nearest_m:.2f} m")
        summary.chart("Distance of the wall", "m, from the centre", {"right": self.right_m})


NAVIGATOR = Navigator(
    "wall-follower",
    "follows the wall on the right by sonar, for as long as each task says",
    [lambda run: Silent(), Ears, Driver],
    channels=[WALLS],
    sensors=["sonar", "odometry"],
    check=lambda mission, robot: seconds(mission),
    account=lambda run: Diary(),
)

if __name__ == "__main__":
    raise SystemExit(sketchnav.main([NAVIGATOR]))
