"""Recordings as pandas frames. Only the schemas inside the file are needed to read it."""

import collections
import pathlib
import re


def open_recording(path):
    """A recording (.mcap) that sketchnav or other software has written, or the folder of a run, which contains one."""
    return Recording(path)


class Recording:
    """A recording: topics as frames."""

    def __init__(self, path):
        self.path = _only_one_in(pathlib.Path(path))
        if not self.path.exists() and self.path.with_name(f"{self.path.stem}_0.mcap").exists():
            raise ValueError(f"{path}: expected one file, found several; `sketchnav merge {path} -o whole.mcap` makes one of them")
        with self._reader() as reader:
            summary = reader.get_summary()
        if summary is None:
            raise ValueError(f"{path}: expected a recording with a summary, found none; see `sketchnav recover`")
        counts = summary.statistics.channel_message_counts if summary.statistics else {}
        #: Number of messages of each topic.
        self.topics = {channel.topic: counts.get(id, 0) for id, channel in sorted(summary.channels.items())}

    def _reader(self):
        return _Reader(self.path)

    def messages(self, topic):
        """Time of the message in nanoseconds, and the message, in the order of time."""
        topic = self._known(topic)
        with self._reader() as reader:
            for found in reader.iter_decoded_messages(topics=[topic]):
                yield found.message.log_time, found.decoded_message

    def frame(self, topic):
        """A row for each message, indexed by its time in seconds, and a column for each field, such as `pose.position.x`.

        A field that is a list becomes a cell with an array. To `plot` a frame, pandas needs matplotlib.
        """
        import pandas

        columns = collections.defaultdict(list)
        times = []
        for time_ns, message in self.messages(topic):
            times.append(time_ns / 1e9)
            for name, value in _fields(message, ""):
                columns[name].append(value)
        return pandas.DataFrame(columns, index=pandas.Index(times, name="time_s"))

    def _known(self, topic):
        topic = topic if topic.startswith("/") else f"/{topic}"
        if topic not in self.topics:
            raise KeyError(f"topic {topic}: expected one of {', '.join(sorted(self.topics))}")
        return topic


def _only_one_in(path):
    """The recording in a folder. A path that is not a folder is returned as it is."""
    if not path.is_dir():
        return path
    found = sorted(path.glob("*.mcap"))
    if len(found) == 1:
        return found[0]
    series = {re.sub(r"_\d+$", "", file.stem) for file in found}
    if len(found) > 1 and len(series) == 1:
        raise ValueError(
            f"{path}: expected one file, found {len(found)} of one recording; "
            f"`sketchnav merge {path / series.pop()}.mcap -o whole.mcap` makes one of them"
        )
    raise ValueError(f"{path}: expected a folder with one recording, found {len(found)}")


class _Reader:
    """A file that is open while it is being read."""

    def __init__(self, path):
        self._path = path

    def __enter__(self):
        from mcap.reader import make_reader
        from mcap_ros2.decoder import DecoderFactory

        self._file = self._path.open("rb")
        return make_reader(self._file, decoder_factories=[DecoderFactory()])

    def __exit__(self, *_):
        self._file.close()


def _fields(message, prefix):
    """Names and values of a message's fields. Names of fields in parts are joined by dots."""
    import numpy

    for slot in message.__slots__:
        value = getattr(message, slot)
        name = f"{prefix}{slot}"
        if hasattr(value, "__slots__") and type(value).__module__ != "builtins":
            yield from _fields(value, f"{name}.")
        elif isinstance(value, (list, tuple)) and value and hasattr(value[0], "__slots__"):
            yield name, list(value)
        elif isinstance(value, (list, tuple, bytes, bytearray, memoryview)):
            yield name, numpy.asarray(value if isinstance(value, (list, tuple)) else bytearray(value))
        else:
            yield name, value
