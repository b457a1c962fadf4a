"""A node that speaks as ROS 2's rmw_zenoh does (PyPI `zenoh-ros2-sdk`), the counterpart of `sketchnav bridge ros2 --rmw zenoh`.

tests/tools/zenoh.rs runs it. The router is at 127.0.0.1, in the domain of ROS_DOMAIN_ID. The definitions of standard types are
those of rosbags for ROS 2 Jazzy. That of the drawing is in the crate of the navigator that owns it.

zenoh_node.py listen PORT SCANS        receives topics until this number of scans has arrived, and prints a summary as JSON
zenoh_node.py late PORT                joins after the drawing was sent, and queries for it
zenoh_node.py router PORT              acts as the router; the drawing is sent after it has joined
zenoh_node.py order PORT TEXT...       publishes orders once a node subscribes, and exits on SIGTERM
zenoh_node.py hashes RECORDING         prints the hash of each type of a recording as JSON
"""

import json
import os
import re
import signal
import sys
import threading
import time
from pathlib import Path

import zenoh
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from zenoh_ros2_sdk import ROS2Publisher, ROS2Subscriber
from zenoh_ros2_sdk.attachment import Attachment
from zenoh_ros2_sdk.qos import QosDurability, QosProfile
from zenoh_ros2_sdk.session import ZenohSession

#: Maximum wait in case something hangs, in seconds of wall-clock time.
LIMIT_S = 90.0
#: Number of processes of a robot. Each appears in the diagnostics once it has reported.
PROCESSES = 5
DOMAIN = os.environ.get("ROS_DOMAIN_ID", "0")
ROS_2 = get_typestore(Stores.ROS2_JAZZY)
SKETCH = "sketchnav_msgs/msg/SketchMap"
DEFINITION = Path(__file__).parent.parent / "services/navigators/sketch/src/messages/SketchMap.msg"
ROS_2.register(get_types_from_msg(DEFINITION.read_text(), SKETCH))


def wait_until(holds):
    limit = time.monotonic() + LIMIT_S
    while not holds():
        if time.monotonic() > limit:
            sys.exit(f"waited {LIMIT_S} s")
        time.sleep(0.01)


def typed(kind):
    definition, _ = ROS_2.generate_msgdef(kind, ros_version=2)
    return {"msg_type": kind, "msg_definition": definition, "type_hash": ROS_2.hash_rihs01(kind)}


def subscribe(port, topic, kind, **more):
    messages = []
    ROS2Subscriber(f"/{topic}", callback=messages.append, router_port=port, **typed(kind), **more)
    return messages


def seconds(stamp):
    return stamp.sec + stamp.nanosec * 1e-9


def graph(session):
    """Returns the tokens of all nodes, publishers and subscriptions, split into their parts."""
    replies = session.liveliness().get(f"@ros2_lv/{DOMAIN}/**", timeout=LIMIT_S)
    return [str(reply.ok.key_expr).split("/") for reply in replies if reply.ok]


def levels(diagnostics):
    return {status.name: status.level for message in diagnostics for status in message.status}


