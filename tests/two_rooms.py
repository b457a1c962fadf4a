"""A robot in the two rooms of tests/support/room.rs, for drivers of any protocol. The robot is a point, without noise.

Its laser scans ten times a second, and its wheels are read fifty times a second. Its odometry does not start at 0.
"""

import math

import numpy as np

#: Walls of two rooms of 3 × 4 m with a door of 1.2 m between them: x, y of both ends, in metres.
WALLS = np.array(
    [
        [0.0, 0.0, 6.0, 0.0],
        [6.0, 0.0, 6.0, 4.0],
        [6.0, 4.0, 0.0, 4.0],
        [0.0, 4.0, 0.0, 0.0],
        [3.0, 0.0, 3.0, 1.4],
        [3.0, 2.6, 3.0, 4.0],
    ]
)
START = (1.0, 1.0)
#: The pose in the odometry's frame at the start.
ORIGIN = (7.0, -3.0, 0.5)
PERIOD_S = 0.02
SCAN_EVERY = 5
FIELD_RAD = math.radians(239.765625)
BEAMS = 683
RANGE_MAX_M = 5.6
#: Distance of the laser in front of the robot's centre, in metres.
MOUNT_M = 0.1


def ranges(x, y, yaw):
    eye = np.array([x + MOUNT_M * math.cos(yaw), y + MOUNT_M * math.sin(yaw)])
    beams = yaw - FIELD_RAD / 2 + np.linspace(0.0, FIELD_RAD, BEAMS)
    cos, sin = np.cos(beams)[:, None], np.sin(beams)[:, None]
    wall_x, wall_y = WALLS[:, 2] - WALLS[:, 0], WALLS[:, 3] - WALLS[:, 1]
    to_x, to_y = WALLS[:, 0] - eye[0], WALLS[:, 1] - eye[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        across = cos * wall_y - sin * wall_x
        along_ray = (to_x * wall_y - to_y * wall_x) / across
        along_wall = (to_x * sin - to_y * cos) / across
    hit = (along_ray > 0) & (along_wall >= 0) & (along_wall <= 1)
    nearest = np.where(hit, along_ray, np.inf).min(axis=1)
    return np.where(nearest <= RANGE_MAX_M, nearest, np.inf)


class Robot:
    """A robot that moves at `velocity`: forward and left in metres per second, and turning in radians per second."""

    def __init__(self):
        self.x, self.y, self.yaw = *START, 0.0
        self.velocity = (0.0, 0.0, 0.0)
        self.readings = 0

    def step(self):
        """Moves by one period. Returns true if a scan is due."""
        forward, left, turn = self.velocity
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        self.x += (forward * cos - left * sin) * PERIOD_S
        self.y += (forward * sin + left * cos) * PERIOD_S
        self.yaw += turn * PERIOD_S
        self.readings += 1
        return self.readings % SCAN_EVERY == 1

    def odometry(self):
        """Returns the pose in the odometry's frame: x and y in metres, and the heading in radians."""
        x, y, turn = ORIGIN
        dx, dy = self.x - START[0], self.y - START[1]
        cos, sin = math.cos(turn), math.sin(turn)
        return x + dx * cos - dy * sin, y + dx * sin + dy * cos, self.yaw + turn

    def ranges(self):
        """Returns the ranges of the laser, in metres."""
        return ranges(self.x, self.y, self.yaw)

    def summary(self):
        """Returns the pose and the last command."""
        return f"{self.x:.2f} {self.y:.2f} {self.velocity[0]:.3f} {self.velocity[2]:.3f}"
