"""Episodes, activity graphs and graphlets (Sridhar, Cohn and Hogg 2010; Duckworth et al. 2016), in the form used by QSRlib.

An episode is a relation of some objects from one time to another. The activity graph (QSTAG) has a node for each object, for
each episode, and for each pair of episodes, which contains Allen's relation of their times. Graphlets are the small activity
graphs of consecutive episodes, and their counts describe what happened. Only the standard library is needed.
"""

import bisect
import hashlib
import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from .worlds import World_QSR_Trace, World_Trace


class Episode(NamedTuple):
    """Some objects, their relations by the calculi, and the first and last time at which they held."""

    objects: list[str]
    relations: dict[str, str]
    times: tuple[float, float]


@dataclass(frozen=True)
class Node:
    """A node: `node_type` is "object", "spatial_relation" or "temporal_relation". `node["name"]` is `node.name`, as in igraph."""

    index: int
    name: Any
    node_type: str
    obj_type: str | None = None

    def __getitem__(self, attribute: str) -> Any:
        return getattr(self, attribute)


class Graph:
    """Nodes and directed edges between their indices."""

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self.spatial_obj_edges: list[tuple[int, int]] = []
        self.temp_spatial_edges: list[tuple[int, int]] = []

    @property
    def edges(self) -> list[tuple[int, int]]:
        return self.spatial_obj_edges + self.temp_spatial_edges

    def _add(self, name: Any, node_type: str, obj_type: str | None = None) -> int:
        self.nodes.append(Node(len(self.nodes), name, node_type, obj_type))
        return len(self.nodes) - 1

    def of_type(self, node_type: str) -> list[Node]:
        return [node for node in self.nodes if node.node_type == node_type]

    def code(self) -> int:
        """A number that graphs of the same structure and names share, on every machine (after Frasconi et al. 2014, figure 4)."""
        seen = [_hash(repr(sorted(self._distances(node)))) for node in self.nodes]
        return _hash(repr(sorted((seen[start], seen[end]) for start, end in self.edges)))

    def _distances(self, node: Node) -> Iterable[tuple[int, str]]:
        """The distance to each node along the edges, with its name."""
        distances, ring = {node.index: 0}, [node.index]
        while ring:
            ring = [end for start, end in self.edges if start in ring and end not in distances]
            distances |= {index: 1 + max(distances.values()) for index in ring}
        return [(distance, _name(self.nodes[index].name)) for index, distance in distances.items()]

    def dot(self) -> str:
        """The graph in the language of Graphviz."""
        lines = ["digraph activity_graph {"]
        colours = {"object": "tan1", "spatial_relation": "lightblue", "temporal_relation": "white"}
        for node in self.nodes:
            label = _name(node.name).replace('"', "'")
            lines.append(f'  {node.index} [label="{label}", style=filled, fillcolor={colours[node.node_type]}];')
        lines += [f"  {start} -> {end};" for start, end in self.edges]
        return "\n".join([*lines, "}"])


def _name(name: Any) -> str:
    return ", ".join(f"{which}: {word}" for which, word in sorted(name.items())) if isinstance(name, dict) else str(name)


def _hash(text: str) -> int:
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest(), signed=True)


def compute_episodes(world_qsr: World_QSR_Trace) -> list[Episode]:
    """The episodes of a trace of relations. As in QSRlib, origin and relatum of TPCC count as one object, episodes with the word
    "Ignore" are left out, and so is the time 1 if QTC_B is among the calculi."""
    times = world_qsr.get_sorted_timestamps()
    if "qtcbs" in world_qsr.qsr_type and times[:1] == [1.0]:
        times = times[1:]
    rows: dict[tuple[str, ...], list[tuple[float, dict[str, str]]]] = {}
    for time in times:
        for between, qsr in world_qsr.trace[time].qsrs.items():
            names = tuple(between.split(","))
            for objects, relations in _split(names, qsr.qsr):
                rows.setdefault(objects, []).append((time, relations))
    episodes: list[Episode] = []
    for objects, states in rows.items():
        for relations, same in itertools.groupby(states, key=lambda state: state[1]):
            held = [time for time, _ in same]
            if "Ignore" not in relations.values():
                episodes.append(Episode(list(objects), relations, (held[0], held[-1])))
    return episodes


def _split(names: tuple[str, ...], relations: Mapping[str, str]) -> Iterable[tuple[tuple[str, ...], dict[str, str]]]:
    others = {which: word for which, word in relations.items() if which != "tpcc"}
    if "tpcc" in relations:
        origin, relatum, referent = names
        yield (f"{origin}-{relatum}", referent), {"tpcc": relations["tpcc"]}
    if others:
        yield names, others


def allen(first: tuple[float, float], second: tuple[float, float]) -> str:
    """Allen's relation of two periods, each from its first to its last sample. Samples one unit apart meet."""
    (a, b), (c, d) = first, second
    if c - 1 == b:
        return "m"
    if a - 1 == d:
        return "mi"
    if c > b:
        return "<"
    if a > d:
        return ">"
    words = [["o", "fi", "di"], ["s", "=", "si"], ["d", "f", "oi"]]
    return words[(a >= c) + (a > c)][(b >= d) + (b > d)]


#: Temporal relations that are written as their converses, with the edges reversed.
CONVERSES = {">": "<", "mi": "m", "oi": "o", "si": "s", "di": "d", "fi": "f"}


