"""Reasoning about the known relations of several objects: path consistency, scenarios, minimal networks.

    network = Network(Rcc8(), ["cup", "table", "kitchen"])
    network.constrain("cup", "table", "ntpp")
    network.constrain("table", "kitchen", {"ntpp", "tpp"})
    network.close()
    network.relations("cup", "kitchen")  # {'ntpp'}

A network without a model may still be closed. The README of the library `qualitative` lists the calculi in which a closed
network with one relation for each pair has a model.
"""

from collections.abc import Iterable

from .. import _core
from ._calculus import Calculus, Composed, OfTracks


class Inconsistent(ValueError):
    """A network that has no model. `objects` are those that show it: two, or three with the second between the others."""

    def __init__(self, message: str, objects: tuple[str, ...]):
        super().__init__(message)
        self.objects = objects


class Network:
    """A set of possible relations for each pair of objects. Initially, all relations are possible."""

    def __init__(self, calculus: Calculus, objects: Iterable[str]):
        if not (isinstance(calculus, Composed) and isinstance(calculus, OfTracks)):
            found = type(calculus).__name__
            raise ValueError(f"calculus: expected one of two objects with a composition, such as Rcc8(), found {found}")
        self.calculus = calculus
        self.objects = tuple(objects)
        if len(set(self.objects)) < len(self.objects):
            raise ValueError(f"objects: expected different names, found {', '.join(self.objects)}")
        all_codes = frozenset(range(len(calculus.relations)))
        self._sets = [all_codes] * len(self.objects) ** 2

    def _at(self, first: str, second: str) -> int:
        for name in (first, second):
            if name not in self.objects:
                raise ValueError(f"expected one of the objects {' '.join(self.objects)}, found {name!r}")
        if first == second:
            raise ValueError(f"expected two different objects, found {first!r} twice")
        return self.objects.index(first) * len(self.objects) + self.objects.index(second)

    def constrain(self, first: str, second: str, to: str | Iterable[str]) -> None:
        """Restricts the relations of one object to another to these."""
        at = self._at(first, second)
        self._sets[at] &= {self.calculus.code(word) for word in ([to] if isinstance(to, str) else to)}

    def relations(self, first: str, second: str) -> frozenset[str]:
        """The possible relations of one object to another."""
        return frozenset(self.calculus.relations[code] for code in self._sets[self._at(first, second)])

    def close(self) -> None:
        """Removes the relations that those to some third object rule out, which makes the network path-consistent.

        Raises Inconsistent if no relation is left for a pair. The network is then left unchanged.
        """
        self._sets = self._reasoned("close")

    def scenario(self) -> "Network":
        """A closed network with one of the relations for each pair. Takes exponential time in the worst case.

        Raises Inconsistent if there is none.
        """
        return self._with(self._reasoned("scenario"))

    def minimal(self) -> "Network":
        """The network with exactly the relations that occur in some scenario.

        Raises Inconsistent if there is no scenario.
        """
        return self._with(self._reasoned("minimal"))

    def _with(self, sets: list[frozenset[int]]) -> "Network":
        network = Network(self.calculus, self.objects)
        network._sets = sets
        return network

    def _reasoned(self, task: str) -> list[frozenset[int]]:
        sets = [list(known) for known in self._sets]
        found = _core.relations_reason(self.calculus._opened, task, len(self.objects), sets)
        if found is None:
            raise ValueError(f"calculus: expected one with a table, found {type(self.calculus).__name__}")
        is_consistent, parts = found
        if is_consistent:
            return [frozenset(known) for known in parts]
        objects = tuple(self.objects[at] for at in parts[0])
        match objects:
            case (first, second):
                message = f"expected a relation of {first} to {second}, found none that is possible in both orders"
            case (first, via, second):
                message = f"expected a relation of {first} to {second}, found none that {via} permits"
            case _:
                message = "expected a closed network of base relations, found none"
        raise Inconsistent(message, objects)
