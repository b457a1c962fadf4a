"""Requests and their answers."""

import datetime
import functools
import itertools
import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ... import _core
from .worlds import QSR, World_QSR_State, World_QSR_Trace, World_Trace

Arguments: TypeAlias = Mapping[str, Any]
Numbers: TypeAlias = NDArray[np.float64]

#: The number of objects in a relation of each calculus.
ARITIES = {
    "argd": 2, "cardir": 2, "mos": 1, "mwe": 2, "qtcbcs": 2, "qtcbs": 2, "qtccs": 2, "ra": 2, "rcc2": 2, "rcc3": 2, "rcc4": 2,
    "rcc5": 2, "rcc8": 2, "tpcc": 3,
}  # fmt: skip
BOXES = ("cardir", "ra", "rcc2", "rcc3", "rcc4", "rcc5", "rcc8")
QTC = ("qtcbs", "qtccs", "qtcbcs")
#: The parameters of QTC and their defaults.
QTC_PARAMETERS = {"quantisation_factor": 0.0, "validate": True, "no_collapse": False, "distance_threshold": 1.22}


class QSRlib_Request_Message:
    """A request for the relations of a world, by one calculus or by several. `dynamic_args` has parameters by the name of a
    calculus, or "for_all_qsrs"."""

    def __init__(
        self,
        which_qsr: str | Sequence[str],
        input_data: World_Trace,
        dynamic_args: Arguments | None = None,
        req_made_at: datetime.datetime | None = None,
    ):
        if not isinstance(input_data, World_Trace):
            raise TypeError(f"input_data: expected a World_Trace, found {type(input_data).__name__}")
        self.which_qsr = which_qsr
        self.input_data = input_data
        self.dynamic_args: Arguments = {} if dynamic_args is None else dynamic_args
        self.made_at = req_made_at or datetime.datetime.now()


class QSRlib_Response_Message:
    """The relations of a world."""

    def __init__(
        self,
        qsrs: World_QSR_Trace,
        qstag: Any,
        req_made_at: datetime.datetime,
        req_received_at: datetime.datetime,
        req_finished_at: datetime.datetime,
    ):
        self.qsrs = qsrs
        self.qstag = qstag
        self.req_made_at = req_made_at
        self.req_received_at = req_received_at
        self.req_finished_at = req_finished_at


class QSRlib:
    """Answers requests."""

    def __init__(self, help: bool = False):
        if help:
            self.help()

    @property
    def qsrs_registry(self) -> dict[str, Callable[[World_Trace, Arguments], World_QSR_Trace]]:
        """The calculi by their names."""
        return {which: functools.partial(relate, which) for which in ARITIES}

    @property
    def filters_registry(self) -> dict[str, Callable[[World_QSR_Trace, Arguments], World_QSR_Trace]]:
        """The filters by their names."""
        return {"median_filter": apply_median_filter}

    def help(self) -> None:
        """Prints the names of the calculi."""
        print("Supported QSRs are:", *sorted(ARITIES), sep="\n- ")

    def request_qsrs(self, req_msg: QSRlib_Request_Message) -> QSRlib_Response_Message:
        """Computes the relations, filters them and, if `dynamic_args` has "qstag", makes the activity graph."""
        received_at = datetime.datetime.now()
        world, arguments = req_msg.input_data, req_msg.dynamic_args
        if isinstance(req_msg.which_qsr, str):
            qsrs = relate(req_msg.which_qsr, world, arguments)
        else:
            qsrs = merged(req_msg.which_qsr, [relate(which, world, arguments) for which in req_msg.which_qsr])
        for name, parameters in arguments.get("filters", {}).items():
            if name not in self.filters_registry:
                raise KeyError(f"filters: expected one of {' '.join(self.filters_registry)}, found {name!r}")
            qsrs = self.filters_registry[name](qsrs, parameters)
        graph = None
        if "qstag" in arguments:
            from .qstag import Activity_Graph

            asked = arguments["qstag"]
            graph = Activity_Graph(world, qsrs, asked.get("object_types"), asked.get("params"))
        return QSRlib_Response_Message(qsrs, graph, req_msg.made_at, received_at, datetime.datetime.now())


class _Track(NamedTuple):
    """An object at all times of a world: whether it is there, and its x, y, z, width and height."""

    is_there: NDArray[np.bool_]
    numbers: Numbers


class _World(NamedTuple):
    """A world as arrays."""

    times: list[float]
    tracks: dict[str, _Track]


def _arrays(world: World_Trace) -> _World:
    times = world.get_sorted_timestamps()
    tracks: dict[str, _Track] = {}
    for i, time in enumerate(times):
        for name, state in world.trace[time].objects.items():
            if name not in tracks:
                tracks[name] = _Track(np.zeros(len(times), bool), np.full((len(times), 5), math.nan))
            tracks[name].is_there[i] = True
            tracks[name].numbers[i] = state.x, state.y, state.z, state.xsize, state.ysize
    return _World(times, tracks)


