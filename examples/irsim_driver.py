"""Drives a mission in ir-sim, whose walls, robot and lidar take the place of sketchnav's own world.

    pip install ir-sim
    sketchnav run mission.toml --without world --system lab
    python examples/irsim_driver.py lab

The floor and the robot are those of the mission. ir-sim moves the base, differential or omnidirectional, with the noise of its
own kinematics, stops it at walls (`collision_mode: contact`) and casts the noisy beams of the lidar. The odometry adds up the
velocities of the wheels, which are not affected by that noise.
"""

import math
import sys
import tempfile

import irsim
import numpy as np
import shapely
import yaml
from irsim.world.map import ObstacleMap

import sketchnav

#: Steps of ir-sim from one tick to the next.
STEPS = 2
#: The noise of the lidar is that of a wall at this distance, because ir-sim's does not depend on it.
NOISE_AT_M = 2.0


def walls(floor):
    """Returns the outlines of walls and furniture as an ir-sim map, whose lines are indexed by position.

    If they were separate objects, each step would update all of them: thousands in a mapped building.
    """
    lines = ObstacleMap(shape={"name": "map", "points": np.zeros((2, 1))})
    lines.set_original_geometry(shapely.multilinestrings(list(floor.segments())))
    lines.refresh()
    lines.linestrings = list(lines.geometry.geoms)
    lines.geometry_tree = shapely.STRtree(lines.linestrings)
    return lines


def base(robot, step_s):
    """Returns the mission's robot in the format of ir-sim."""
    shape = {"name": "circle", "radius": robot.robot["radius_m"]}
    if footprint := robot.robot.get("footprint"):
        shape = {"name": "rectangle", "length": footprint["length_m"], "width": footprint["width_m"]}
    limits, noise, laser = (robot.robot[table] for table in ("limits", "odometry", "laser"))
    speed_mps, turn_radps = limits["speed_mps"], limits["yaw_rate_radps"]
    # In the file, variances are per second; in ir-sim, they are per step.
    by_speed, by_turn = noise["alpha_speed_speed"] / step_s, noise["alpha_turn_turn"] / step_s
    if robot.robot["drive"] == "differential":
        kinematics, axes = "diff", 1
        alpha = [by_speed, noise["alpha_speed_turn"] / step_s, noise["alpha_turn_speed"] / step_s, by_turn]
    else:
        # The noise of this kinematics does not depend on the velocity, so it is set to that at half the maximum velocity.
        kinematics, axes = "omni_angular", 2
        alpha = [by_speed * (speed_mps / 2) ** 2] * 2 + [by_turn * (turn_radps / 2) ** 2]
    most = [speed_mps] * axes + [turn_radps]
    lidar = {
        "name": "lidar2d",
        "range_min": laser["range_min_m"],
        "range_max": laser["range_max_m"],
        "angle_range": math.radians(laser["field_of_view_deg"]),
        "number": laser["beams"],
        "noise": True,
        "std": max(laser["noise_m"], laser["noise_per_m"] * NOISE_AT_M),
        "offset": [laser["mount_x_m"], laser["mount_y_m"], math.radians(laser["mount_yaw_deg"])],
    }
    return {
        "kinematics": {"name": kinematics, "noise": True, "alpha": alpha},
        "shape": shape,
        "mass": robot.robot["mass_kg"],
        "state": list(robot.start),
        "vel_min": [-limit for limit in most],
        "vel_max": most,
        "acce": [limits["acceleration_mps2"]] * axes + [limits["yaw_acceleration_radps2"]],
        "sensors": [lidar],
    }


def environment(robot):
    """Returns the mission's world in ir-sim."""
    step_s = robot.period_s / STEPS
    world = {"step_time": step_s, "sample_time": step_s, "collision_mode": "contact"}
    text = yaml.safe_dump({"world": world, "robot": [base(robot, step_s)]})
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        file.write(text)
        file.flush()
        simulator = irsim.make(file.name, headless=True, seed=robot.seed, log_level="ERROR")
    simulator.add_object(walls(robot.floor()))
    return simulator


class Wheels:
    """Odometry that integrates the velocities measured at the wheels: forward, left and turning."""

    def __init__(self):
        self.pose, self.velocity = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)

    def turn(self, velocity, step_s):
        """Adds one step."""
        (x, y, heading), (forward, left, turn) = self.pose, velocity
        cos, sin = math.cos(heading) * step_s, math.sin(heading) * step_s
        self.pose = (x + forward * cos - left * sin, y + forward * sin + left * cos, heading + turn * step_s)
        self.velocity = velocity


def main():
    with sketchnav.drive(sys.argv[1], simulated=True) as robot:
        simulator, wheels, touches = environment(robot), Wheels(), False
        while not robot.is_over:
            base, scan = simulator.robot, simulator.get_lidar_scan()
            robot.truth(*base.state[:3, 0])
            if touches != (touches := bool(base.contact.reports)):
                robot.contact(*base.state[:2, 0], begins=touches)
            forward, left, turn = wheels.velocity
            robot.odometry(*wheels.pose, vx_mps=forward, vy_mps=left, yaw_rate_radps=turn)
            robot.scan([range_m if hit else math.inf for range_m, hit in zip(scan["ranges"], scan["valid"])])
            robot.tick()
            forward, left, turn = robot.command()
            for _ in range(STEPS):
                simulator.step([forward, turn] if base.vel_dim == 2 else [forward, left, turn])
                found = base.velocity[:, 0]
                wheels.turn((found[0], 0.0 if base.vel_dim == 2 else found[1], found[-1]), simulator.step_time)


if __name__ == "__main__":
    main()
