"""A robot that speaks only ROS 2 (rclpy), for `sketchnav bridge ros2 --drive`. tests/tools/ros2.rs runs it.

It publishes /scan ten times a second, and odometry fifty times a second on the topic given as argument. It follows /cmd_vel and
exits on SIGTERM. Its stamps are the times of its own clock.
"""

import math
import signal
import sys

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import LaserScan

from two_rooms import BEAMS, FIELD_RAD, PERIOD_S, RANGE_MAX_M, SCAN_EVERY, Robot


class Node:
    def __init__(self):
        self.node = rclpy.create_node("robot")
        self.robot = Robot()
        self.twist = Twist()
        self.scans = self.node.create_publisher(LaserScan, "scan", qos_profile_sensor_data)
        self.odometry = self.node.create_publisher(Odometry, sys.argv[1], QoSProfile(depth=10))
        self.node.create_subscription(Twist, "cmd_vel", self.on_command, QoSProfile(depth=10))
        self.node.create_timer(PERIOD_S, self.step)

    def on_command(self, twist):
        self.twist = twist
        self.robot.velocity = (twist.linear.x, twist.linear.y, twist.angular.z)

    def step(self):
        has_scan = self.robot.step()
        stamp = self.node.get_clock().now().to_msg()
        self.publish_odometry(stamp)
        if has_scan:
            self.publish_scan(stamp)

    def publish_odometry(self, stamp):
        message = Odometry()
        message.header.stamp, message.header.frame_id, message.child_frame_id = stamp, "odom", "base_link"
        x, y, yaw = self.robot.odometry()
        message.pose.pose.position.x, message.pose.pose.position.y = x, y
        message.pose.pose.orientation.z, message.pose.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        message.twist.twist = self.twist
        self.odometry.publish(message)

    def publish_scan(self, stamp):
        message = LaserScan()
        message.header.stamp, message.header.frame_id = stamp, "laser"
        message.angle_min, message.angle_max = -FIELD_RAD / 2, FIELD_RAD / 2
        message.angle_increment = FIELD_RAD / (BEAMS - 1)
        message.scan_time = PERIOD_S * SCAN_EVERY
        message.range_min, message.range_max = 0.02, RANGE_MAX_M
        message.ranges = self.robot.ranges().tolist()
        self.scans.publish(message)


def main():
    rclpy.init()
    node = Node()
    running = True

    def end(*_):
        nonlocal running
        running = False

    signal.signal(signal.SIGTERM, end)
    while running:
        rclpy.spin_once(node.node, timeout_sec=0.1)
    print(node.robot.summary())


main()
