"""Tests of QSRlib's interface. `tests/tools/relations.rs` runs them with the wheel. If QSRlib itself is installed (`import
qsrlib`), both must return the same results for random requests. QSRlib's own test data is covered by
`services/libraries/qualitative/tests/conformance.rs`."""

import importlib
import itertools
import random
import sys

from sketchnav.relations import qsrlib as ours
from sketchnav.relations.qsrlib import qstag
from test_relations import refused

CALCULI = ["cardir", "mos", "mwe", "qtcbcs", "qtcbs", "qtccs", "ra", "rcc2", "rcc3", "rcc4", "rcc5", "rcc8", "argd", "tpcc"]
LABELS = {"touch": 0.5, "near": 2.0, "far": 5.5}


def meeting(module=ours):
    """A person walks to a chair and stops there, next to a desk."""
    world = module.World_Trace()
    world.add_object_track_from_list([(0, 0), (1, 0), (2, 0), (2, 0), (2, 1)], "person", object_type="Human")
    world.add_object_track_from_list([(3, 0, 1, 1)] * 5, "chair")
    world.add_object_track_from_list([(3, 2, 2, 1)] * 5, "desk")
    return world


def answer(which, world, arguments=None):
    qsrs = ours.QSRlib().request_qsrs(ours.QSRlib_Request_Message(which, world, arguments or {})).qsrs
    return {time: {between: qsr.qsr for between, qsr in qsrs.trace[time].qsrs.items()} for time in qsrs.get_sorted_timestamps()}


def test_a_request_is_answered_for_each_time_and_each_pair():
    found = answer("rcc8", meeting(), {"rcc8": {"qsrs_for": [("person", "chair"), ("chair", "desk")]}})
    assert list(found) == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert found[0.0] == {"person,chair": {"rcc8": "dc"}, "chair,desk": {"rcc8": "dc"}}
    assert len(answer("cardir", meeting())[0.0]) == 6 and len(answer("tpcc", meeting())[0.0]) == 6
    several = answer(["mos", "cardir"], meeting(), {"for_all_qsrs": {"qsrs_for": ["person", ("person", "desk")]}})
    assert several[0.0] == {"person,desk": {"cardir": "sw"}}
    assert several[1.0] == {"person": {"mos": "m"}, "person,desk": {"cardir": "sw"}}
    both = answer(["mwe", "qtcbs"], meeting(), {"mwe": {"qsrs_for": [("person", "chair")]}, "for_all_qsrs": {"qsrs_for": []}})
    assert both[1.0] == {"person,chair": {"mwe": "left"}}


def test_qtc_is_collapsed_and_validated_as_asked():
    only = {"qsrs_for": [("person", "chair")]}
    words = lambda **more: [next(iter(q.values()))["qtcbs"] for q in answer("qtcbs", meeting(), {"qtcbs": only | more}).values()]
    assert words() == ["-,0", "0,0"]
    assert words(no_collapse=True) == ["-,0", "-,0", "0,0", "0,0"]
    assert words(quantisation_factor=2.0) == ["0,0"]
    plain = answer("qtcbs", meeting(), {"qtcbs": only | {"no_collapse": True, "validate": False}})
    assert list(plain) == [1.0, 2.0, 3.0, 4.0]
    assert list(answer("qtcbs", meeting(), {"qtcs": {"no_collapse": True}, "qtcbs": only})) == [1, 2, 3, 4]
    near = answer("qtcbcs", meeting(), {"qtcbcs": only})
    assert [q["person,chair"]["qtcbcs"] for q in near.values()][0] == "-,0"


def test_objects_may_be_missing():
    world = meeting()
    del world.trace[2.0].objects["chair"]
    assert [time for time, q in answer("rcc8", world).items() if "person,chair" in q] == [0.0, 1.0, 3.0, 4.0]
    assert [time for time, q in answer("mos", world).items() if "chair" in q] == [1.0, 4.0]
    refused(lambda: answer("qtcbs", world), KeyError, "chair: expected at all times, found missing at 2.0")
    plain = answer("qtcbs", world, {"qtcbs": {"no_collapse": True, "validate": False}})
    assert [time for time, q in plain.items() if "person,chair" in q] == [1.0, 4.0]


def test_distances_count_z_where_both_have_it():
    world = ours.World_Trace()
    world.add_object_track_from_list([(0, 0, 0)], "a")
    world.add_object_track_from_list([(0, 0, 5)], "b")
    world.add_object_track_from_list([(0, 0)], "c")
    found = answer("argd", world, {"argd": {"qsr_relations_and_values": LABELS}})[0.0]
    assert found["a,b"] == {"argd": "far"} and found["a,c"] == {"argd": "touch"}


def test_errors_say_what_was_expected():
    refused(lambda: answer("rcc9", meeting()), KeyError, "which_qsr: expected one of argd cardir mos")
    refused(lambda: answer("argprobd", meeting()), KeyError, "argprobd draws random numbers")
    refused(lambda: answer("argd", meeting()), KeyError, "argd.qsr_relations_and_values: expected thresholds by their labels")
    refused(lambda: answer("qtcbs", meeting(), {"qtcbs": {"validat": True}}), KeyError, "qtcbs.validat: expected one of")
    refused(lambda: answer("qtcbs", meeting(), {"qtcbs": {"validate": 1}}), TypeError, "qtcbs.validate: expected True or False")
    refused(lambda: answer("rcc8", meeting(), {"rcc8": {"qsrs_for": "a"}}), TypeError, "rcc8.qsrs_for: expected a list or a tuple")
    refused(lambda: ours.Object_State("a", 0, xsize=-1.0), ValueError, "a.xsize: expected a size from 0, found -1.0")
    refused(lambda: ours.QSRlib_Request_Message("rcc8", {}), TypeError, "input_data: expected a World_Trace, found dict")
    world = meeting()
    world.trace[3.0].objects["chair"].x = float("inf")
    refused(lambda: answer("rcc8", world), ValueError, "chair[3]: x: expected a number within ±1e150, found inf")


