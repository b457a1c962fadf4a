"""The calculi. Lengths are in the unit of the coordinates.

Each class documents which objects it relates and who introduced it. Its fields are its parameters.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._calculus import CHANGES as CHANGES
from ._calculus import COLUMNS as COLUMNS
from ._calculus import Calculus as Calculus
from ._calculus import Composed, MovingPair, Pair, Single, Triple
from ._calculus import Series as Series
from ._calculus import Timed as Timed


@dataclass(frozen=True)
class Quantised(Calculus):
    """A calculus of motion. Motion counts if it is longer than `quantisation` between two samples or, if `quantisation_per_s`
    is given, faster than that, in lengths per second. The latter does not depend on the sampling rate."""

    quantisation: float = 0.0
    quantisation_per_s: float | None = field(default=None, kw_only=True)

    def _parameters(self) -> dict[str, Any]:
        others = super()._parameters()
        distance, speed = others.pop("quantisation"), others.pop("quantisation_per_s")
        if speed is None:
            return others | {"quantisation": {"Distance": distance}}
        if distance:
            raise ValueError(f"quantisation: expected none beside quantisation_per_s, found {distance}")
        return others | {"quantisation": {"Speed": speed}}

    def _times(self, time_s: ArrayLike | None, samples: int) -> NDArray[np.float64] | None:
        if self.quantisation_per_s is not None and time_s is None:
            raise ValueError("time_s: expected the times of the samples, which quantisation_per_s needs, found none")
        return super()._times(time_s, samples)


@dataclass(frozen=True)
class QtcB(Quantised, MovingPair):
    """QTC_B (Van de Weghe 2004): whether two points move towards each other, "-"; away, "+"; or neither, "0". The sign of a
    comes first. Each sign refers to the position of the other point at the earlier sample."""

    name = "qtc-b"
    objects = "point"
    without_composition = "that of QTC_B is universal in all cells and infers nothing"


@dataclass(frozen=True)
class QtcC(Composed, Quantised, MovingPair):
    """QTC_C (Van de Weghe 2004): the signs of QTC_B, then whether a and b move to the left, "-", or to the right, "+", of the
    line to the other."""

    name = "qtc-c"
    objects = "point"


@dataclass(frozen=True)
class QtcBc(Quantised, MovingPair):
    """QTC_BC (Dondrup et al. 2015): QTC_C if the points are at most `near` apart at the later sample, else QTC_B. The default, in
    metres, is the limit of personal space (Hall 1966), as in QSRlib."""

    name = "qtc-bc"
    objects = "point"
    without_composition = "whether points are near follows from distances, which it does not have"
    near: float = 1.22


@dataclass(frozen=True)
class QtcB22(Composed, Quantised, MovingPair):
    """QTC_B22 (Van de Weghe 2004): the signs of QTC_B, then whether a is slower than b, "-", faster, "+", or as fast, "0"."""

    name = "qtc-b22"
    objects = "point"


@dataclass(frozen=True)
class QtcC22(Quantised, MovingPair):
    """QTC_C22 (Van de Weghe 2004): the signs of QTC_C, the relative speed, and whether the angle from the line to the motion is
    smaller for a than for b, "-", greater, "+", or equal, "0", which also stands for a point at rest."""

    name = "qtc-c22"
    objects = "point"
    without_composition = "it compares angles to different lines, for which no table is known"


@dataclass(frozen=True)
class Mos(Quantised, Single):
    """Moving, "m", or stationary, "s" (QSRlib): whether a point moved since the previous sample."""

    name = "mos"
    objects = "point"


@dataclass(frozen=True)
class Qrpc(Pair):
    """Rectilinear projections (Glez-Cabrera et al. 2013; Patil 2019): how the lines along the headings of two oriented points
    run. Directions that differ by at most `tolerance_rad` are parallel, and points within `tolerance` of a line are on it."""

    name = "qrpc"
    objects = "oriented point"
    tolerance_rad: float = 1e-9
    tolerance: float = 1e-9


@dataclass(frozen=True)
class Opra(Composed, Pair):
    """OPRA_m (Moratz 2006), m from 1 to 4: the segments, out of 4m, in which two oriented points see each other. Rays are even
    and sectors odd, counter-clockwise from the heading. Directions within `tolerance_rad` of a ray are on it."""

    name = "opra"
    objects = "oriented point"
    m: int
    tolerance_rad: float = 1e-9


@dataclass(frozen=True)
class Argd(Composed, Pair):
    """Distances by named thresholds (QSRlib; Patil 2019). `labels` gives the threshold of each label.

    With the bound "upper" (QSRlib), a threshold is the maximum distance of its label, and the last label also covers anything
    beyond. With "lower" (Patil 2019), it is the minimum distance, and the first label also covers anything nearer.
    """

    name = "argd"
    objects = "point"
    labels: Mapping[str, float]
    bound: Literal["upper", "lower"] = "upper"

    def _parameters(self) -> dict[str, Any]:
        if self.bound not in ("upper", "lower"):
            raise ValueError(f"bound: expected upper or lower, found {self.bound!r}")
        labels = [(label, float(threshold)) for label, threshold in self.labels.items()]
        return {"labels": labels, "bound": self.bound.capitalize()}


@dataclass(frozen=True)
class Cardinal(Composed, Pair):
    """Cardinal directions (Frank 1991): the direction of a as seen from b, in cones of 45°. North is along y, east along x."""

    name = "cardinal"
    objects = "point"


@dataclass(frozen=True)
class Order(Composed, Pair):
    """The order along x (Vilain and Kautz 1986): whether a is left of b, together with it, or right. QSRlib's `mwe`."""

    name = "order"
    objects = "point"