def relate(which: str, world: World_Trace, arguments: Arguments) -> World_QSR_Trace:
    """The relations of a world by one calculus."""
    if which not in ARITIES:
        reason = " (argprobd draws random numbers)" if which == "argprobd" else ""
        raise KeyError(f"which_qsr: expected one of {' '.join(ARITIES)}{reason}, found {which!r}")
    arrays = _arrays(world)
    if which in QTC:
        return _qtc(which, arrays, arguments)
    found: dict[float, dict[str, QSR]] = {}
    relation = _at_once(which, arguments)
    for names in _asked(which, arrays, arguments):
        tracks = [arrays.tracks[name] for name in names]
        rows = np.flatnonzero(np.logical_and.reduce([track.is_there for track in tracks]))
        if which == "mos":
            rows = rows[1:][np.diff(rows) == 1]
        between = ",".join(names)
        for row, word in zip(rows.tolist(), relation(names, [track.numbers for track in tracks], rows), strict=True):
            time = arrays.times[row]
            found.setdefault(time, {})[between] = QSR(time, between, {which: word})
    return World_QSR_Trace(which, {time: World_QSR_State(time, found[time]) for time in sorted(found)})


def _asked(which: str, world: _World, arguments: Arguments) -> list[tuple[str, ...]]:
    """The objects to relate: those of `qsrs_for` that exist and whose number fits the calculus, or all permutations."""
    arity = ARITIES[which]
    for part in (which, "for_all_qsrs"):
        asked = (arguments.get(part) or {}).get("qsrs_for")
        if asked is None:
            continue
        if not isinstance(asked, list | tuple):
            raise TypeError(f"{part}.qsrs_for: expected a list or a tuple, found {type(asked).__name__}")
        for names in asked:
            if not isinstance(names, str | list | tuple):
                raise TypeError(f"{part}.qsrs_for: expected names or tuples of names, found {names!r}")
        tuples = [(names,) if isinstance(names, str) else tuple(names) for names in asked]
        return [names for names in tuples if len(names) == arity and all(name in world.tracks for name in names)]
    return list(itertools.permutations(world.tracks, arity))


_Relation: TypeAlias = Callable[[Sequence[str], Sequence[Numbers], NDArray[np.intp]], list[str]]


def _at_once(which: str, arguments: Arguments) -> _Relation:
    """The function that returns the words of some objects at some times."""
    if which == "argd":
        return _distances(arguments)
    quantisation = 0.0
    for part in ("for_all_qsrs", which):
        value = (arguments.get(part) or {}).get("quantisation_factor")
        quantisation = quantisation if value is None else float(value)

    def words(names: Sequence[str], tracks: Sequence[Numbers], rows: NDArray[np.intp]) -> list[str]:
        if which in BOXES:
            arrays = [_boxes(track[rows]) for track in tracks]
        elif which == "mos":
            arrays = [tracks[0][rows - 1, :2], tracks[0][rows, :2]]
            names = [names[0]] * 2
        else:
            arrays = [track[rows, :2] for track in tracks]
        return _core.qsrlib_relations(which, names, [array[:, None] for array in arrays], quantisation)

    return words


def _boxes(numbers: Numbers) -> Numbers:
    half = np.nan_to_num(numbers[:, 3:5]) / 2.0
    return np.hstack([numbers[:, :2] - half, numbers[:, :2] + half])


def _distances(arguments: Arguments) -> _Relation:
    labels = (arguments.get("argd") or {}).get("qsr_relations_and_values")
    if labels is None:
        raise KeyError("argd.qsr_relations_and_values: expected thresholds by their labels, found none")
    if not isinstance(labels, dict) or not all(
        isinstance(label, str) and isinstance(threshold, int | float) for label, threshold in labels.items()
    ):
        raise ValueError(f"argd.qsr_relations_and_values: expected numbers by their labels, found {labels!r}")
    ordered = sorted(labels.items(), key=lambda pair: pair[1])
    thresholds = np.array([threshold for _, threshold in ordered])

    def words(names: Sequence[str], tracks: Sequence[Numbers], rows: NDArray[np.intp]) -> list[str]:
        apart = tracks[0][rows, :3] - tracks[1][rows, :3]
        # An object without z is in the plane.
        apart[np.isnan(apart[:, 2]), 2] = 0.0
        ranks = np.searchsorted(thresholds, np.sqrt(np.square(apart).sum(axis=1)))
        return [ordered[rank][0] for rank in np.minimum(ranks, len(ordered) - 1).tolist()]

    return words


