"""A robot that speaks ROS 2 alone (rclpy), for `sketchnav bridge ros2 --drive`; tests/ros2.rs runs it.

A point in the two rooms of tests/support/room.rs, exact and without noise. It publishes /scan ten times a second and /odom
fifty times, moves by /cmd_vel, and ends with SIGTERM. Its stamps are those of its clock, its odometry does not begin at 0.
"""

import math
import signal

import numpy as np
import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import LaserScan

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
    def __init__(self):
        self.node = rclpy.create_node("robot")
        self.x, self.y, self.yaw = *START, 0.0
        self.twist = Twist()
        self.readings = 0
        self.scans = self.node.create_publisher(LaserScan, "scan", qos_profile_sensor_data)
        self.odometry = self.node.create_publisher(Odometry, "odom", QoSProfile(depth=10))
        self.node.create_subscription(Twist, "cmd_vel", self.on_command, QoSProfile(depth=10))
        self.node.create_timer(PERIOD_S, self.step)

    def on_command(self, twist):
        self.twist = twist

    def step(self):
        forward, left, turn = self.twist.linear.x, self.twist.linear.y, self.twist.angular.z
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        self.x += (forward * cos - left * sin) * PERIOD_S
        self.y += (forward * sin + left * cos) * PERIOD_S
        self.yaw += turn * PERIOD_S
        stamp = self.node.get_clock().now().to_msg()
        self.publish_odometry(stamp)
        if self.readings % SCAN_EVERY == 0:
            self.publish_scan(stamp)
        self.readings += 1

    def publish_odometry(self, stamp):
        message = Odometry()
        message.header.stamp, message.header.frame_id, message.child_frame_id = stamp, "odom", "base_link"
        x, y, turn = ORIGIN
        dx, dy = self.x - START[0], self.y - START[1]
        message.pose.pose.position.x = x + dx * math.cos(turn) - dy * math.sin(turn)
        message.pose.pose.position.y = y + dx * math.sin(turn) + dy * math.cos(turn)
        message.pose.pose.orientation.z = math.sin((self.yaw + turn) / 2)
        message.pose.pose.orientation.w = math.cos((self.yaw + turn) / 2)
        message.twist.twist = self.twist
        self.odometry.publish(message)

    def publish_scan(self, stamp):
        message = LaserScan()
        message.header.stamp, message.header.frame_id = stamp, "laser"
        message.angle_min, message.angle_max = -FIELD_RAD / 2, FIELD_RAD / 2
        message.angle_increment = FIELD_RAD / (BEAMS - 1)
        message.scan_time = PERIOD_S * SCAN_EVERY
        message.range_min, message.range_max = 0.02, RANGE_MAX_M
        message.ranges = ranges(self.x, self.y, self.yaw).tolist()
        self.scans.publish(message)


def main():
    rclpy.init()
    robot = Robot()
    running = True

    def end(*_):
        nonlocal running
        running = False

    signal.signal(signal.SIGTERM, end)
    while running:
        rclpy.spin_once(robot.node, timeout_sec=0.1)
    print(f"{robot.x:.2f} {robot.y:.2f} {robot.twist.linear.x:.3f} {robot.twist.angular.z:.3f}")


main()
