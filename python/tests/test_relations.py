"""Tests of relations of arrays. `tests/tools/relations.rs` runs them with the wheel; pytest runs them too."""

import copy
import itertools
import math
import pathlib
import pickle
import re

import numpy as np
from sketchnav import relations
from sketchnav.relations import _calculus, forces

RANDOM = np.random.default_rng(7)


def refused(call, error, words):
    try:
        call()
    except error as found:
        assert words in str(found), f"{found!s}\nexpected: {words}"
    else:
        raise AssertionError(f"expected: {words}")


def signs(k, l):
    """Computes QTC_C from its definition with NumPy: towards or away, and left or right, for k and for l."""

    def of(moved, to):
        along = -np.sign(np.sum(moved * to, axis=-1))
        across = -np.sign(to[..., 0] * moved[..., 1] - to[..., 1] * moved[..., 0])
        return along.astype(int), across.astype(int)

    (k_to, k_side), (l_to, l_side) = of(np.diff(k, axis=0), (l - k)[:-1]), of(np.diff(l, axis=0), (k - l)[:-1])
    return np.stack([k_to, l_to, k_side, l_side], axis=-1)


def walks(samples):
    return [np.cumsum(RANDOM.integers(-2, 3, (samples, 2)), axis=0).astype(float) + at for at in ([0, 0], [40.5, 7.25])]


def test_the_signs_of_qtc_are_those_of_its_definition():
    k, l = walks(2000)
    expected = signs(k, l)
    qtc = relations.QtcC()
    words = qtc.words(qtc.relate(k, l))
    assert words[0] == ""
    assert words[1:].tolist() == [",".join("-0+"[sign + 1] for sign in row) for row in expected]
    basic = relations.QtcB()
    assert basic.words(basic.relate(k, l))[1:].tolist() == [word[:3] for word in words[1:].tolist()]
    assert qtc.converse("-,+,0,-") == {"+,-,-,0"}


def test_arrays_are_read_where_they_are():
    k, l = walks(500)
    qtc = relations.QtcC()
    expected = qtc.relate(k, l).tolist()
    table = np.full((500, 7), np.nan)
    table[:, 2:4], table[:, 5:7] = k, l
    for a, b in [(table[:, 2:4], table[:, 5:7]), (np.asfortranarray(k), l), (k.tolist(), memoryview(l))]:
        assert qtc.relate(a, b).tolist() == expected
    backwards = qtc.relate(k[::-2], l[::-2])
    assert backwards.tolist() == qtc.relate(k[::-2].copy(), l[::-2].copy()).tolist()
    for part in (table[:, 2:4], k[::-2], np.broadcast_to(k, (3, 500, 2)).swapaxes(0, 1)):
        _, [array] = _calculus.aligned("a", [part], "point")
        assert np.shares_memory(array, part), part.strides
    still = np.broadcast_to(np.array([3.0, 4.0]), (500, 2))
    assert qtc.relate(k, still).tolist() == qtc.relate(k, [3.0, 4.0]).tolist()
    assert qtc.relate(k.astype(np.float32), l.astype(">f8")).tolist() == expected


def test_tracks_are_broadcast():
    tracks = RANDOM.uniform(-5, 5, (50, 4, 2))
    direction = relations.Cardinal()
    codes = direction.relate(tracks[:, :, None], tracks[:, None])
    assert codes.shape == (50, 4, 4) and codes.dtype == np.int16
    for i, j in itertools.product(range(4), range(4)):
        assert codes[:, i, j].tolist() == direction.relate(tracks[:, i], tracks[:, j]).tolist()
    assert set(direction.words(codes[:, 2, 2])) == {"eq"}
    assert direction.words(direction.relate([0.0, 1.0], [0.0, 0.0])) == "n"


