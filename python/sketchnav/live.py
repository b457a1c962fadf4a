"""The channels of a running system, over shared memory.

A reader joins as an observer. It may join, leave or be killed at any time, because the places of the pipeline are reserved.
Messages do not wake it, so it polls every few milliseconds.
"""

import ctypes
import fcntl
import os
import pathlib
import stat
import struct
import time

import numpy as np

from ._layouts import CHANNELS

#: The version that the program uses. Other versions have another layout of shared memory.
ICEORYX2 = "iceoryx2==0.10.0"
#: Interval at which to check for a message, in seconds.
LOOK_EVERY_S = 0.002
#: Interval at which to check whether the system still runs, in seconds.
ALIVE_EVERY_S = 0.5


#: Maximum number of observers of a channel. The places of the pipeline's own readers are reserved.
MAX_OBSERVERS = 5


class NotRunning(Exception):
    """There is no such system, or it has ended."""


class WrongType(Exception):
    """The system's messages have another layout, because it comes from another build than this package."""


class TooManyMessages(Exception):
    """The reader already holds the maximum number of messages of a channel."""


class TooManyReaders(Exception):
    """The channel already has the maximum number of observers."""


class ForeignRoot(Exception):
    """The folder of all systems does not belong to this user, so somebody may have prepared it."""


def _iceoryx2():
    """The library for shared memory, which is not needed to read recordings."""
    try:
        import iceoryx2
    except ImportError as error:
        raise ImportError(f"a running system is read by iceoryx2, which cannot be imported: pip install {ICEORYX2}") from error
    return iceoryx2


def _root():
    """The folder of all systems, which only this user may enter, or None if there is none yet."""
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    path = pathlib.Path(runtime) / "sketchnav" if runtime else pathlib.Path(f"/dev/shm/sketchnav-{os.getuid()}")
    try:
        found = os.lstat(path)
    except FileNotFoundError:
        return None
    is_private = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and found.st_mode & 0o077 == 0
    if not is_private:
        raise ForeignRoot(f"{path}: expected a folder that user {os.getuid()} alone may enter; remove it")
    return path


def _is_alive(folder):
    """Whether the supervisor is alive."""
    return _is_held(folder / "supervisor.lock")


def _is_held(path):
    """Whether a process holds the lock of a file. Queries the lock without ever taking it."""
    try:
        with path.open("r+b") as file:
            # struct flock: type, whence, start, length, process (Linux, 64 bits).
            form = "hhqqi4x"
            asked = struct.pack(form, fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0)
            found = fcntl.fcntl(file, _F_OFD_GETLK, asked)
            return struct.unpack(form, found)[0] != fcntl.F_UNLCK
    except FileNotFoundError:
        return False


#: Asks for a lock of an open file description (fcntl.h, Linux); Python's module names it from 3.9 on where the C library does.
_F_OFD_GETLK = getattr(fcntl, "F_OFD_GETLK", 36)


def systems():
    """The names of this user's running systems."""
    root = _root()
    folders = sorted(root.iterdir()) if root else []
    return [folder.name for folder in folders if folder.is_dir() and _is_alive(folder)]


def connect(name=None):
    """Joins a running system, or the only one if no name is given."""
    running = systems()
    if name is None and len(running) == 1:
        name = running[0]
    if name not in running:
        raise NotRunning(f"system {name!r}: expected one of {', '.join(running) or 'none that runs'}")
    return System(name, _root() / name)


class System:
    """A running system. Its channels are attributes: `lab.scan`."""

    def __init__(self, name, folder):
        self.name = name
        self._folder = folder
        iox2 = _iceoryx2()
        config = iox2.config.from_file(iox2.FilePath.new(str(folder / "iceoryx2.toml")))
        builder = iox2.NodeBuilder.new().name(iox2.NodeName.new("observer")).config(config)
        # Ctrl-C still interrupts Python.
        builder = builder.signal_handling_mode(iox2.SignalHandlingMode.Disabled)
        self._node = builder.create(iox2.ServiceType.Ipc)

    @property
    def is_running(self):
        """Whether the system is still running."""
        return _is_alive(self._folder)

    def channel(self, name):
        """Opens a channel. The messages that its writer has kept come first."""
        if name not in CHANNELS:
            raise AttributeError(f"channel {name!r}: expected one of {', '.join(CHANNELS)}")
        return Channel(self, name)

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        return self.channel(name)

    def __dir__(self):
        return [*super().__dir__(), *CHANNELS]


