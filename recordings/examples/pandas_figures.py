"""Loads a recording into pandas: estimates next to true poses, and the localizer's performance.

    pip install pandas mcap-ros2-support
    python recordings/examples/pandas_figures.py out/demo-001/building-a.mcap

Does not need sketchnav, because the file contains the definitions of its messages.
"""

import math
import sys

import pandas as pd
from mcap_ros2.reader import read_ros2_messages


def yaw(q):
    """Returns the heading of a planar quaternion, in radians."""
    return 2.0 * math.atan2(q.z, q.w)


def table(path, topic, row):
    """Returns a topic as a DataFrame with one row per message, indexed by simulation time in seconds."""
    rows = []
    for message in read_ros2_messages(path, topics=[topic]):
        values = row(message.ros_msg)
        values["t"] = message.log_time_ns / 1e9
        rows.append(values)
    return pd.DataFrame(rows).set_index("t").sort_index()


def main(path):
    truth = table(path, "/truth", lambda m: {
        "x": m.pose.pose.position.x,
        "y": m.pose.pose.position.y,
        "yaw": yaw(m.pose.pose.orientation),
    })
    estimate = table(path, "/estimate", lambda m: {
        "u": m.pose.position.x,
        "v": m.pose.position.y,
        "a": m.scale_a_pxpm,
        "b": m.scale_b_pxpm,
        "ess": m.effective_sample_size,
        "fit": m.fit,
    })
    both = truth.join(estimate, how="inner")
    print(both.describe().round(3).to_string())
    step = truth[["x", "y"]].diff()
    print(f"driven: {(step.x**2 + step.y**2).pow(0.5).sum():.1f} m in {truth.index[-1] - truth.index[0]:.1f} s")


if __name__ == "__main__":
    main(sys.argv[1])