def test_what_was_not_seen_has_no_relation():
    k, l = walks(10)
    k[4] = np.nan
    codes = relations.QtcB().relate(k, l)
    assert (codes == -1).nonzero()[0].tolist() == [0, 4, 5]
    assert (relations.Cardinal().relate(k, l) == -1).nonzero()[0].tolist() == [4]
    changes = [timed.change for timed in relations.QtcB().series(k, l)]
    assert changes.count("first") == 2


def test_a_series_keeps_times_and_marks_changes():
    human = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 0.0]]
    robot = [[5.0, 0.5], [4.0, 0.5], [4.0, 0.5], [3.0, 0.5]]
    qtc = relations.QtcB()
    series = qtc.series(human, robot, time_s=[0.0, 0.1, 0.2, 0.3])
    assert list(series) == [
        ("-,-", 0.0, 0.1, "first"),
        ("-,0", 0.1, 0.2, "neighbour"),
        ("0,0", 0.2, 0.3, "inserted"),
        ("0,-", 0.2, 0.3, "neighbour"),
    ]
    assert len(series) == 4 and series.words.tolist() == ["-,-", "-,0", "0,0", "0,-"]
    assert len(qtc.series(human, robot, validate=False)) == 3
    still = qtc.series([[0.0, 0.0]] * 9, [1.0, 0.0], time_s=[0, 1, 2, 3, 9, 10, 11, 12, 13], max_gap_s=2.0)
    assert [(timed.from_s, timed.to_s, timed.change) for timed in still] == [(0, 3, "first"), (9, 13, "first")]
    every = qtc.series([[0.0, 0.0]] * 9, [1.0, 0.0], collapse=False)
    assert len(every) == 8


def test_a_quantisation_is_a_length_or_a_speed():
    k = np.cumsum(np.full((6, 2), [0.5, 0.0]), axis=0)
    words = lambda qtc, **more: set(qtc.words(qtc.relate(k, [100.0, 0.0], **more))[1:].tolist())
    assert words(relations.QtcB(0.4)) == {"-,0"} and words(relations.QtcB(0.6)) == {"0,0"}
    fast, slow = np.arange(6) * 0.1, np.arange(6) * 10.0
    by_speed = relations.QtcB(quantisation_per_s=1.0)
    assert words(by_speed, time_s=fast) == {"-,0"} and words(by_speed, time_s=slow) == {"0,0"}
    refused(lambda: by_speed.relate(k, k), ValueError, "time_s: expected the times of the samples")
    refused(lambda: by_speed.series(k, k), ValueError, "time_s: expected the times of the samples")
    refused(lambda: relations.Mos(1.0, quantisation_per_s=1.0), ValueError, "quantisation: expected none beside")


