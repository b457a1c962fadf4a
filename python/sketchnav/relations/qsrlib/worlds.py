"""The input and output of QSRlib: worlds of objects, and worlds of relations, each over time."""

import copy
import math
from collections.abc import Iterable, Sequence
from typing import Any, Generic, TypeVar

_S = TypeVar("_S")
_T = TypeVar("_T", bound="_Trace[Any]")


class Object_State:
    """An object at one time. Unknown values are NaN."""

    def __init__(
        self,
        name: str,
        timestamp: float,
        x: float = math.nan,
        y: float = math.nan,
        z: float = math.nan,
        xsize: float = math.nan,
        ysize: float = math.nan,
        zsize: float = math.nan,
        rotation: Sequence[float] = (),
        *args: Any,
        **kwargs: Any,
    ):
        sizes = {"xsize": xsize, "ysize": ysize, "zsize": zsize}
        for size, value in sizes.items():
            if value < 0:
                raise ValueError(f"{name}.{size}: expected a size from 0, found {value}")
        if len(rotation) not in (0, 3, 4):
            raise ValueError(f"{name}.rotation: expected 3 angles or a quaternion, found {len(rotation)} numbers")
        self.name = name
        self.timestamp = float(timestamp)
        self.x, self.y, self.z = x, y, z
        self.xsize, self.ysize, self.zsize = xsize, ysize, zsize
        self.rotation = rotation
        self.args, self.kwargs = args, kwargs

    def return_bounding_box_2d(self, xsize_minimal: float = 0, ysize_minimal: float = 0) -> list[float]:
        """The low x, low y, high x and high y. An unknown size is the minimal one."""
        width = xsize_minimal if math.isnan(self.xsize) else self.xsize
        height = ysize_minimal if math.isnan(self.ysize) else self.ysize
        return [self.x - width / 2, self.y - height / 2, self.x + width / 2, self.y + height / 2]


class World_State:
    """The objects at one time, by their names."""

    def __init__(self, timestamp: float, objects: dict[str, Object_State] | None = None):
        self.timestamp = float(timestamp)
        self.objects = objects or {}

    def add_object_state(self, object_state: Object_State) -> None:
        self.objects[object_state.name] = object_state


class QSR:
    """The relations of some objects at one time: the words by the calculi, and the objects' names with commas in between."""

    def __init__(self, timestamp: float, between: str, qsr: dict[str, str], qsr_type: str = ""):
        self.timestamp = timestamp
        self.between = between
        self.qsr = qsr
        self.type = qsr_type


class World_QSR_State:
    """The relations at one time, by the objects' names with commas in between."""

    def __init__(self, timestamp: float, qsrs: dict[str, QSR] | None = None):
        self.timestamp = timestamp
        self.qsrs = qsrs or {}

    def add_qsr(self, qsr: QSR) -> None:
        self.qsrs[qsr.between] = qsr


class _Trace(Generic[_S]):
    """States by their times."""

    trace: dict[float, _S]

    def get_sorted_timestamps(self) -> list[float]:
        return sorted(self.trace)

    def get_last_state(self, copy_by_reference: bool = False) -> _S:
        return _copied(self.trace[max(self.trace)], copy_by_reference)

    def _empty(self: _T) -> _T:
        raise NotImplementedError

    def get_at_timestamp_range(
        self: _T,
        start: float | None = None,
        stop: float | None = None,
        istep: int = 1,
        copy_by_reference: bool = False,
        include_finish: bool = True,
    ) -> _T:
        """The states from one time to another, or every `istep`th of them."""
        times = self.get_sorted_timestamps()
        first = times[0] if start is None else start
        last = times[-1] if stop is None else stop
        for name, time in (("start", first), ("stop", last)):
            if time not in self.trace:
                raise ValueError(f"{name}: expected one of the times, found {time}")
        if first > last:
            raise ValueError(f"start: expected a time not after {last}, found {first}")
        found = self._empty()
        within = times[times.index(first) : times.index(last) + (1 if include_finish else 0)]
        for time in within[:: max(istep, 1)]:
            found.trace[time] = _copied(self.trace[time], copy_by_reference)
        return found


