"""Qualitative relations of objects in the plane, for arrays: motion, direction, distance, contact, order.

    import numpy
    from sketchnav import relations

    human = numpy.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 0.0]])
    robot = numpy.array([[5.0, 0.5], [4.0, 0.5], [4.0, 0.5], [3.0, 0.5]])
    qtc = relations.QtcB()
    qtc.words(qtc.relate(human, robot))  # ['', '-,-', '-,0', '0,-']

A calculus relates arrays of objects, one row each, and returns an array of codes, which are indices into `calculus.relations`;
-1 stands for no relation. Arrays of aligned doubles are read in place, whatever their strides, and others are converted first.
Anything with the buffer protocol will do, and so will lists.

    object          row                             unit
    point           x, y                            one length of your choice
    oriented point  x, y, heading                   length, length, radians counter-clockwise from x
    dipole          start x, start y, end x, end y    length
    rectangle       low x, low y, high x, high y    length
    interval        low, high                       any

The axes x and y are right-handed, so left and right swap in image coordinates. The first axis of an array is time. The others
are tracks, which follow the rules of broadcasting: `relate(a[:, None], others)` relates a track to all others, and a single row
is an object that stands still. A row that contains NaN is an object that was not seen, and no relation is inferred across it.

Invalid values raise ValueError, which names the argument and the row.
"""

from .calculi import (
    Allen,
    Argd,
    Calculus,
    Cardinal,
    DoubleCross,
    DraC,
    DraF,
    FlipFlop,
    Mos,
    Opra,
    Order,
    Qrpc,
    QtcB,
    QtcB22,
    QtcBc,
    QtcC,
    QtcC22,
    Rcc2,
    Rcc3,
    Rcc4,
    Rcc5,
    Rcc8,
    Rectangle,
    Series,
    Timed,
    Tpcc,
)
from .networks import Inconsistent, Network

__all__ = [
    "Allen",
    "Argd",
    "Calculus",
    "Cardinal",
    "DoubleCross",
    "DraC",
    "DraF",
    "FlipFlop",
    "Inconsistent",
    "Mos",
    "Network",
    "Opra",
    "Order",
    "Qrpc",
    "QtcB",
    "QtcB22",
    "QtcBc",
    "QtcC",
    "QtcC22",
    "Rcc2",
    "Rcc3",
    "Rcc4",
    "Rcc5",
    "Rcc8",
    "Rectangle",
    "Series",
    "Timed",
    "Tpcc",
]