class Channel:
    """The messages of a channel, as they arrive: an iterator that ends with the system."""

    def __init__(self, system, name):
        self.name = name
        self._system = system
        iox2 = _iceoryx2()
        expected, self._dtype, self._has_many_writers, readers = CHANNELS[name]
        builder = system._node.service_builder(iox2.ServiceName.new(name))
        builder = builder.publish_subscribe(iox2.Slice[ctypes.c_uint64]).user_header(ctypes.c_uint64)
        verifier = iox2.AttributeVerifier.new().require(
            iox2.AttributeKey.new("message"), iox2.AttributeValue.new(expected)
        )
        try:
            self._service = builder.open_with_attributes(verifier)
        except iox2.PublishSubscribeOpenError as error:
            if not system.is_running:
                raise NotRunning(f"system {system.name!r} has ended") from error
            if "IncompatibleAttributes" in str(error):
                raise WrongType(f"channel {name!r}: expected {expected}, found another type") from error
            raise LookupError(f"channel {name!r} of system {system.name!r}: {error}") from error
        self._check_places(readers)
        self._port = self._service.subscriber_builder().name(iox2.PortName.new("observer")).create()
        self._last = 0

    def _check_places(self, readers):
        """Keeps the places of the pipeline free. A place whose process is alive counts as taken."""
        processes = self._system._folder / "processes"
        taken = sum(_is_held(processes / reader) for reader in readers)
        if self._service.dynamic_config.number_of_subscribers - taken >= MAX_OBSERVERS:
            raise TooManyReaders(f"channel {self.name!r}: expected fewer than {MAX_OBSERVERS} observers that read it")

    def receive(self):
        """The next message, or None if none has arrived. Messages that were already received are dropped."""
        while (sample := self._next()) is not None:
            message = Message(sample, self._dtype)
            # With several writers, sequence numbers cannot be compared.
            if self._has_many_writers or message.seq > self._last:
                self._last = message.seq
                return message
        return None

    def _next(self):
        try:
            return self._port.receive()
        except _iceoryx2().ReceiveError as error:
            if "ExceedsMaxBorrows" not in str(error):
                raise
            held = self._service.static_config.subscriber_max_borrowed_samples
            raise TooManyMessages(
                f"channel {self.name!r}: expected at most {held} messages that are held, found another one; "
                "keep copies instead: message.copy()"
            ) from None

    def __iter__(self):
        return self

    def __next__(self):
        looked = time.monotonic()
        while (message := self.receive()) is None:
            if time.monotonic() - looked > ALIVE_EVERY_S:
                looked = time.monotonic()
                if not self._system.is_running:
                    raise StopIteration
            time.sleep(LOOK_EVERY_S)
        return message


class Message:
    """A message in place in shared memory. Its fields are items, such as `scan["ranges_m"]`, and read-only views.

    A view keeps its message alive, and a reader may keep eight messages of a channel, or two if they have cells. `copy` returns
    an independent copy.
    """

    def __init__(self, sample, dtype):
        self._sample = sample
        payload = sample.payload()
        address = ctypes.cast(payload.as_ptr(), ctypes.c_void_p).value
        words = (ctypes.c_uint64 * payload.len()).from_address(address)
        # A view must also hold the sample. Otherwise, another message would take its place.
        words.sample = sample
        self._bytes = memoryview(words).cast("B").toreadonly()
        self._data = np.frombuffer(self._bytes, dtype=dtype, count=1)[0]
        header = ctypes.cast(sample.user_header_ptr, ctypes.POINTER(ctypes.c_uint64))
        self._cells = header.contents.value

    @property
    def data(self):
        """The whole structure, as a view."""
        return self._data

    @property
    def cells(self):
        """The bytes after the structure, such as those of a sketch's grid."""
        first = self._data.dtype.itemsize
        return np.frombuffer(self._bytes, dtype=np.uint8, offset=first, count=self._cells)

    def __getitem__(self, field):
        value = self._data[field]
        return value.decode(errors="replace") if isinstance(value, bytes) else value

    def keys(self):
        """The names of the fields."""
        return self._data.dtype.names

    @property
    def seq(self):
        """The message's number on its channel, from 1."""
        return int(self._data["header"]["seq"])

    @property
    def source_seq(self):
        """The number of the tick that caused the message."""
        return int(self._data["header"]["source_seq"])

    @property
    def stamp_s(self):
        """Simulation time, in seconds."""
        return int(self._data["header"]["stamp_ns"]) / 1e9

    def copy(self):
        """A copy of the structure, in memory of its own."""
        return self._data.copy()

    def __repr__(self):
        return f"<message {self.seq} at {self.stamp_s:.3f} s: {', '.join(self.keys())}>"
