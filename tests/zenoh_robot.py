"""A robot that speaks as rmw_zenoh does, for `sketchnav bridge ros2 --rmw zenoh --drive`. tests/tools/zenoh.rs runs it.

zenoh_robot.py PORT: publishes /scan ten times a second and /odom fifty times, follows /cmd_vel, and exits on SIGTERM. The router is
at 127.0.0.1. Its stamps are the times of its own clock.
"""

import math
import signal
import sys
import threading
import time

import numpy as np
from rosbags.typesys import Stores, get_typestore
from zenoh_ros2_sdk import ROS2Publisher, ROS2Subscriber
from zenoh_ros2_sdk.session import ZenohSession

from two_rooms import BEAMS, FIELD_RAD, PERIOD_S, RANGE_MAX_M, SCAN_EVERY, Robot

ROS_2 = get_typestore(Stores.ROS2_JAZZY)
PORT = int(sys.argv[1])


def typed(kind):
    definition, _ = ROS_2.generate_msgdef(kind, ros_version=2)
    return {"msg_type": kind, "msg_definition": definition, "type_hash": ROS_2.hash_rihs01(kind), "router_port": PORT}


def form(kind, **fields):
    return ROS_2.types[kind](**fields)


def vector(x=0.0, y=0.0, z=0.0):
    return form("geometry_msgs/msg/Vector3", x=x, y=y, z=z)


def header(frame):
    now_ns = time.time_ns()
    stamp = form("builtin_interfaces/msg/Time", sec=now_ns // 10**9, nanosec=now_ns % 10**9)
    return form("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


class Node:
    def __init__(self):
        self.robot = Robot()
        self.scans = ROS2Publisher("/scan", **typed("sensor_msgs/msg/LaserScan"))
        self.odometry = ROS2Publisher("/odom", **typed("nav_msgs/msg/Odometry"))
        self.commands = ROS2Subscriber("/cmd_vel", callback=self.on_command, **typed("geometry_msgs/msg/Twist"))

    def on_command(self, twist):
        self.robot.velocity = (twist.linear.x, twist.linear.y, twist.angular.z)

    def step(self):
        has_scan = self.robot.step()
        self.publish_odometry()
        if has_scan:
            self.publish_scan()

    def publish_odometry(self):
        x, y, yaw = self.robot.odometry()
        forward, left, turn = self.robot.velocity
        position = form("geometry_msgs/msg/Point", x=x, y=y, z=0.0)
        heading = form("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=math.sin(yaw / 2), w=math.cos(yaw / 2))
        pose = form("geometry_msgs/msg/Pose", position=position, orientation=heading)
        twist = form("geometry_msgs/msg/Twist", linear=vector(forward, left), angular=vector(z=turn))
        unknown = np.zeros(36)
        self.odometry.publish(
            header=header("odom"),
            child_frame_id="base_link",
            pose=form("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=unknown),
            twist=form("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=unknown),
        )

    def publish_scan(self):
        self.scans.publish(
            header=header("laser"),
            angle_min=-FIELD_RAD / 2,
            angle_max=FIELD_RAD / 2,
            angle_increment=FIELD_RAD / (BEAMS - 1),
            time_increment=0.0,
            scan_time=PERIOD_S * SCAN_EVERY,
            range_min=0.02,
            range_max=RANGE_MAX_M,
            ranges=self.robot.ranges().astype(np.float32),
            intensities=np.zeros(0, dtype=np.float32),
        )


def main():
    over = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: over.set())
    node = Node()
    while not over.wait(PERIOD_S):
        node.step()
    print(node.robot.summary())
    ZenohSession._instance.close()


main()