def test_traces_are_cut_by_times_objects_and_calculi():
    world = meeting()
    assert world.get_at_timestamp_range(1.0, 3.0).get_sorted_timestamps() == [1.0, 2.0, 3.0]
    assert world.get_at_timestamp_range(1.0, 3.0, include_finish=False, istep=2).get_sorted_timestamps() == [1.0]
    assert set(world.get_for_objects(["desk"]).get_last_state().objects) == {"desk"}
    request = ours.QSRlib_Request_Message(["mwe", "cardir"], world)
    qsrs = ours.QSRlib().request_qsrs(request).qsrs
    assert qsrs.qsr_type == "mwe,cardir"
    assert qsrs.get_for_qsrs(["mwe"]).trace[0.0].qsrs["desk,chair"].qsr == {"mwe": "together"}
    assert list(qsrs.get_for_objects(["desk,chair"]).trace[0.0].qsrs) == ["desk,chair"]
    refused(lambda: world.get_at_timestamp_range(0.5), ValueError, "start: expected one of the times, found 0.5")


def test_episodes_become_a_graph_and_graphlets():
    arguments = {
        "mwe": {"qsrs_for": [("person", "chair")]},
        "qstag": {"object_types": {"chair": "Chair"}, "params": {"min_rows": 1, "max_rows": 1, "max_eps": 3}},
        "rcc2": {"qsrs_for": [("person", "chair")]},
    }
    world = meeting()
    world.trace[3.0].objects["person"].x = 4
    world.trace[4.0].objects["person"].x = 3
    response = ours.QSRlib().request_qsrs(ours.QSRlib_Request_Message(["mwe", "rcc2"], world, arguments))
    graph = response.qstag
    assert [(e.objects, e.relations["mwe"], e.times) for e in graph.episodes] == [
        (["person", "chair"], "left", (0.0, 2.0)),
        (["person", "chair"], "right", (3.0, 3.0)),
        (["person", "chair"], "together", (4.0, 4.0)),
    ]
    assert [node.obj_type for node in graph.object_nodes] == ["Human", "Chair"]
    assert [node["name"] for node in graph.temporal_nodes] == ["m", "<", "m"]
    # Three single episodes, two pairs, and all three together.
    assert sorted(graph.graphlets.histogram) == [1] * 6 and len(graph.histogram) == 6
    assert graph.graph.dot().count("->") == 3 * 2 + 3 * 2
    refused(lambda: qstag.Activity_Graph(world, response.qsrs), ValueError, "qstag.params: expected max_eps")


def test_the_code_of_a_graphlet_is_the_same_everywhere():
    graph = qstag.get_graph([qstag.Episode(["a", "b"], {"rcc2": "dc"}, (0.0, 2.0)), qstag.Episode(["a", "b"], {"rcc2": "c"}, (3.0, 4.0))])
    turned = qstag.get_graph(list(reversed([qstag.Episode(["a", "b"], {"rcc2": "dc"}, (0.0, 2.0)), qstag.Episode(["a", "b"], {"rcc2": "c"}, (3.0, 4.0))])))
    assert graph.code() == turned.code() and len(graph.nodes) == 5


def test_a_median_filter_removes_what_lasts_shortly():
    from sketchnav.relations.qsrlib.library import median_filter

    assert median_filter(list("aaabaaaccc"), 2) == list("aaaaaaaccc")
    assert median_filter(list("abc"), 2) == list("abc")


def wander(module, seed):
    chance = random.Random(seed)
    world = module.World_Trace()
    for name in ("o1", "o2", "o3"):
        x, y = chance.randint(-4, 4), chance.randint(-4, 4)
        track = []
        for _ in range(30):
            x, y = x + chance.randint(-1, 1), y + chance.randint(-1, 1)
            track.append((x, y, chance.randint(1, 3), chance.randint(1, 3)))
        world.add_object_track_from_list(track, name, t0=1)
    return world


def test_qsrlib_itself_answers_alike():
    try:
        theirs = importlib.import_module("qsrlib.qsrlib")
        worlds = importlib.import_module("qsrlib_io.world_trace")
    except ImportError as missing:
        print(f"skipped: no QSRlib ({missing})", file=sys.stderr)
        return
    compared = 0
    forms = [{}, {"validate": False}, {"no_collapse": True}, {"validate": False, "no_collapse": True}]
    for seed, which, form in itertools.product(range(20), CALCULI, forms):
        # QSRlib fails on points straight ahead.
        if which == "tpcc" or (form and not which.startswith("qtc")):
            continue
        arguments = {"argd": {"qsr_relations_and_values": LABELS}, "qtcs": form}
        request = theirs.QSRlib_Request_Message(which, wander(worlds, seed), arguments)
        qsrs = theirs.QSRlib().request_qsrs(request).qsrs
        expected = {time: {between: q.qsr for between, q in state.qsrs.items()} for time, state in qsrs.trace.items()}
        assert answer(which, wander(ours, seed), arguments) == expected, (seed, which, form)
        compared += sum(len(state) for state in expected.values())
    print(f"compared {compared} relations with QSRlib")


if __name__ == "__main__":
    for name, test in list(globals().items()):
        if name.startswith("test_"):
            test()
