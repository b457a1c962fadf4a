"""Drives a mission in ir-sim: its walls, its robot and its lidar take the place of the world of sketchnav.

    pip install ir-sim
    sketchnav run mission.toml --without world --system lab
    python examples/irsim_driver.py lab

ir-sim 2.12 moves the robot, differential or omnidirectional, with the noise of its kinematics; stops it at walls
(`collision_mode: contact`); and casts the lidar's beams with noise. The odometry counts what was commanded, as wheels
that slip do.
"""

import math
import sys
import tempfile

import irsim
import numpy as np
import yaml

import sketchnav

#: Steps of ir-sim between two ticks.
STEPS = 5


def world(robot):
    """The world of the mission in the words of ir-sim's YAML."""
    laser, limits = robot.robot["laser"], robot.robot["limits"]
    step_s = robot.period_s / STEPS
    is_differential = robot.robot["drive"] == "differential"
    speed_mps, turn_radps = limits["speed_mps"], limits["yaw_rate_radps"]
    most = [speed_mps, turn_radps] if is_differential else [speed_mps, speed_mps, turn_radps]
    gain = [limits["acceleration_mps2"] * step_s] * (len(most) - 1) + [limits["yaw_acceleration_radps2"] * step_s]
    noise = robot.robot["odometry"]
    alphas = [noise["alpha_speed_speed"], noise["alpha_speed_turn"], noise["alpha_turn_speed"], noise["alpha_turn_turn"]]
    ...
