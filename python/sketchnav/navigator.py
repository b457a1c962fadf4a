"""Navigators in Python: messages as annotated classes, three stages, and the whole program with them.

    import sketchnav

    class Walls(sketchnav.Message, frame="base_link"):
        ahead_m: Annotated[f64, "The nearest echo ahead."]

    WALLS = sketchnav.Channel("walls", Walls, role="situation", writer="localizer", readers=["planner", "pad"])

    if __name__ == "__main__":
        raise SystemExit(sketchnav.main([NAVIGATOR]))
"""

import json
import os
import signal
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeVar

from . import _core
from .messages import Channel, Message

_M = TypeVar("_M", bound=Message)


class Instant:
    """The inputs of an instant: its tick, its time, and the latest message of each sensor."""

    @property
    def tick(self) -> int:
        return _core.instant()[0]

    @property
    def stamp_ns(self) -> int:
        return _core.instant()[1]

    def newest(self, channel: Channel[_M]) -> _M | None:
        """The latest message of a sensor, or the message that the step answers, or None before the first."""
        memory = _core.newest(channel._found(), False)
        return None if memory is None else channel.message._of(memory)

    def fresh(self, channel: Channel[_M]) -> _M | None:
        """The latest message if it has arrived since the previous instant."""
        memory = _core.newest(channel._found(), True)
        return None if memory is None else channel.message._of(memory)


class Incoming:
    """A message that does not belong to an instant."""

    def on(self, channel: Channel[_M]) -> _M | None:
        """The message if it is from this channel."""
        memory = _core.incoming(channel._found())
        return None if memory is None else channel.message._of(memory)

    @property
    def cells(self) -> memoryview:
        """The bytes after the message."""
        return _core.cells()

    @property
    def attempts(self) -> int:
        """How often the message was received before, each time followed by the death of the process."""
        return _core.attempts()


class Outbox:
    """Sends a stage's messages, which are filled in the memory that they are sent from."""

    def send(
        self, channel: Channel[_M], fill: Callable[[_M], None] | None = None, *, cells: bytes | memoryview = b"", **fields: Any
    ) -> int:
        """Sends a message with these fields and returns its number. `fill` gets the message with the fields set, and may set more.

        Everything else is zero, except for the header. If `fill` raises an exception, nothing is sent.
        """
        message = channel.message

        def write(memory, behind):
            found = message._of(memory)
            found._set(fields)
            if len(cells):
                behind[:] = memoryview(cells).cast("B")
            if fill is not None:
                fill(found)

        return _core.send(channel._found(), memoryview(cells).nbytes, write)


_INSTANT, _INCOMING, _OUT = Instant(), Incoming(), Outbox()


class Stage:
    """A part of a navigator. The same messages in the same order must lead to the same messages, so do not use clocks, files or
    unseeded random numbers.

    `form` identifies the format of the state, with a version. A state in another form is not restored.
    """

    form: str = ""

    def receive(self, incoming: Incoming) -> None:
        """Receives an instruction, which applies from now on, or a request."""

    def announce(self, out: Outbox) -> None:
        """Sends messages outside a step: at the start, after each request, and again after a kill."""

    def is_ready(self) -> bool:
        """Whether the stage can take a step. Instants wait until it can."""
        return True

    def step(self, instant: Instant, out: Outbox) -> None:
        """Takes the step of an instant."""

    def save(self) -> bytes:
        """Returns everything that changes, as bytes."""
        return b""

    def restore(self, state: bytes) -> None:
        """Resumes from the bytes that `save` returned."""
        if state != b"":
            raise ValueError(f"{type(self).__name__}: expected a stage that restores what it saves")

    def recover(self) -> None:
        """Starts after a kill if there is no usable state."""

    def _receive(self):
        self.receive(_INCOMING)

    def _announce(self):
        self.announce(_OUT)

    def _step(self):
        self.step(_INSTANT, _OUT)


class Summary:
    """The result of an account: figures, which `judge` prints and a report lists, and charts over time for the report."""

    def __init__(self) -> None:
        self._figures: list[tuple[str, str]] = []
        self._charts: list[tuple[str, str, list[tuple[str, list[tuple[float, float]]]]]] = []

    def figure(self, name: str, value: str) -> None:
        """Adds a figure. The value is text that includes its unit."""
        self._figures.append((name, value))

    def chart(self, title: str, unit: str, curves: Mapping[str, Iterable[tuple[float, float]]]) -> None:
        """Adds a chart of named curves. A point is a pair of seconds since the start and a value, which is NaN if there is
        none."""
        points = [(name, [(float(time_s), float(value)) for time_s, value in curve]) for name, curve in curves.items()]
        self._charts.append((title, unit, points))


class Account:
    """A navigator's own summary of a run, made from its recording alone.

    If it raises an exception, the run is judged without it, and a figure shows the error.
    """

    def receive(self, incoming: Incoming) -> None:
        """Receives the messages of `status` and of this navigator's channels, as they were recorded."""

    def summarize(self, summary: Summary) -> None:
        """Adds figures and charts of all messages to the summary."""

    def _receive(self):
        self.receive(_INCOMING)

    def _summarize(self):
        summary = Summary()
        self.summarize(summary)
        return summary._figures, summary._charts


class Run:
    """The run that a stage is created for: `mission`, `robot` and `seed` as they were read, and the mission's files."""

    def __init__(self, config, capsule):
        self.config, self._capsule = json.loads(config), capsule
        self.mission, self.robot, self.seed = (self.config[key] for key in ("mission", "robot", "seed"))

    def file(self, name: str) -> bytes:
        """The bytes of a file that the mission names. Available only while the stage is created."""
        return _core.file(name)


