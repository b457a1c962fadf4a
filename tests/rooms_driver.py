"""Drives the robot of tests/two_rooms.py with `sketchnav.drive`. tests/missions/python_driver.rs runs it.

    python rooms_driver.py SYSTEM             in real time
    python rooms_driver.py SYSTEM simulated   as fast as the navigators answer

The robot starts where it stood when the previous driver died, and its odometry starts at 0 each time.
"""

import sys
import time

import sketchnav
from two_rooms import PERIOD_S, SCAN_EVERY, Robot

robot = Robot()


def send(system, age_s=0.0):
    """Sends the readings that are due. Returns true if an instant is complete."""
    has_scan = robot.step()
    x, y = robot.x - system.start.x_m, robot.y - system.start.y_m
    system.odometry(x, y, robot.yaw, vx_mps=robot.velocity[0], yaw_rate_radps=robot.velocity[2], age_s=age_s)
    if has_scan:
        system.scan(robot.ranges(), age_s=age_s)
        system.truth(robot.x, robot.y, robot.yaw)
        system.tick()
    return has_scan


def drive_robot(system):
    due = time.monotonic()
    while not system.is_over:
        send(system)
        due += PERIOD_S
        robot.velocity = system.command(wait_s=max(0.0, due - time.monotonic()))
        time.sleep(max(0.0, due - time.monotonic()))


def drive_simulator(system):
    while not system.is_over:
        # The scan is due with every fifth reading of the wheels, and completes the instant.
        if send(system, age_s=PERIOD_S * (-robot.readings % SCAN_EVERY)):
            robot.velocity = system.command()


def main():
    is_simulated = sys.argv[2:] == ["simulated"]
    with sketchnav.drive(sys.argv[1], simulated=is_simulated) as system:
        robot.x, robot.y, robot.yaw = system.start
        (drive_simulator if is_simulated else drive_robot)(system)
    print(robot.summary())


if __name__ == "__main__":
    main()