def test_each_calculus_relates_its_objects():
    box = lambda x, y: [x, y, x + 2.0, y + 1.0]
    for calculus, objects, word in [
        (relations.QtcBc(), ([[0.0, 0.0], [1.0, 0.0]], [2.0, 0.0]), ["", "-,0,0,0"]),
        (relations.QtcBc(near=0.5), ([[0.0, 0.0], [1.0, 0.0]], [2.0, 0.0]), ["", "-,0"]),
        (relations.Mos(), ([[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]],), ["", "m", "s"]),
        (relations.Qrpc(), ([0.0, 0.0, 0.0], [5.0, 0.0, math.pi]), "[↓ 0 (+,+) +]"),
        (relations.Opra(1), ([0.0, 0.0, math.pi / 2], [3.0, 0.0, 0.0]), "3_2"),
        (relations.Opra(2), ([0.0, 0.0, math.pi / 2], [3.0, 0.0, 0.0]), "6_4"),
        (relations.Argd({"near": 3.0, "medium": 3.5, "far": 4.0}), ([0.0, 0.0], [3.7, 0.0]), "far"),
        (relations.Argd({"near": 3.0, "medium": 3.5, "far": 4.0}, "lower"), ([0.0, 0.0], [3.7, 0.0]), "medium"),
        (relations.Cardinal(), ([1.0, 1.0], [0.0, 0.0]), "ne"),
        (relations.Order(), ([1.0, 1.0], [0.0, 0.0]), "right"),
        (relations.Allen(), ([0.0, 1.0], [1.0, 3.0]), "m"),
        (relations.Rectangle(), (box(0.0, 0.0), box(2.0, 0.5)), "m,o"),
        (relations.Rcc8(), (box(0.0, 0.0), box(2.0, 0.5)), "ec"),
        (relations.Rcc8(0.25), (box(0.0, 0.0), box(2.2, 0.5)), "ec"),
        (relations.Rcc5(), (box(0.0, 0.0), box(1.0, 0.5)), "po"),
        (relations.Rcc4(), (box(0.0, 0.0), box(0.0, 0.0)), "pp"),
        (relations.Rcc3(), (box(0.0, 0.0), box(0.0, 0.0)), "o"),
        (relations.Rcc2(), (box(0.0, 0.0), box(2.0, 0.5)), "c"),
        (relations.Tpcc(), ([0.0, 0.0], [1.0, 0.0], [1.5, 0.1]), "clb"),
        (relations.FlipFlop(), ([0.0, 0.0], [1.0, 0.0], [1.5, 0.1]), "l"),
        (relations.DoubleCross(), ([0.0, 0.0], [1.0, 0.0], [1.5, 0.1]), "lf"),
        (relations.DoubleCross(0.5), ([0.0, 0.0], [9.0, 0.0], [5.0, 0.2]), "sc"),
        (relations.DraF(), ([0.0, 0.0, 1.0, 0.0], [2.0, 0.0, 3.0, 0.0]), "ffbb"),
        (relations.DraC(), ([0.0, 0.0, 1.0, 0.0], [[2.0, 0.0, 3.0, 0.0], [1.0, 0.0, 2.0, 1.0]]), ["", "ells"]),
        (relations.QtcB22(), ([[0.0, 0.0], [1.0, 0.0]], [[9.0, 0.0], [7.0, 0.0]]), ["", "-,-,-"]),
        (relations.QtcC22(), ([[0.0, 0.0], [1.0, 0.5]], [[9.0, 0.0], [7.0, 0.5]]), ["", "-,-,-,+,-,+"]),
    ]:
        assert calculus.words(calculus.relate(*objects)).tolist() == word, calculus
        assert [calculus.code(word) for word in calculus.relations] == list(range(len(calculus.relations))), calculus
        assert all(calculus.neighbours(word) <= set(calculus.relations) for word in calculus.relations), calculus
        for other in (pickle.loads(pickle.dumps(calculus)), copy.deepcopy(calculus)):
            assert other == calculus and other.words(other.relate(*objects)).tolist() == word


def test_the_algebra_of_a_calculus():
    rcc8 = relations.Rcc8()
    assert rcc8.converse("tpp") == {"tppi"} and rcc8.compose("ntpp", "ec") == {"dc"}
    assert rcc8.neighbours("dc") == {"ec"}
    assert relations.FlipFlop().compose("l", "l") == {"l", "r", "i", "s", "b"}
    assert relations.FlipFlop().permuted("f", "inverse") == {"b"}
    assert relations.Tpcc().permuted("sam", "short cut") == {"sam"} and len(relations.Tpcc().permuted("csl", "homing")) > 1
    argd = relations.Argd({"near": 1.0, "far": 4.0, "away": 9.0})
    assert argd.compose("near", "near") == {"near", "far"} and argd.neighbours("near") == {"far"}
    assert relations.DoubleCross().compose("lc", "if") == {"lc"}
    assert relations.DoubleCross().permuted("lc", "homing") == {"lf", "lp", "lc"}
    assert relations.DraC().converse("ells") == {"lsel"} and len(relations.DraF().relations) == 72
    assert relations.QtcC().compose("-,-,0,0", "+,-,0,0") == {"-,-,0,0"}
    assert {word[-1] for word in relations.QtcB22().compose("-,-,+", "-,-,+")} == {"+"}
    assert not hasattr(relations.QtcB(), "compose") and not hasattr(relations.QtcC22(), "compose")
    refused(lambda: relations.Tpcc().permuted("sam", "back"), ValueError, "by: expected inverse, short cut")


