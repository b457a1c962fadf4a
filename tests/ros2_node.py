"""A genuine ROS 2 node (rclpy), the counterpart of `sketchnav bridge ros2`. tests/tools/ros2.rs runs it.

ros2_node.py listen SCANS [NAMESPACE]   receives topics until this number of scans has arrived, and prints a summary as JSON
ros2_node.py order TEXT [NAMESPACE]     publishes an order once a node subscribes
"""

import json
import sys
import time

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String

#: Maximum wait in case something hangs, in seconds of wall-clock time.
LIMIT_S = 90.0
#: Number of processes of a robot. Each appears in the diagnostics once it has reported.
PROCESSES = 5


def spin_until(node, holds):
    limit = time.monotonic() + LIMIT_S
    while not holds():
        if time.monotonic() > limit:
            sys.exit(f"waited {LIMIT_S} s")
        rclpy.spin_once(node, timeout_sec=0.1)


def seconds(stamp):
    return stamp.sec + stamp.nanosec * 1e-9


def levels(diagnostics):
    return {status.name: status.level[0] for message in diagnostics for status in message.status}


def listen(node, count):
    received = {"scan": [], "odometry": [], "clock": [], "diagnostics": []}
    kinds = {"scan": LaserScan, "odometry": Odometry, "clock": Clock, "diagnostics": DiagnosticArray}
    for topic, kind in kinds.items():
        # Sensor readings are only offered best effort; the others are requested as reliable.
        quality = qos_profile_sensor_data if topic in ("scan", "odometry") else QoSProfile(depth=100)
        node.create_subscription(kind, topic, received[topic].append, quality)
    spin_until(node, lambda: len(received["scan"]) >= count and received["clock"])
    spin_until(node, lambda: len(levels(received["diagnostics"])) >= PROCESSES)
    scan, odometry = received["scan"][-1], received["odometry"][-1]
    report = {topic: len(messages) for topic, messages in received.items()}
    report["scan_frame"] = scan.header.frame_id
    report["beams"] = len(scan.ranges)
    report["nearest_m"] = min(scan.ranges)
    report["scan_stamps_s"] = [seconds(scan.header.stamp) for scan in received["scan"]]
    report["clock_s"] = [seconds(message.clock) for message in received["clock"]]
    report["odometry_frames"] = [odometry.header.frame_id, odometry.child_frame_id]
    report["poses"] = [[m.pose.pose.position.x, m.pose.pose.position.y] for m in received["odometry"]]
    report["levels"] = levels(received["diagnostics"])
    report["nodes"] = node.get_node_names()
    report["topics"] = {name: kinds[0] for name, kinds in node.get_topic_names_and_types()}
    print(json.dumps(report))


def order(node, text):
    publisher = node.create_publisher(String, "order", QoSProfile(depth=10))
    spin_until(node, lambda: publisher.get_subscription_count() > 0)
    publisher.publish(String(data=text))
    # The publisher is reliable, so the order arrives once this is true.
    publisher.wait_for_all_acked(rclpy.duration.Duration(seconds=LIMIT_S))


def main():
    rclpy.init()
    verb, argument, *namespace = sys.argv[1:]
    node = rclpy.create_node("counterpart", namespace=namespace[0] if namespace else "")
    {"listen": lambda: listen(node, int(argument)), "order": lambda: order(node, argument)}[verb]()
    node.destroy_node()
    rclpy.shutdown()


main()