def _qtc(which: str, world: _World, arguments: Arguments) -> World_QSR_Trace:
    parameters: dict[str, Any] = dict(QTC_PARAMETERS)
    for part in ("for_all_qsrs", "qtcs", which):
        parameters |= arguments.get(part) or {}
    parameters.pop("qsrs_for", None)
    for name, value in parameters.items():
        if name not in QTC_PARAMETERS:
            raise KeyError(f"{which}.{name}: expected one of {' '.join(QTC_PARAMETERS)}")
        if isinstance(QTC_PARAMETERS[name], bool) and not isinstance(value, bool):
            raise TypeError(f"{which}.{name}: expected True or False, found {value!r}")
    is_plain = parameters["no_collapse"] and not parameters["validate"]
    _check_qtc(world, may_miss=which == "qtcbs" and is_plain)
    found = World_QSR_Trace(which)
    is_alike = np.array([track.is_there for track in world.tracks.values()])
    is_alike = np.concatenate([[False], (is_alike[:, 1:] == is_alike[:, :-1]).all(axis=0)])
    if which == "qtcbcs":
        for row in np.flatnonzero(~is_alike)[1:].tolist():
            found.put_empty_world_qsr_state(world.times[row])
    for names in _asked(which, world, arguments):
        k, l = (world.tracks[name] for name in names)
        is_there = k.is_there & l.is_there
        is_step = np.concatenate([[False], is_there[1:] & is_there[:-1]])
        rows = np.flatnonzero(is_step & is_alike if which == "qtcbcs" else is_step)
        if not is_plain and (np.diff(rows) > 1).any():
            time = world.times[int(rows[np.argmax(np.diff(rows) > 1)])]
            raise KeyError(f"{which}: expected the same objects at all times once both are there, found others after {time}")
        steps = [track.numbers[at, :2][:, None] for track in (k, l) for at in (rows - 1, rows)]
        words = _core.qsrlib_steps(
            which,
            [names[0], names[0], names[1], names[1]],
            steps,
            (
                float(parameters["quantisation_factor"]),
                float(parameters["distance_threshold"]),
                bool(parameters["no_collapse"]),
                bool(parameters["validate"]),
            ),
        )
        times = [world.times[row] for row in rows] if is_plain else range(1, len(words) + 1)
        between = ",".join(names)
        for time, word in zip(times, words, strict=True):
            found.add_qsr(QSR(time, between, {which: word}), time)
    return found


def _check_qtc(world: _World, may_miss: bool) -> None:
    if len(world.times) < 2:
        raise ValueError(f"expected objects at two times or more, found {len(world.times)}")
    for name, track in world.tracks.items():
        if may_miss or not track.is_there[0]:
            continue
        if not track.is_there.all():
            time = world.times[int(np.argmin(track.is_there))]
            raise KeyError(f"{name}: expected at all times, found missing at {time}")
        if np.isnan(track.numbers[:, :2]).any():
            row = int(np.argmax(np.isnan(track.numbers[:, :2]).any(axis=1)))
            raise ValueError(f"{name}: expected x and y, found NaN at {world.times[row]}")


def merged(names: Sequence[str], traces: Sequence[World_QSR_Trace]) -> World_QSR_Trace:
    """The relations of several calculi in one trace."""
    found = World_QSR_Trace(",".join(names))
    for trace in traces:
        for time, state in trace.trace.items():
            for between, qsr in state.qsrs.items():
                known = found.trace[time].qsrs.get(between) if time in found.trace else None
                if known is None:
                    found.add_qsr(QSR(time, between, dict(qsr.qsr)), time)
                else:
                    known.qsr |= qsr.qsr
    return found


def apply_median_filter(qsr_world: World_QSR_Trace, params: Arguments) -> World_QSR_Trace:
    """Replaces each relation by the most frequent one in a window around it, for each calculus and each tuple of objects."""
    series: dict[tuple[str, str], list[QSR]] = {}
    for time in qsr_world.get_sorted_timestamps():
        for between, qsr in qsr_world.trace[time].qsrs.items():
            for which in qsr.qsr:
                series.setdefault((between, which), []).append(qsr)
    for (_, which), qsrs in series.items():
        words = median_filter([qsr.qsr[which] for qsr in qsrs], params["window"])
        for qsr, word in zip(qsrs, words, strict=True):
            qsr.qsr[which] = word
    return qsr_world


def median_filter(data: Sequence[str], n: int = 3) -> list[str]:
    """The most frequent of the n filtered relations before, this one, and the n after. If several are equally frequent, the
    previous one stays. Series of up to 2n relations are left unchanged."""
    if len(data) < 2 * n + 1:
        return list(data)
    filtered = [_most_frequent(data[:n]) or data[n - 1]] * n
    for i in range(n, len(data)):
        filtered.append(_most_frequent([*filtered[i - n : i], *data[i : i + n + 1]]) or filtered[-1])
    return filtered


def _most_frequent(words: Sequence[str]) -> str | None:
    counts = Counter(words).most_common(2)
    return counts[0][0] if len(counts) == 1 or counts[0][1] > counts[1][1] else None
