#!/usr/bin/env python3
"""Decodes every message of a recording with rosbags and with mcap-ros2-support.

Both get only the file, and take the types from the schemas in it. Prints the number of messages by topic. The exit
code is 0 if both decoded everything and agree, 1 if they did not, and 2 if the usage was wrong or a package is missing (pip install
rosbags==0.11.9 mcap-ros2-support==0.6.0).
"""

import sys
from collections import Counter
from pathlib import Path

try:
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore
except ImportError as error:
    print(f"a package is missing: {error}", file=sys.stderr)
    sys.exit(2)


def count_with_rosbags(path: Path) -> Counter:
    """Counts the messages that rosbags decodes. Its type store starts empty."""
    counts: Counter = Counter()
    with AnyReader([path], default_typestore=get_typestore(Stores.EMPTY)) as reader:
        for connection, _, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            assert message.__msgtype__ == connection.msgtype
            counts[connection.topic] += 1
    return counts


def count_with_mcap_ros2(path: Path) -> Counter:
    """Counts the messages that mcap-ros2-support decodes."""
    counts: Counter = Counter()
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
        for _, channel, _, message in reader.iter_decoded_messages():
            assert message is not None
            counts[channel.topic] += 1
    return counts


def main() -> int:
    if len(sys.argv) != 2:
        print("usage: decode_recording.py RECORDING.mcap", file=sys.stderr)
        return 2
    path = Path(sys.argv[1])
    by_rosbags, by_mcap = count_with_rosbags(path), count_with_mcap_ros2(path)
    for topic in sorted(by_rosbags | by_mcap):
        print(f"{topic} {by_rosbags[topic]}")
    if by_rosbags != by_mcap:
        print(f"rosbags decoded {by_rosbags}, mcap-ros2-support {by_mcap}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
