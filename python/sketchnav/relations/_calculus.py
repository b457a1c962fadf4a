"""The common part of all calculi: arrays in, codes out, and the known properties of the relations."""

import functools
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, ClassVar, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core

Codes: TypeAlias = NDArray[np.int16]

#: The numbers in a row of each kind of object.
COLUMNS = {
    "point": ("x", "y"),
    "oriented point": ("x", "y", "heading in radians"),
    "dipole": ("start x", "start y", "end x", "end y"),
    "rectangle": ("low x", "low y", "high x", "high y"),
    "interval": ("low", "high"),
}

#: How a relation of a series follows from the previous one.
CHANGES = ("first", "same", "neighbour", "jump", "inserted")


class Timed(NamedTuple):
    """A relation with the period in which it held, in seconds.

    `change` describes how it follows from the previous one: "first" in the series or after a gap; "same"; "neighbour", by
    continuous motion; "jump", if something was missed in between; or "inserted", if it was not observed but must have held for an
    instant.
    """

    relation: str
    from_s: float
    to_s: float
    change: str


@dataclass(frozen=True, eq=False)
class Series:
    """The relations of some objects over time, one array for each part. Iteration gives `Timed`.

    A relation of motion, such as QTC, describes two samples: `from_s` is the time of the first, whose poses it refers to.
    """

    calculus: "Calculus"
    codes: Codes
    from_s: NDArray[np.float64]
    to_s: NDArray[np.float64]
    #: Indices into `sketchnav.relations.calculi.CHANGES`.
    changes: NDArray[np.int8]

    @property
    def words(self) -> NDArray[np.str_]:
        """The words of the relations."""
        return self.calculus.words(self.codes)

    def __len__(self) -> int:
        return len(self.codes)

    def __iter__(self) -> Iterator[Timed]:
        parts = zip(self.words.tolist(), self.from_s.tolist(), self.to_s.tolist(), self.changes.tolist(), strict=True)
        return (Timed(word, from_s, to_s, CHANGES[change]) for word, from_s, to_s, change in parts)


def rows(name: str, value: ArrayLike, kind: str) -> NDArray[np.float64]:
    """An array of objects, which is the value itself if it holds aligned doubles."""
    columns = COLUMNS[kind]
    try:
        array = np.require(value, np.float64, "A")
    except (TypeError, ValueError) as error:
        raise type(error)(f"{name}: expected an array of numbers: {error}") from None
    if array.ndim == 0 or array.shape[-1] != len(columns):
        expected = f"a last axis of {len(columns)} ({', '.join(columns)})"
        raise ValueError(f"{name}: expected {expected}, found the shape {array.shape}")
    return array


def aligned(
    names: Sequence[str], values: Sequence[ArrayLike], kind: str
) -> tuple[tuple[int, ...], list[NDArray[np.float64]]]:
    """The shape of the relations, and arrays by time, track and number."""
    arrays = [rows(name, value, kind) for name, value in zip(names, values, strict=True)]
    try:
        shape = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
    except ValueError:
        found = ", ".join(f"{name} {array.shape}" for name, array in zip(names, arrays, strict=True))
        raise ValueError(f"expected arrays whose shapes can be broadcast, found {found}") from None
    width = len(COLUMNS[kind])
    tracks = int(np.prod(shape[1:]))
    full = (shape[0] if shape else 1, tracks, width)
    return shape, [np.broadcast_to(array, (*shape, width)).reshape(full) for array in arrays]


def times(value: ArrayLike, samples: int) -> NDArray[np.float64]:
    """The times of samples, in seconds, which must increase."""
    array = np.ascontiguousarray(value, np.float64)
    if array.shape != (samples,):
        raise ValueError(f"time_s: expected a time for each of the {samples} samples, found the shape {array.shape}")
    is_later = np.isfinite(array) & (np.diff(array, prepend=-np.inf) > 0.0)
    if not is_later.all():
        at = int(np.argmin(is_later))
        after = f"after {array[at - 1]} s" if at else "in seconds"
        raise ValueError(f"time_s[{at}]: expected a time {after}, found {array[at]}")
    return array


