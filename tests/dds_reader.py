"""A third-party DDS reader (Cyclone DDS, PyPI `cyclonedds`) that has our types only as IDL. tests/tools/ros2.rs runs it.

It joins late and must receive the latched drawing, a `sketchnav_msgs/SketchMap` that is much larger than a datagram.
"""

import json
import os
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float32, float64, int8, int32, sequence, uint32, uint64
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

LIMIT_S = 90


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Point(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Point
    orientation: Quaternion


@dataclass
class MapMetaData(IdlStruct, typename="nav_msgs::msg::dds_::MapMetaData_"):
    map_load_time: Time
    resolution: float32
    width: uint32
    height: uint32
    origin: Pose


@dataclass
class OccupancyGrid(IdlStruct, typename="nav_msgs::msg::dds_::OccupancyGrid_"):
    header: Header
    info: MapMetaData
    data: sequence[int8]


@dataclass
class SketchMap(IdlStruct, typename="sketchnav_msgs::msg::dds_::SketchMap_"):
    header: Header
    source_seq: uint64
    grid: OccupancyGrid
    wall_direction_rad: float64
    pen_width_px: float64
    start: Pose
    start_spread_px: float64
    start_spread_rad: float64


def main():
    participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
    quality = Qos(
        Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.TransientLocal, Policy.History.KeepLast(1)
    )
    reader = DataReader(participant, Topic(participant, "rt/sketch", SketchMap, qos=quality), qos=quality)
    sketch = next(reader.take_iter(timeout=duration(seconds=LIMIT_S)))
    info, data = sketch.grid.info, sketch.grid.data
    walls = sum(1 for cell in data if cell)
    print(json.dumps({"width": info.width, "height": info.height, "cells": len(data), "walls": walls, "frame": sketch.header.frame_id}))


main()
