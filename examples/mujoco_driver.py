"""Drives a mission in MuJoCo, whose contacts move the robot and whose rays are its laser.

    pip install mujoco
    sketchnav run mission.toml --without world --system lab
    python examples/mujoco_driver.py lab

The floor and the robot are those of the mission. A differential base has two wheels and two casters, and an omnidirectional one
has three wheels with rollers. Motors turn the wheels. The odometry is computed from the rotation of the wheels and does not include
slip.
"""

import math
import sys

import mujoco
import numpy as np

import sketchnav

#: Radius of the wheels, half the width of a tyre, radius and number of the rollers on a wheel.
WHEEL_M, HALF_WIDTH_M, ROLLER_M, ROLLERS = 0.06, 0.012, 0.016, 12
#: Height of walls, furniture and the robot, and of the laser's plane, in metres.
HEIGHT_M, LASER_M = 0.3, 0.25
STEP_S = 0.002
#: Collision groups: the floor with the wheels, walls with the hull. The laser sees the group of the walls.
FLOOR, WHEEL = 'contype="1" conaffinity="0"', 'contype="0" conaffinity="1"'
WALL, HULL = 'contype="2" conaffinity="0" group="1"', 'contype="0" conaffinity="2" group="0"'


def ring(robot):
    """Returns the radius of the circle on which the wheels are mounted, in metres."""
    footprint = robot.robot.get("footprint")
    return 0.8 * (footprint["width_m"] / 2 if footprint else robot.robot["radius_m"])


def wheels(robot):
    """Returns the position of each wheel on the floor and its direction of travel."""
    ring_m = ring(robot)
    if robot.robot["drive"] == "differential":
        return [((0.0, side * ring_m), (1.0, 0.0)) for side in (1, -1)]
    angles = [math.radians(60 + 120 * i) for i in range(3)]
    return [((ring_m * math.cos(a), ring_m * math.sin(a)), (-math.sin(a), math.cos(a))) for a in angles]


def wheel_xml(index, at, ahead, has_rollers):
    """Returns a wheel that turns about its axis, with rollers on its rim or with a tyre."""
    (x, y), (dx, dy) = at, ahead
    parts = [f'<geom type="ellipsoid" size="{WHEEL_M} {WHEEL_M} {HALF_WIDTH_M}" zaxis="0 1 0" mass="0.3" {WHEEL}/>']
    if has_rollers:
        parts = ['<inertial pos="0 0 0" mass="0.3" diaginertia="0.0003 0.0005 0.0003"/>']
        rim_m, half_m = WHEEL_M - ROLLER_M, (WHEEL_M - ROLLER_M) * math.tan(math.pi / ROLLERS)
        for roller in range(ROLLERS):
            sin, cos = (turn(2 * math.pi * roller / ROLLERS) for turn in (math.sin, math.cos))
            parts.append(
                f'<body pos="{rim_m * sin} 0 {rim_m * cos}" zaxis="{cos} 0 {-sin}"><joint axis="0 0 1" damping="1e-5"/>'
                f'<geom type="capsule" size="{ROLLER_M} {half_m}" mass="0.01" {WHEEL}/></body>'
            )
    place = f'pos="{x} {y} {WHEEL_M}" xyaxes="{dx} {dy} 0 {-dy} {dx} 0"'
    return f'<body {place}><joint name="wheel{index}" axis="0 1 0" damping="0.001"/>{"".join(parts)}</body>'


def wall_xml(corners):
    """Returns a convex polygon as a box or, if it is not a rectangle, as a prism: the asset and the element of the world."""
    points = np.array(corners)
    sides = np.roll(points, -1, axis=0) - points
    if len(points) == 4 and abs(sides[0] @ sides[1]) < 1e-9 and np.allclose(sides[0], -sides[2]):
        (x, y), (dx, dy) = points.mean(axis=0), sides[0]
        size = " ".join(str(np.linalg.norm(side) / 2) for side in sides[:2])
        place = f'pos="{x} {y} {HEIGHT_M / 2}" xyaxes="{dx} {dy} 0 {-dy} {dx} 0"'
        return "", f'<geom type="box" {place} size="{size} {HEIGHT_M / 2}" {WALL}/>'
    name = f"prism{hash(points.tobytes())}"
    vertices = " ".join(f"{x} {y} {z}" for x, y in corners for z in (0.0, HEIGHT_M))
    return f'<mesh name="{name}" vertex="{vertices}"/>', f'<geom type="mesh" mesh="{name}" {WALL}/>'