def _copied(value: _S, by_reference: bool) -> _S:
    return value if by_reference else copy.deepcopy(value)


class World_Trace(_Trace[World_State]):
    """Objects over time."""

    def __init__(self, description: str = "", trace: dict[float, World_State] | None = None):
        self.description = description
        self.trace = trace or {}

    def _empty(self) -> "World_Trace":
        return World_Trace()

    def add_object_track_from_list(
        self, track: Iterable[Sequence[float]], obj_name: str, t0: float = 0, **kwargs: Any
    ) -> None:
        """Adds rows of x, y; x, y, z; x, y, xsize, ysize; or x, y, z, xsize, ysize, zsize, one per unit of time."""
        names = {2: "x y", 3: "x y z", 4: "x y xsize ysize", 6: "x y z xsize ysize zsize"}
        for i, row in enumerate(track):
            if len(row) not in names:
                raise ValueError(f"{obj_name}[{i}]: expected 2, 3, 4 or 6 numbers, found {len(row)}")
            values: dict[str, Any] = dict(zip(names[len(row)].split(), row, strict=True))
            self.add_object_state(Object_State(obj_name, i + t0, **values, **kwargs))

    def add_object_state(self, object_state: Object_State, timestamp: float | None = None) -> None:
        time = float(timestamp) if timestamp else object_state.timestamp
        self.trace.setdefault(time, World_State(time)).add_object_state(object_state)

    def add_object_state_series(self, object_states: Iterable[Object_State]) -> None:
        for state in object_states:
            self.add_object_state(state)

    def get_for_objects(self, objects_names: Iterable[str], copy_by_reference: bool = False) -> "World_Trace":
        found, names = World_Trace(), list(objects_names)
        for time, state in self.trace.items():
            for name in names:
                found.add_object_state(_copied(state.objects[name], copy_by_reference), time)
        return found


class World_QSR_Trace(_Trace[World_QSR_State]):
    """Relations over time. `qsr_type` names the calculi, with commas in between."""

    def __init__(self, qsr_type: str, trace: dict[float, World_QSR_State] | None = None):
        self.qsr_type = qsr_type
        self.trace = trace or {}

    def _empty(self) -> "World_QSR_Trace":
        return World_QSR_Trace(self.qsr_type)

    def add_world_qsr_state(self, world_qsr_state: World_QSR_State) -> None:
        self.trace[world_qsr_state.timestamp] = world_qsr_state

    def add_qsr(self, qsr: QSR, timestamp: float) -> None:
        self.trace.setdefault(timestamp, World_QSR_State(timestamp)).add_qsr(qsr)

    def put_empty_world_qsr_state(self, timestamp: float) -> None:
        self.add_world_qsr_state(World_QSR_State(timestamp))

    def get_for_objects(self, objects_names: Iterable[str], copy_by_reference: bool = False) -> "World_QSR_Trace":
        found, names = self._empty(), list(objects_names)
        known = {between for state in self.trace.values() for between in state.qsrs}
        for name in names:
            if name not in known:
                raise KeyError(name)
        for time, state in self.trace.items():
            for name in names:
                if name in state.qsrs:
                    found.add_qsr(_copied(state.qsrs[name], copy_by_reference), time)
        return found

    def get_for_qsrs(self, qsrs_list: Iterable[str]) -> "World_QSR_Trace":
        found, wanted = self._empty(), list(qsrs_list)
        for time, state in self.trace.items():
            for between, qsr in state.qsrs.items():
                words = {which: qsr.qsr[which] for which in wanted if which in qsr.qsr}
                if words:
                    found.add_qsr(QSR(time, between, words, ",".join(sorted(wanted))), time)
        return found