@dataclass(frozen=True)
class Tolerant(Calculus):
    """A calculus of extents. Ends or sides that differ by at most `tolerance` are in line."""

    tolerance: float = 0.0


@dataclass(frozen=True)
class Allen(Tolerant, Composed, Pair):
    """Interval algebra (Allen 1983)."""

    name = "allen"
    objects = "interval"


@dataclass(frozen=True)
class Rectangle(Tolerant, Composed, Pair):
    """Rectangle algebra (Balbiani et al. 1998): Allen's relation along x and along y."""

    name = "rectangle"
    objects = "rectangle"


@dataclass(frozen=True)
class Rcc8(Tolerant, Composed, Pair):
    """Region connection (Randell, Cui and Cohn 1992) of rectangles."""

    name = "rcc8"
    objects = "rectangle"


@dataclass(frozen=True)
class Rcc5(Tolerant, Composed, Pair):
    """RCC8 without the distinctions that depend on borders."""

    name = "rcc5"
    objects = "rectangle"


@dataclass(frozen=True)
class Rcc4(Tolerant, Composed, Pair):
    """QSRlib's RCC4. Its `pp` includes equal regions, so a converse may be a set."""

    name = "rcc4"
    objects = "rectangle"


@dataclass(frozen=True)
class Rcc3(Tolerant, Composed, Pair):
    """QSRlib's RCC3."""

    name = "rcc3"
    objects = "rectangle"


@dataclass(frozen=True)
class Rcc2(Tolerant, Composed, Pair):
    """Connected or disconnected."""

    name = "rcc2"
    objects = "rectangle"


@dataclass(frozen=True)
class Tpcc(Triple):
    """Ternary point configurations (Moratz, Nebel and Freksa 2003): the position of the referent c as seen from the origin a on
    the way to the relatum b. Positions within `tolerance_rad` of straight are straight."""

    name = "tpcc"
    objects = "point"
    tolerance_rad: float = 1e-9


@dataclass(frozen=True)
class DraF(Composed, Pair):
    """The fine-grained dipole calculus (Moratz, Renz and Wolter 2000): the positions of the start and the end of b as seen
    along a, then those of a as seen along b, each as a letter of flip-flop. Points within `tolerance` of each other coincide,
    and points within 0.866 times `tolerance` of a line are on it."""

    name = "dra-f"
    objects = "dipole"
    tolerance: float = 1e-9


@dataclass(frozen=True)
class DraC(Composed, Pair):
    """The coarse dipole calculus: the relations of `DraF` in which no point is on the line of the other dipole except at its
    ends. All others are -1, no relation."""

    name = "dra-c"
    objects = "dipole"
    tolerance: float = 1e-9


@dataclass(frozen=True)
class DoubleCross(Composed, Triple):
    """The double cross (Freksa 1992): the position of c as seen on the way from a to b, by side and by the perpendiculars at
    both ends: "lf" left front, "lp" left beside b, "lc" between, "ll" beside a, "lb" behind; "sf", "if", "sc", "ib", "sb" on
    the way, "rf" and so on on the right. Points within `tolerance` of each other coincide, and points within half of it of a
    line are on the line."""

    name = "double-cross"
    objects = "point"
    tolerance: float = 1e-9


@dataclass(frozen=True)
class FlipFlop(Composed, Triple):
    """Flip-flop, refined to LR (Ligozat 1993; Scivos and Nebel 2004): the position of c as seen on the way from a to b. Points
    within `tolerance` of each other coincide, and a point within 0.866 times `tolerance` of the line is on it."""

    name = "flipflop"
    objects = "point"
    tolerance: float = 1e-9