class Agenda:
    """Keeps the tasks of a mission and receives orders, so that people can start, pause, abort and resume it."""

    def __init__(self, run: Run):
        self._agenda = _core.agenda(run._capsule)

    def receive(self, incoming: Incoming) -> bool:
        """Carries out an order; returns whether the message was one."""
        return _core.agenda_receive(self._agenda)

    def is_ready(self, has_instructions: bool = True) -> bool:
        return _core.agenda_is_ready(self._agenda, has_instructions)

    def begin_step(self, instant: Instant) -> float | None:
        """Records time and motion; returns the seconds since the last step, or None before the first odometry."""
        return _core.agenda_begin_step(self._agenda)

    def due(self, missing: str | None = None) -> str:
        """What is due in this step: `begin` or `drive` the task, or `stand`, for example because something is missing."""
        return _core.agenda_due(self._agenda, missing)

    def keep_going(self, reason: str) -> bool:
        """Continues the task and returns True, or ends it and returns False if its time limit has passed."""
        return _core.agenda_keep_going(self._agenda, reason)

    def end(self, state: str, reason: str) -> None:
        """Ends the task: `reached`, `blocked`, `lost`."""
        _core.agenda_end(self._agenda, state, reason)

    def lose(self, reason: str) -> None:
        """Reports that the robot does not know where it is."""
        _core.agenda_lose(self._agenda, reason)

    def send(
        self, out: Outbox, vx_mps: float, yaw_rate_radps: float, vy_mps: float = 0.0, remaining_m: float = 0.0
    ) -> None:
        """Sends the command and, last of all, the status."""
        _core.agenda_send(self._agenda, [vx_mps, vy_mps, yaw_rate_radps, remaining_m])

    @property
    def phase(self) -> str:
        """`waiting`, `driving`, `ended` or `over`."""
        return _core.agenda_now(self._agenda)[0]

    @property
    def task(self) -> int:
        """The index of the current or next task."""
        return _core.agenda_now(self._agenda)[1]

    @property
    def elapsed_s(self) -> float:
        """The time that the task has taken so far."""
        return _core.agenda_now(self._agenda)[2]

    def save(self) -> bytes:
        return _core.agenda_save(self._agenda)

    def restore(self, state: bytes) -> None:
        _core.agenda_restore(self._agenda, state)

    def recover(self) -> None:
        """Resumes without a state, at the task of the last status that was sent. Only in `Stage.recover`."""
        _core.agenda_recover(self._agenda)


class Navigator:
    """Three stages under the name that missions use to select them: `[navigator] kind`.

    Each of the `stages` is called with a `Run`. `sensors` are those that the robot must have. `check` receives the mission and
    the robot before anything starts, and the text of a `ValueError` that it raises is shown to the user. `account` is called
    with the finished `Run`.
    """

    def __init__(
        self,
        kind: str,
        about: str,
        stages: Sequence[Callable[[Run], Stage]],
        *,
        channels: Iterable[Channel[Any]] = (),
        sensors: Iterable[str] = (),
        check: Callable[[Mapping[str, Any], Mapping[str, Any]], object] | None = None,
        account: Callable[[Run], Account] | None = None,
    ):
        self.kind, self.about, self.stages = kind, about, tuple(stages)
        self.channels, self.sensors, self.check, self.account = tuple(channels), list(sensors), check, account
        if len(self.stages) != 3:
            raise ValueError(f"navigator {kind!r}: expected a sketcher, a localizer and a planner, found {len(self.stages)} stages")

    def _channels(self):
        return [channel._declare(self.kind) for channel in self.channels]

    def _make(self, index, config, capsule):
        return self.stages[index](Run(config, capsule))

    def _account(self, config):
        return self.account(Run(config, None))

    def _check(self, mission, robot):
        if self.check is not None:
            self.check(json.loads(mission), json.loads(robot))


#: Prefix of the paths of this package's files.
_PACKAGE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "")


def _calls(traceback_, most):
    """File and line of the innermost call of a traceback, and the text of the `most` innermost calls.

    Calls within this package are left out, unless there are no others: the author of a stage cannot change them.
    """
    import traceback

    calls = traceback.extract_tb(traceback_)
    calls = [call for call in calls if not os.path.abspath(call.filename).startswith(_PACKAGE)] or calls
    return calls[-1].filename, calls[-1].lineno, "".join(traceback.format_list(calls[-most:]))


def main(navigators: Iterable[Navigator] = (), arguments: Iterable[str] | None = None) -> int:
    """Runs the program with these navigators and returns its exit code. The arguments are those of the command line.

    The processes of a system are started in the same way as this one: by the same interpreter, with the same script.
    """
    if sys.flags.ignore_environment:
        print("error: python: expected no option -E or -I, because PYTHONHASHSEED must be 0 in every process", file=sys.stderr)
        return 2
    if os.environ.get("PYTHONHASHSEED") != "0":
        # Otherwise, the order of a set of texts would differ between processes, and from run to run.
        os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], {**os.environ, "PYTHONHASHSEED": "0"})
    given = sys.argv[1:] if arguments is None else list(arguments)
    first = sys.orig_argv[1 : len(sys.orig_argv) - (len(sys.argv) - 1)]
    sys.stdout.flush()
    # As in any program. Python's handlers would wait for the program to return.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _core.main(list(navigators), sys.executable, first, ["sketchnav", *given])


def program() -> None:
    """The command `sketchnav`, without navigators in Python."""
    raise SystemExit(main())