def test_a_network_is_closed_and_says_why_it_cannot_be():
    network = relations.Network(relations.Rcc8(), ["cup", "table", "kitchen"])
    network.constrain("cup", "table", "ntpp")
    network.constrain("table", "kitchen", {"ntpp", "tpp"})
    network.close()
    assert network.relations("cup", "kitchen") == {"ntpp"} and network.relations("kitchen", "cup") == {"ntppi"}
    scenario = network.scenario()
    assert len(scenario.relations("table", "kitchen")) == 1 == len(network.minimal().relations("cup", "kitchen"))
    network.constrain("cup", "kitchen", ["dc", "ec"])
    refused(network.close, relations.Inconsistent, "expected a relation of cup to kitchen")
    refused(network.minimal, relations.Inconsistent, "expected a relation of cup to kitchen")
    refused(lambda: network.constrain("cup", "pan", "ec"), ValueError, "one of the objects cup table kitchen, found 'pan'")
    refused(lambda: network.relations("cup", "cup"), ValueError, "two different objects")
    refused(lambda: network.constrain("cup", "table", "in"), ValueError, "rcc8: expected one of dc ec po")
    refused(lambda: relations.Network(relations.QtcB(), ["a", "b"]), ValueError, "calculus: expected one of two objects")


def test_a_network_of_motions_and_one_of_dipoles_are_closed():
    qtc = relations.Network(relations.QtcC(), ["k", "l", "m"])
    qtc.constrain("k", "l", "-,-,0,0")
    qtc.constrain("l", "m", "+,-,0,0")
    qtc.close()
    assert qtc.relations("k", "m") == {"-,-,0,0"}
    chain = relations.Network(relations.DraC(), ["first", "second", "third"])
    chain.constrain("first", "second", "ells")
    chain.constrain("second", "third", "ells")
    chain.close()
    assert "lsel" in chain.relations("first", "third") and "rser" not in chain.relations("first", "third")


def test_times_of_intervals_are_consistent_as_they_are():
    ends = np.sort(RANDOM.uniform(0, 10, (6, 2)), axis=1)
    allen = relations.Allen()
    codes = allen.relate(ends[:, None], ends[None])
    network = relations.Network(allen, [f"event {i}" for i in range(6)])
    for i, j in itertools.permutations(range(6), 2):
        network.constrain(f"event {i}", f"event {j}", {str(allen.words(codes[i, j])), "="})
    minimal = network.minimal()
    for i, j in itertools.permutations(range(6), 2):
        assert str(allen.words(codes[i, j])) in minimal.relations(f"event {i}", f"event {j}")


def test_errors_name_the_argument_and_the_row():
    k, l = walks(5)
    qtc = relations.QtcB()
    l[3, 1] = np.inf
    refused(lambda: qtc.relate(k, l), ValueError, "b[3]: y: expected a number within ±1e150, found inf")
    refused(lambda: qtc.relate(np.stack([k, k], 1), np.stack([k, l], 1)), ValueError, "b[3, 1]: y:")
    refused(lambda: qtc.relate(k, l[:, :1]), ValueError, "b: expected a last axis of 2 (x, y), found the shape (5, 1)")
    refused(lambda: qtc.relate(k, k[:3]), ValueError, "found a (5, 2), b (3, 2)")
    refused(lambda: qtc.relate("walk", k), ValueError, "a: expected an array of numbers")
    refused(lambda: qtc.series(k, k, time_s=[0, 1, 2, 2, 4]), ValueError, "time_s[3]: expected a time after 2.0 s, found 2.0")
    refused(lambda: qtc.series(k, k, time_s=[0, 1]), ValueError, "time_s: expected a time for each of the 5 samples")
    refused(lambda: qtc.series(np.stack([k, k], 1), k[:, None]), ValueError, "expected arrays of one track each")
    refused(lambda: relations.Rcc8().relate([0, 0, 1, 0], [0, 0, 1, 1]), ValueError, "a[0]: height: expected an extent above 0")
    refused(lambda: relations.Opra(5), ValueError, "m: expected 1, 2, 3 or 4, found 5")
    refused(lambda: relations.QtcB(math.nan), ValueError, "quantisation: expected a finite number, found nan")
    refused(lambda: relations.QtcB(-1.0), ValueError, "quantisation distance: expected a finite number from 0, found -1")
    refused(lambda: relations.Argd({}), ValueError, "expected 1 to 64 thresholds, found 0")
    refused(lambda: relations.Argd({"near": 1.0}, "middle"), ValueError, "bound: expected upper or lower, found 'middle'")
    refused(lambda: qtc.code("towards"), ValueError, "qtcbs: expected one of -,-")