@dataclass(frozen=True)
class Calculus:
    """A calculus with its parameters. Its subclasses define which objects it relates."""

    #: The name of the calculus.
    name: ClassVar[str]
    #: The kind of its objects, a key of `COLUMNS`.
    objects: ClassVar[str]
    #: The names of its arguments.
    arguments: ClassVar[tuple[str, ...]]
    #: Why there is no composition.
    without_composition: ClassVar[str] = "none is known"

    def __post_init__(self) -> None:
        _ = self._opened  # rejects what is out of range

    def __getstate__(self) -> dict[str, Any]:
        return asdict(self)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)

    def _parameters(self) -> dict[str, Any]:
        return asdict(self)

    @functools.cached_property
    def _opened(self) -> object:
        for parameter, value in asdict(self).items():
            if isinstance(value, float) and not math.isfinite(value):
                raise ValueError(f"{parameter}: expected a finite number, found {value}")
        return _core.relations_open(json.dumps({"calculus": self.name} | self._parameters(), default=float))

    @functools.cached_property
    def relations(self) -> tuple[str, ...]:
        """The words of all base relations, in the order of their codes."""
        return tuple(_core.relations_words(self._opened))

    @functools.cached_property
    def _words(self) -> NDArray[np.str_]:
        return np.array([*self.relations, ""])

    def words(self, codes: ArrayLike) -> NDArray[np.str_]:
        """The words of relations; that of -1, no relation, is empty."""
        return self._words[np.asarray(codes)]

    def code(self, word: str) -> int:
        """The code of a relation."""
        return _core.relations_code(self._opened, word)

    def neighbours(self, relation: str) -> frozenset[str]:
        """The relations that continuous motion can lead to without a third one in between (Freksa 1991; Galton 2001)."""
        return self._answer("neighbours", relation)

    def _answer(self, question: str, *relations: str) -> frozenset[str]:
        found = _core.relations_answer(self._opened, question, [self.code(word) for word in relations])
        if found is None:
            reason = self.without_composition if question == "compose" else "its relations have none"
            raise NotImplementedError(f"{type(self).__name__}: {question}: {reason}")
        return frozenset(self.relations[code] for code in found)

    def _times(self, time_s: ArrayLike | None, samples: int) -> NDArray[np.float64] | None:
        return None if time_s is None else times(time_s, samples)

    def _relate(self, values: Sequence[ArrayLike], time_s: ArrayLike | None) -> Codes:
        shape, arrays = aligned(self.arguments, values, self.objects)
        stamps = self._times(time_s, arrays[0].shape[0])
        codes = np.empty(arrays[0].shape[:2], np.int16)
        _core.relations_relate(self._opened, self.arguments, arrays, stamps, codes)
        return codes.reshape(shape)

    def _series(
        self,
        values: Sequence[ArrayLike],
        time_s: ArrayLike | None,
        collapse: bool,
        validate: bool,
        max_gap_s: float | None,
    ) -> Series:
        shape, arrays = aligned(self.arguments, values, self.objects)
        if len(shape) != 1:
            raise ValueError(f"expected arrays of one track each, (samples, numbers), found the shape {shape} of samples")
        stamps = self._times(time_s, shape[0])
        options = (collapse, validate, max_gap_s)
        from_s, to_s, codes, changes = _core.relations_series(self._opened, self.arguments, arrays, stamps, options)
        return Series(
            self,
            np.frombuffer(codes, np.int16),
            np.frombuffer(from_s, np.float64),
            np.frombuffer(to_s, np.float64),
            np.frombuffer(changes, np.int8),
        )


class WithConverse(Calculus):
    """A calculus of two objects."""

    def converse(self, relation: str) -> frozenset[str]:
        """The relations that b may have to a, if a has this one to b."""
        return self._answer("converse", relation)


class Composed(Calculus):
    """A calculus with a composition, which is weak: it has the relations that some objects show."""

    def compose(self, first: str, second: str) -> frozenset[str]:
        """The relations that a may have to c, if a has `first` to b, and b has `second` to c. With three arguments: those that
        a, b, d may have, if a, b, c have `first` and b, c, d have `second`."""
        return self._answer("compose", first, second)


class OfTracks(WithConverse):
    """A calculus of two objects, whose tracks have a series of relations."""

    arguments: ClassVar[tuple[str, ...]] = ("a", "b")

    def series(
        self,
        a: ArrayLike,
        b: ArrayLike,
        *,
        time_s: ArrayLike | None = None,
        collapse: bool = True,
        validate: bool = True,
        max_gap_s: float | None = None,
    ) -> Series:
        """The relations of two tracks over time.

        `time_s` are the times of the samples, by default 0, 1, 2, …. `collapse` merges consecutive equal relations; `validate`
        inserts those that continuous motion must have passed through. Objects are not followed across pauses of more than
        `max_gap_s`.
        """
        return self._series((a, b), time_s, collapse, validate, max_gap_s)


class Pair(OfTracks):
    """A calculus of two objects at one time."""

    def relate(self, a: ArrayLike, b: ArrayLike) -> Codes:
        """The relations of a to b, in the shape of the arrays without their last axis."""
        return self._relate((a, b), None)


class MovingPair(OfTracks):
    """A calculus of the motion of two objects between one sample and the next."""

    def relate(self, a: ArrayLike, b: ArrayLike, *, time_s: ArrayLike | None = None) -> Codes:
        """The relations of a to b, each between the previous sample and this one. The first sample has none.

        `time_s` are the times of the samples, which are needed for a quantisation by speed.
        """
        return self._relate((a, b), time_s)


class Single(Calculus):
    """A calculus of the motion of one object."""

    arguments: ClassVar[tuple[str, ...]] = ("a",)

    def relate(self, a: ArrayLike, *, time_s: ArrayLike | None = None) -> Codes:
        """The relations of a, each between the previous sample and this one. The first sample has none."""
        return self._relate((a,), time_s)

    def series(
        self,
        a: ArrayLike,
        *,
        time_s: ArrayLike | None = None,
        collapse: bool = True,
        validate: bool = True,
        max_gap_s: float | None = None,
    ) -> Series:
        """The relations of a track over time; see `Pair.series`."""
        return self._series((a,), time_s, collapse, validate, max_gap_s)


class Triple(Calculus):
    """A calculus of three objects at one time."""

    arguments: ClassVar[tuple[str, ...]] = ("a", "b", "c")

    def relate(self, a: ArrayLike, b: ArrayLike, c: ArrayLike) -> Codes:
        """The relations of a, b and c, in the shape of the arrays without their last axis."""
        return self._relate((a, b, c), None)

    def series(
        self,
        a: ArrayLike,
        b: ArrayLike,
        c: ArrayLike,
        *,
        time_s: ArrayLike | None = None,
        collapse: bool = True,
        validate: bool = True,
        max_gap_s: float | None = None,
    ) -> Series:
        """The relations of three tracks over time; see `Pair.series`."""
        return self._series((a, b, c), time_s, collapse, validate, max_gap_s)

    def permuted(self, relation: str, by: str) -> frozenset[str]:
        """The relations that the same objects may have in another order: "inverse" (b, a, c), "short cut" (a, c, b), "inverse
        short cut" (c, a, b), "homing" (b, c, a) or "inverse homing" (c, b, a)."""
        return self._answer(by, relation)