def listen(port, count):
    kinds = {
        "scan": "sensor_msgs/msg/LaserScan",
        "odometry": "nav_msgs/msg/Odometry",
        "tf": "tf2_msgs/msg/TFMessage",
        "clock": "rosgraph_msgs/msg/Clock",
        "diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    }
    received = {topic: subscribe(port, topic, kind) for topic, kind in kinds.items()}
    session = ZenohSession.get_instance(router_port=port).session
    attached = []
    clocks = f"{DOMAIN}/clock/**"
    subscriber = session.declare_subscriber(clocks, lambda sample: attached.append(sample.attachment.to_bytes()))
    wait_until(lambda: len(received["scan"]) >= count and len(attached) >= count and received["tf"])
    wait_until(lambda: len(levels(received["diagnostics"])) >= PROCESSES)
    subscriber.undeclare()
    scan, odometry = received["scan"][-1], received["odometry"][-1]
    attachments = [Attachment.from_bytes(attachment) for attachment in attached]
    tokens = graph(session)
    report = {
        "scan_frame": scan.header.frame_id,
        "beams": len(scan.ranges),
        "nearest_m": float(min(scan.ranges)),
        "scan_stamps_s": [seconds(message.header.stamp) for message in received["scan"]],
        "clock_s": [seconds(message.clock) for message in received["clock"]],
        "odometry_frames": [odometry.header.frame_id, odometry.child_frame_id],
        "poses": [[m.pose.pose.position.x, m.pose.pose.position.y] for m in received["odometry"]],
        "transform": [received["tf"][-1].transforms[0].header.frame_id, received["tf"][-1].transforms[0].child_frame_id],
        "levels": levels(received["diagnostics"]),
        "numbers": [attachment.sequence_id for attachment in attachments],
        "ages_s": [time.time() - attachment.timestamp_ns * 1e-9 for attachment in attachments],
        "identities": sorted({attachment.gid.hex() for attachment in attachments}),
        "nodes": [token[8] for token in tokens if token[5] == "NN"],
        "topics": {token[9]: token[10:] for token in tokens if token[5] == "MP"},
        "subscriptions": [token[9] for token in tokens if token[5] == "MS" and token[8].startswith("sketchnav")],
    }
    print(json.dumps(report))


def print_sketch(sketch):
    info = sketch.grid.info
    walls = int((sketch.grid.data != 0).sum())
    print(json.dumps({"width": info.width, "height": info.height, "cells": len(sketch.grid.data), "walls": walls}))


def late(port):
    """Queries with the package, which asks the publishers in the graph, and as rmw_zenoh itself does."""
    quality = QosProfile(durability=QosDurability.TRANSIENT_LOCAL, history_depth=1)
    sketches = subscribe(port, "sketch", SKETCH, qos=quality)
    wait_until(lambda: sketches)
    print_sketch(advanced(port))


def advanced(port):
    session = ZenohSession.get_instance(router_port=port).session
    key = f"{DOMAIN}/sketch/sketchnav_msgs::msg::dds_::SketchMap_/{ROS_2.hash_rihs01(SKETCH)}"
    samples = []
    history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1)
    subscriber = zenoh.ext.declare_advanced_subscriber(session, key, samples.append, history=history)
    wait_until(lambda: samples)
    subscriber.undeclare()
    return ROS_2.deserialize_cdr(samples[0].payload.to_bytes(), SKETCH)


def router(port):
    listens = f'listen/endpoints=["tcp/127.0.0.1:{port}"];connect/endpoints=[]'
    os.environ["ZENOH_CONFIG_OVERRIDE"] = f'mode="router";{listens}'
    print_sketch(advanced(port))


def order(port, texts):
    over = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: over.set())
    publisher = ROS2Publisher("/order", router_port=port, **typed("std_msgs/msg/String"))
    wait_until(lambda: publisher.pub.matching_status.matching)
    for text in texts:
        publisher.publish(data=text)
    # The order may still be under way until its effect is visible.
    over.wait(LIMIT_S)


def hashes(recording):
    found = {}
    with AnyReader([Path(recording)], default_typestore=get_typestore(Stores.EMPTY)) as reader:
        for connection in reader.connections:
            kind = connection.msgtype
            store = get_typestore(Stores.EMPTY)
            store.register(get_types_from_msg(connection.msgdef.data, kind))
            name = re.sub("/msg/(.*)", r"::msg::dds_::\1_", kind)
            found[f"%{connection.topic.lstrip('/')}"] = [name, store.hash_rihs01(kind)]
    print(json.dumps(found))


def main():
    verb, where, *more = sys.argv[1:]
    verbs = {
        "listen": lambda: listen(int(where), int(more[0])),
        "late": lambda: late(int(where)),
        "router": lambda: router(int(where)),
        "order": lambda: order(int(where), more),
        "hashes": lambda: hashes(where),
    }
    verbs[verb]()
    if ZenohSession._instance:
        ZenohSession._instance.close()


main()