def test_the_page_says_which_calculi_compose():
    page = (pathlib.Path(__file__).parents[2] / "docs/relations.md").read_text()
    header, _, *rows = [line for line in page.split("## Calculi")[1].splitlines() if line.startswith("|")]
    assert [cell.strip() for cell in header.split("|")][4] == "composition"
    named = {}
    for row in rows:
        cells = [cell.strip() for cell in row.split("|")]
        for name in re.findall(r"`(\w+)", cells[1]):
            named[name] = cells[4] == "yes" or f"`{name}`" in cells[4]
    others = {"Calculus", "Inconsistent", "Network", "Series", "Timed"}
    assert named == {name: hasattr(getattr(relations, name), "compose") for name in relations.__all__ if name not in others}


def test_the_code_of_the_page_runs():
    page = pathlib.Path(__file__).parents[2] / "docs/relations.md"
    blocks = page.read_text().split("```python\n")[1:]
    assert len(blocks) >= 5
    names: dict = {}
    for block in blocks:
        exec(block.split("```")[0], names)


def test_forces_between_squares_are_those_of_the_formula():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    for exponent, expected in [(0.0, [1.0, 0.657332395]), (1.0, [0.523248144, 0.346921163]), (2.0, [0.287682072, 0.192450449])]:
        found = forces.histogram(square + [2.0, 0.0], square, exponent=exponent, directions=36)
        assert np.allclose(found[:2], expected, rtol=1e-8), (exponent, found[:2])
    touching = forces.histogram(square + [1.0, 0.0], square, exponent=2.0, directions=36)
    assert np.isinf(touching[0])
    ahead = forces.histogram(square + [3.0, 3.0], square)
    assert forces.assess(ahead, 16)[:1] == (2,) and forces.assess(ahead, 16).grade == "satisfactory"
    assert forces.assess(ahead, 16, heading_rad=math.pi / 2).direction == 14
    degrees = forces.degrees(ahead, np.arange(16) * math.tau / 16)
    assert degrees.argmax() == 2 and degrees[2] == forces.assess(ahead, 16).degree
    width_rad, opening = forces.extent(ahead)
    assert 0.0 < width_rad < math.pi / 2 and abs(width_rad + opening.width_rad - math.tau) < 1e-9
    assert forces.distance(square + [3.0, 0.0], square) == 2.0
    ring = [square * 10.0 - 4.5, square * 4.0 - 1.5]
    assert forces.distance(ring, square) == 1.5 and forces.extent(forces.histogram(ring, square))[1] is None
    assert forces.surround(3.0, 3, 16, can_escape=True) == ("opening", 11)
    refused(lambda: forces.histogram(square[:2], square), ValueError, "argument: ")
    refused(lambda: forces.histogram(square, [square, square[:, :1]]), ValueError, "referent: expected a last axis of 2")
    refused(lambda: forces.histogram(square, square, exponent=17.0), ValueError, "expected")


if __name__ == "__main__":
    for name, test in list(globals().items()):
        if name.startswith("test_"):
            test()