def get_graph(episodes: Sequence[Episode], object_types: Mapping[str, str] | None = None) -> Graph:
    """The activity graph of episodes. Two episodes that are both the first ones, or both the last ones, of their objects have no
    temporal node."""
    graph, objects = Graph(), dict[str, int]()
    spatial: list[tuple[tuple[int, ...], int, tuple[float, float]]] = []
    for episode in episodes:
        for name in episode.objects:
            if name not in objects:
                objects[name] = graph._add(name, "object", (object_types or {}).get(name))
        node = graph._add(episode.relations, "spatial_relation")
        ends = [objects[name] for name in episode.objects]
        graph.spatial_obj_edges.append((ends[0], node))
        graph.spatial_obj_edges += [(node, end) for end in ends[1:]]
        spatial.append((tuple(ends), node, episode.times))
    rows = [[one for one in spatial if one[0] == ends] for ends in dict.fromkeys(one[0] for one in spatial)]
    first = {min(row, key=lambda one: one[2][0])[1] for row in rows}
    last = {max(row, key=lambda one: one[2][1])[1] for row in rows}
    for (_, a, when), (_, b, then) in itertools.combinations(spatial, 2):
        if {a, b} <= first or {a, b} <= last:
            continue
        word = allen(when, then)
        if word in CONVERSES:
            word, a, b = CONVERSES[word], b, a
        node = graph._add(word, "temporal_relation")
        graph.temp_spatial_edges += [(a, node), (node, b)]
    return graph


class Graphlets:
    """Small activity graphs, by their codes, and how often each occurs: `histogram` counts those of `code_book`."""

    def __init__(
        self,
        episodes: Sequence[Episode],
        params: Mapping[str, int],
        object_types: Mapping[str, str],
        times: Sequence[float],
    ):
        self.graphlets: dict[int, Graph] = {}
        counts: dict[int, int] = {}
        for selection in _selections(episodes, params, times):
            kinds = [e._replace(objects=[_kind(name, object_types) for name in e.objects]) for e in selection]
            graph = get_graph(kinds)
            code = graph.code()
            self.graphlets.setdefault(code, graph)
            counts[code] = counts.get(code, 0) + 1
        self.code_book, self.histogram = list(counts), list(counts.values())


def _kind(name: str, object_types: Mapping[str, str]) -> str:
    kind = object_types.get(name, "unknown")
    return name if kind == "unknown" else kind


def _selections(
    episodes: Sequence[Episode], params: Mapping[str, int], times: Sequence[float]
) -> Iterable[list[Episode]]:
    """The sets of episodes, at most `max_eps`, that hold during some stretch of time, of `min_rows` to `max_rows` tuples of objects."""
    rows: dict[tuple[str, ...], list[int]] = {}
    for i, episode in enumerate(episodes):
        rows.setdefault(tuple(episode.objects), []).append(i)
    for count in range(params.get("min_rows", 1), params.get("max_rows", 1) + 1):
        for chosen in itertools.combinations(rows.values(), count):
            chords = _chords(episodes, list(itertools.chain(*chosen)), times)
            stretches = (chords[i:j] for i in range(len(chords)) for j in range(i + 1, len(chords) + 1))
            selections = dict.fromkeys(tuple(sorted(set(itertools.chain(*stretch)))) for stretch in stretches)
            yield from ([episodes[i] for i in one] for one in selections if len(one) <= params["max_eps"])


def _chords(episodes: Sequence[Episode], chosen: Sequence[int], times: Sequence[float]) -> list[tuple[int, ...]]:
    """The episodes that hold at the same time, from one change to the next."""
    ends = sorted({time for i in chosen for time in episodes[i].times})
    # At the samples between two ends, fewer episodes may hold than at either.
    places = [bisect.bisect_right(times, end) for end in ends]
    moments = sorted({*ends, *(times[place] for place in places if place < len(times) and times[place] <= ends[-1])})
    held = [tuple(i for i in chosen if episodes[i].times[0] <= at <= episodes[i].times[1]) for at in moments]
    return [chord for chord, _ in itertools.groupby(chord for chord in held if chord)]


class Activity_Graph:
    """The activity graph of a world and its relations, with its graphlets.

    `params` has "max_eps", the maximum number of episodes in a graphlet, and "min_rows" and "max_rows", the numbers of tuples
    of objects in it, by default 1. `object_types` names the kinds of objects; the kinds of all others are the `object_type` of
    the objects' states.
    """

    def __init__(
        self,
        world: World_Trace,
        world_qsr: World_QSR_Trace,
        object_types: Mapping[str, str] | None = None,
        params: Mapping[str, int] | None = None,
    ):
        if not isinstance((params or {}).get("max_eps"), int):
            raise ValueError(f"qstag.params: expected max_eps, the number of episodes in a graphlet, found {params}")
        self.episodes = compute_episodes(world_qsr)
        self.object_types = self.get_objects_types(object_types or {}, world)
        self.graph = get_graph(self.episodes, self.object_types)
        self.graphlets = Graphlets(self.episodes, params or {}, self.object_types, world_qsr.get_sorted_timestamps())

    @staticmethod
    def get_objects_types(objects_types: Mapping[str, str], world: World_Trace) -> dict[str, str]:
        types = dict(objects_types)
        for state in world.trace.values():
            for name, object_state in state.objects.items():
                types.setdefault(name, object_state.kwargs.get("object_type", "unknown"))
        return types

    @property
    def spatial_obj_edges(self) -> list[tuple[int, int]]:
        return self.graph.spatial_obj_edges

    @property
    def temp_spatial_edges(self) -> list[tuple[int, int]]:
        return self.graph.temp_spatial_edges

    @property
    def object_nodes(self) -> list[Node]:
        return self.graph.of_type("object")

    @property
    def spatial_nodes(self) -> list[Node]:
        return self.graph.of_type("spatial_relation")

    @property
    def temporal_nodes(self) -> list[Node]:
        return self.graph.of_type("temporal_relation")

    @property
    def histogram(self) -> dict[int, int]:
        """How often each graphlet occurs, by its code."""
        return dict(zip(self.graphlets.code_book, self.graphlets.histogram, strict=True))
