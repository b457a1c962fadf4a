"""Histograms of forces between polygons (Matsakis and Wendling 1999): how much of one lies in each direction from the other.

    square = numpy.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    forces_0 = histogram(square + [3.0, 3.0], square)
    assess(forces_0, 16)  # direction 2 of 16, which is 45° from the heading

A polygon is an array of corners, or several, its rings: a point is inside if an odd number of rings surround it. Directions are
in radians, counter-clockwise from x, and those of a histogram are evenly spaced from 0. An infinite force, between objects that
touch or overlap, is an infinity.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ._calculus import rows


class Assessment(NamedTuple):
    """The direction that best describes the position of the argument."""

    #: The index of the direction, counter-clockwise from 0 at the heading.
    direction: int
    #: The degree to which the argument is in this direction, from 0 to 1.
    degree: float
    #: "satisfactory", "rather satisfactory" or "unsatisfactory", from 0.75, from 0.5 and below.
    grade: str


class Opening(NamedTuple):
    """A range of directions without forces."""

    middle_rad: float
    width_rad: float


def _rings(name: str, polygon: ArrayLike | Sequence[ArrayLike]) -> list[NDArray[np.float64]]:
    is_one = isinstance(polygon, np.ndarray) or np.ndim(polygon[0]) == 1  # type: ignore[index]
    rings: Any = [polygon] if is_one else polygon
    return [_ring(name, ring) for ring in rings]


def _ring(name: str, ring: ArrayLike) -> NDArray[np.float64]:
    corners = rows(name, ring, "point")
    if corners.ndim != 2:
        raise ValueError(f"{name}: expected corners of the shape (corners, 2), found {corners.shape}")
    return corners[:, None]


def histogram(
    argument: ArrayLike | Sequence[ArrayLike],
    referent: ArrayLike | Sequence[ArrayLike],
    *,
    exponent: float = 0.0,
    directions: int = 180,
) -> NDArray[np.float64]:
    """The force F_r(θ) of the argument on the referent in each direction, where r is the exponent of the distance, from 0
    (constant forces) through 2 (gravitational ones) to 16. It is large in the direction of the argument as seen from the
    referent."""
    found = _core.forces_histogram(_rings("argument", argument), _rings("referent", referent), exponent, directions)
    return np.frombuffer(found, np.float64)


def distance(argument: ArrayLike | Sequence[ArrayLike], referent: ArrayLike | Sequence[ArrayLike]) -> float:
    """The minimum distance between two polygons, or 0 if they overlap: Chronis's proximity (2007)."""
    return _core.forces_distance(_rings("argument", argument), _rings("referent", referent))


def degrees(
    histogram: ArrayLike, directions_rad: ArrayLike, *, heading_rad: float = 0.0
) -> NDArray[np.float64]:
    """The degree to which the argument is in each direction, from 0 to 1 (after Matsakis et al. 2001); the directions are relative
    to the heading. NaN if a force is infinite or none is above 0."""
    directions = np.ascontiguousarray(directions_rad, np.float64) + heading_rad
    found = _core.forces_degrees(_forces(histogram), directions.ravel())
    return np.frombuffer(found, np.float64).reshape(directions.shape)


def assess(
    histogram: ArrayLike,
    directions: int,
    *,
    heading_rad: float = 0.0,
    gravitational: ArrayLike | None = None,
) -> Assessment | None:
    """The best of this many directions from the heading, or None if no degree is known. With a second histogram, of
    gravitational forces, the lesser degree counts, unless its forces are infinite."""
    other = None if gravitational is None else _forces(gravitational)
    found = _core.forces_assess(_forces(histogram), other, heading_rad, directions)
    return None if found is None else Assessment(*found)


def extent(histogram: ArrayLike) -> tuple[float, Opening | None]:
    """The part of a full turn with forces, in radians, and the widest opening, if there is one."""
    width_rad, opening = _core.forces_extent(_forces(histogram))
    return width_rad, None if opening is None else Opening(*opening)


def surround(width_rad: float, main: int, directions: int, *, can_escape: bool) -> tuple[str, int | None] | None:
    """How the argument surrounds the referent (Chronis 2007, 3.2.2), by the width of the histogram of constant forces: "from" the
    main direction, with an "opening" in a direction, or "completely". None if it does not."""
    return _core.forces_surround(width_rad, main, directions, can_escape)


def _forces(histogram: ArrayLike) -> NDArray[np.float64]:
    return np.ascontiguousarray(histogram, np.float64)