def model(robot):
    """Returns the mission's floor and robot as a MuJoCo model."""
    floor, facts = robot.floor(), robot.robot
    meshes, solids = zip(*(wall_xml(corners) for corners in [*floor.walls, *floor.furniture]))
    places, has_rollers = wheels(robot), facts["drive"] == "omnidirectional"
    x, y, heading = robot.start
    # Frictionless casters at the front and the back, a millimetre above the floor.
    slides = f'size="0.02" mass="0.05" {WHEEL} friction="0 0 0" priority="1"'
    casters = [f'<geom type="sphere" pos="{side * ring(robot)} 0 0.021" {slides}/>' for side in (1, -1)]
    rolling = [wheel_xml(i, at, ahead, has_rollers) for i, (at, ahead) in enumerate(places)] + casters * (not has_rollers)
    hull = f'type="cylinder" size="{facts["radius_m"]} 0.08"'
    if footprint := facts.get("footprint"):
        hull = f'type="box" size="{footprint["length_m"] / 2} {footprint["width_m"] / 2} 0.08"'
    motors = [f'<velocity joint="wheel{i}" kv="1.5" forcerange="-6 6"/>' for i in range(len(places))]
    return mujoco.MjModel.from_xml_string(f"""
      <mujoco><option timestep="{STEP_S}" cone="elliptic" impratio="50" integrator="implicitfast"/>
        <asset>{"".join(meshes)}</asset>
        <worldbody><geom type="plane" size="0 0 1" {FLOOR}/>{"".join(solids)}
          <body name="base" pos="{x} {y} 0" euler="0 0 {math.degrees(heading)}"><freejoint/>
            <geom name="hull" {hull} pos="0 0 0.13" mass="{facts["mass_kg"]}" {HULL}/>
            {"".join(rolling)}
          </body></worldbody>
        <actuator>{"".join(motors)}</actuator></mujoco>""")


class Simulator:
    def __init__(self, robot):
        self.facts, self.rng = robot.robot, np.random.default_rng(robot.seed)
        self.model = model(robot)
        self.data = mujoco.MjData(self.model)
        self.steps = round(robot.period_s / STEP_S)
        #: Converts the velocity of the robot to those of its rims; the inverse converts back.
        self.rims = np.array([[dx, dy, x * dy - y * dx] for (x, y), (dx, dy) in wheels(robot)])
        self.inverse = np.linalg.pinv(self.rims)
        self.turned = [self.model.joint(f"wheel{i}").dofadr[0] for i in range(len(self.rims))]
        self.pose, self.velocity, self.wanted = np.zeros(3), np.zeros(3), np.zeros(3)
        self.beams_rad = np.array(robot.beams_rad())

    def truth(self):
        """Returns the true pose of the base: x, y and heading."""
        x, y, _, w, _, _, z = self.data.qpos[:7]
        return x, y, 2 * math.atan2(z, w)

    def drive(self, velocity):
        """Drives until the next tick. The motors respect the robot's limits of acceleration."""
        limits = self.facts["limits"]
        most = np.array([limits["acceleration_mps2"]] * 2 + [limits["yaw_acceleration_radps2"]]) * STEP_S
        for _ in range(self.steps):
            self.wanted += np.clip(np.array(velocity) - self.wanted, -most, most)
            self.data.ctrl[:] = self.rims @ self.wanted / WHEEL_M
            mujoco.mj_step(self.model, self.data)
            self.velocity = self.inverse @ (self.data.qvel[self.turned] * WHEEL_M)
            middle = self.pose[2] + self.velocity[2] * STEP_S / 2
            cos, sin = math.cos(middle), math.sin(middle)
            self.pose += np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]) @ self.velocity * STEP_S

    def scan(self):
        """Returns the ranges of the laser, with the noise stated in the robot's file."""
        laser, (x, y, heading) = self.facts["laser"], self.truth()
        cos, sin = math.cos(heading), math.sin(heading)
        ahead_m, left_m = laser["mount_x_m"], laser["mount_y_m"]
        eye = np.array([x + ahead_m * cos - left_m * sin, y + ahead_m * sin + left_m * cos, LASER_M])
        beams = heading + math.radians(laser["mount_yaw_deg"]) + self.beams_rad
        directions = np.stack([np.cos(beams), np.sin(beams), np.zeros_like(beams)], axis=1).ravel()
        count, reach_m = len(beams), laser["range_max_m"]
        found, ranges_m = np.zeros(count, np.int32), np.zeros(count)
        walls = np.array([0, 1, 0, 0, 0, 0], np.uint8)
        mujoco.mj_multiRay(self.model, self.data, eye, directions, walls, True, -1, found, ranges_m, None, count, reach_m)
        ranges_m += self.rng.normal(size=count) * np.maximum(laser["noise_m"], laser["noise_per_m"] * ranges_m)
        is_lost = (found < 0) | (self.rng.random(count) < laser["dropout"]) | (ranges_m > reach_m)
        return np.where(is_lost, np.inf, np.maximum(ranges_m, 0.0))

    def touches(self):
        """Returns true if the hull touches a wall."""
        hull = self.model.geom("hull").id
        return bool((self.data.contact.geom == hull).any())


def main():
    with sketchnav.drive(sys.argv[1], simulated=True) as robot:
        simulator, touches = Simulator(robot), False
        while not robot.is_over:
            robot.truth(*simulator.truth())
            if touches != (touches := simulator.touches()):
                robot.contact(*simulator.truth()[:2], begins=touches)
            forward, left, turn = simulator.velocity
            robot.odometry(*simulator.pose, vx_mps=forward, vy_mps=left, yaw_rate_radps=turn)
            robot.scan(simulator.scan().astype(np.float32))
            robot.tick()
            simulator.drive(robot.command())


if __name__ == "__main__":
    main()
