"""The interface of QSRlib (Gatsoulis et al. 2016; strands_qsr_lib 0.4.1), computed by `sketchnav.relations`.

    from sketchnav.relations.qsrlib import Object_State, QSRlib, QSRlib_Request_Message, World_Trace

instead of

    from qsrlib.qsrlib import QSRlib, QSRlib_Request_Message
    from qsrlib_io.world_trace import Object_State, World_Trace

Worlds, keys and answers are those of QSRlib, and its calculi treat borders, times and quantisation in the same way.
`docs/relations.md` lists the differences. For results without QSRlib's peculiarities, use the calculi of `sketchnav.relations`.
"""

from .library import QSRlib, QSRlib_Request_Message, QSRlib_Response_Message
from .worlds import (
    QSR,
    Object_State,
    World_QSR_State,
    World_QSR_Trace,
    World_State,
    World_Trace,
)

__all__ = [
    "QSR",
    "Object_State",
    "QSRlib",
    "QSRlib_Request_Message",
    "QSRlib_Response_Message",
    "World_QSR_State",
    "World_QSR_Trace",
    "World_State",
    "World_Trace",
]
