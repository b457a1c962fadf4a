"""A robot in the two rooms of tests/support/room.rs, for drivers of any protocol: a point, exact and without noise.

It has a laser, which scans ten times a second, and wheels that are read fifty times a second. Its odometry does not begin at 0.
"""

import math

import numpy as np

#: Two rooms of 3 × 4 m with a door of 1.2 m between them, metres: from x, y to x, y.
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
#: Where the odometry begins: this far from its origin, turned.
ORIGIN = (7.0, -3.0, 0.5)
PERIOD_S = 0.02
SCAN_EVERY = 5
FIELD_RAD = math.radians(239.765625)
BEAMS = 683
RANGE_MAX_M = 5.6
#: Where the laser is mounted, forward of the centre, metres.
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
    """Moves by its velocity: forward and left, metres per second; radians per second."""

    def __init__(self):
        self.x, self.y, self.yaw = *START, 0.0
        self.velocity = (0.0, 0.0, 0.0)
        self.readings = 0

    def step(self):
        """Moves on; returns whether a scan is due."""
        forward, left, turn = self.velocity
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        self.x += (forward * cos - left * sin) * PERIOD_S
        self.y += (forward * sin + left * cos) * PERIOD_S
        self.yaw += turn * PERIOD_S
        self.readings += 1
        return self.readings % SCAN_EVERY == 1

    def odometry(self):
        """Where it is in the frame of its odometry: x and y, metres, and the heading, rad."""
        x, y, turn = ORIGIN
        dx, dy = self.x - START[0], self.y - START[1]
        cos, sin = math.cos(turn), math.sin(turn)
        return x + dx * cos - dy * sin, y + dx * sin + dy * cos, self.yaw + turn

    def ranges(self):
        """What the laser sees, metres."""
        return ranges(self.x, self.y, self.yaw)

    def summary(self):
        """Its pose and its last command."""
        return f"{self.x:.2f} {self.y:.2f} {self.velocity[0]:.3f} {self.velocity[2]:.3f}"
