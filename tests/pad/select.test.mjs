// The selection as values: hits of a tap, moves, turns and sizes, copies, groups, order, points, snapping, gaps, doors, curves.

import assert from "node:assert/strict";
import { test } from "node:test";

import { arc, boxOf, distance, distanceToLine, ellipse, even } from "../../services/pad/page/geometry.js";
import * as steps from "../../services/pad/page/history.js";
import * as items from "../../services/pad/page/items.js";
import * as model from "../../services/pad/page/model.js";
import { Select } from "../../services/pad/page/select.js";
import { makeTools } from "../../services/pad/page/tools.js";
import { closings, snappedEnd, snappedMove, snappedPoint, targets } from "../../services/pad/page/snap.js";
import { handleAt, handles, move, resize, scale, turn, turned } from "../../services/pad/page/transform.js";

/** Pseudorandom numbers that are the same in each run. */
function numbers(seed) {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}

/** A drawing with items of every kind, spread over the sheet. */
function room(random) {
  const place = () => [200 + random() * 2000, 200 + random() * 800];
  let drawing = model.blank(model.LANDSCAPE);
  for (let i = 0; i < 12; i += 1) {
    const [x, y] = place();
    const points = Array.from({ length: 1 + Math.floor(random() * 20) }, (_, k) => [x + k * 9, y + random() * 40]);
    drawing = model.withStroke(drawing, points, 3 + Math.floor(random() * 8), i % 3 ? null : points.map(() => random()));
  }
  for (let i = 0; i < 4; i += 1) {
    const [x, y] = place();
    drawing = model.withObstacle(drawing, [[x, y], [x + 80, y + 10], [x + 60, y + 70]], `table ${i}`);
  }
  drawing = model.withStart(model.withGoal(model.withGoal(drawing, place()), place()), place(), random() * 360 - 180);
  drawing = model.withText(model.withText(drawing, "hall", place()), "living room", place());
  drawing.goals[0] = { name: "kitchen", at: drawing.goals[0].at };
  return items.grouped(drawing, ["strokes:1", "strokes:2", "obstacles:0"]);
}

const far = (a, b) => Math.max(...items.allKeys(a).map((key) => {
  const [p, q] = [items.pointsOf(a, key), items.pointsOf(b, key)];
  assert.equal(p.length, q.length, key);
  return Math.max(...p.map((_, i) => distance(p[i], q[i])));
}));
const close = (a, b, off, words) => assert.ok(distance(a, b) <= off, `${words ?? ""} expected ${b}, found ${a}`);

test("moving there and back changes nothing, down to the bytes of the file", () => {
  for (let seed = 1; seed <= 30; seed += 1) {
    const random = numbers(seed);
    const drawing = room(random);
    const keys = items.allKeys(drawing).filter(() => random() < 0.6);
    const by = model.rounded([random() * 900 - 450, random() * 900 - 450]);
    const there = items.transformed(drawing, keys, move(by));
    const back = items.transformed(there, keys, move([-by[0], -by[1]]));
    assert.equal(model.toText(back), model.toText(drawing));
  }
});

test("a text is taken anywhere in it, and Enter asks for another one", () => {
  const drawing = model.withText(model.blank(model.LANDSCAPE), "the long living room", [500, 300]);
  assert.equal(items.itemAt(drawing, [575, 305], 0, 1), "labels:0");
  assert.equal(items.itemAt(drawing, [600, 305], 0, 1), null);
  assert.equal(items.itemAt(drawing, [500, 320], 0, 1), null);
  assert.equal(items.nameOf(drawing, "labels:0"), "“the long living room”");
  const asked = [];
  const select = new Select({ drawing: () => drawing, over() {}, selected() {}, label: (key) => asked.push(key) });
  select.selection.choose(["labels:0"]);
  assert.equal(select.selection.state.label, true);
  select.close();
  assert.deepEqual([asked, select.selection.edit], [["labels:0"], null]);
});

test("a tap with the text tool writes, or changes the text that is there", () => {
  let drawing = model.blank(model.LANDSCAPE);
  const asked = [];
  const tools = makeTools({
    drawing: () => drawing, sheet: { px: (n) => n }, draft() {}, guides() {},
    label: (key) => asked.push(key), write: (at) => asked.push(at),
  });
  const tap = (at) => {
    tools.text.begin({ at });
    tools.text.end();
  };
  tap([500, 300]);
  drawing = model.withObstacle(model.withText(drawing, "hall", [500, 300]), [[400, 200], [600, 200], [600, 400]]);
  tap([510, 302]);
  tap([590, 220]);
  assert.deepEqual(asked, [[500, 300], "labels:0", [590, 220]]);
});

test("a full turn in steps and a size there and back lead home, and nothing loses points, labels, names or its group", () => {
  for (let seed = 1; seed <= 20; seed += 1) {
    const random = numbers(seed);
    const drawing = room(random);
    const keys = items.allKeys(drawing);
    const middle = [random() * 2540, random() * 1252];
    let round = drawing;
    for (let i = 0; i < 24; i += 1) round = items.transformed(round, keys, turn(middle, 15));
    assert.ok(far(round, drawing) <= 24 * 0.01, `${far(round, drawing)}`);
    assert.ok(Math.abs(round.start.heading_deg - drawing.start.heading_deg) < 0.11, "the start looks where it looked");
    const by = [0.4 + random(), 0.4 + random()];
    const sized = items.transformed(drawing, keys, scale(middle, by));
    assert.ok(far(items.transformed(sized, keys, scale(middle, by.map((s) => 1 / s))), drawing) <= 0.05);
    for (const next of [round, sized]) {
      const facts = (d) => [d.strokes.map((s) => [s.width_px, s.pressure, s.group]), d.obstacles.map((o) => [o.label, o.group]), d.goals.map((g) => g.name), d.labels.map((l) => l.text)];
      assert.deepEqual(facts(next), facts(drawing));
      assert.equal(model.toText(model.fromText(model.toText(next))), model.toText(next));
    }
  }
});

test("a start turns with what is around it", () => {
  const drawing = model.withStart(model.blank(model.LANDSCAPE), [300, 200], 90);
  const quarter = items.transformed(drawing, ["start:0"], turn([200, 200], 90));
  assert.deepEqual(quarter.start, { at: [200, 300], heading_deg: 0 }, "clockwise as seen, a heading is counter-clockwise");
});

test("a tap hits what was drawn, at every zoom, and nothing beside it", () => {
  for (const px of [0.125, 0.5, 1, 2, 8, 20]) {
    const random = numbers(11);
    for (let i = 0; i < 200; i += 1) {
      const a = [random() * 2540, random() * 1252];
      const b = [a[0] + 300 + random() * 400, a[1] + random() * 400];
      const drawing = model.withStroke(model.blank(model.LANDSCAPE), [a, b], 5);
      const t = random();
      const on = [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t];
      const [nx, ny] = [-(b[1] - a[1]) / distance(a, b), (b[0] - a[0]) / distance(a, b)];
      const beside = (off) => [on[0] + nx * off, on[1] + ny * off];
      assert.equal(items.itemAt(drawing, on, 10 * px, px), "strokes:0");
      assert.equal(items.itemAt(drawing, beside(2.4 + 10 * px), 10 * px, px), "strokes:0");
      assert.equal(items.itemAt(drawing, beside(2.6 + 10 * px), 10 * px, px), null);
    }
  }
});

test("the topmost is hit, or else the nearest", () => {
  let drawing = model.withObstacle(model.blank(model.LANDSCAPE), [[100, 100], [300, 100], [300, 300], [100, 300]]);
  drawing = model.withStroke(model.withStroke(drawing, [[150, 200], [600, 200]], 5), [[400, 190], [400, 260]], 5);
  drawing = model.withStart(model.withGoal(drawing, [200, 200]), [500, 500], 0);
  const hit = (x, y) => items.itemAt(drawing, [x, y], 10, 1);
  assert.deepEqual([hit(200, 200), hit(250, 200), hit(350, 204), hit(404, 230), hit(530, 500), hit(900, 900)], ["goals:0", "obstacles:0", "strokes:0", "strokes:1", "start:0", null]);
  const route = model.withRoute(drawing, [[0, 700], [900, 700]]);
  assert.equal(items.itemAt(route, [450, 705], 10, 1), "route:0");
});

test("a marquee takes what it holds whole", () => {
  let drawing = model.withStroke(model.blank(model.LANDSCAPE), [[100, 100], [200, 200]], 5);
  drawing = model.withGoal(model.withStroke(drawing, [[150, 150], [900, 150]], 5), [180, 120]);
  assert.deepEqual(items.keysWithin(drawing, [50, 50, 300, 300]), ["strokes:0", "goals:0"]);
});

test("what a handle does: its side follows the hand, the opposite one stays", () => {
  const box = [100, 100, 300, 200];
  const sized = (...a) => resize(box, ...a);
  close(sized("se", [50, 20]).map([300, 200]), [350, 220], 1e-9);
  close(sized("se", [50, 20]).map([100, 100]), [100, 100], 1e-9);
  close(sized("nw", [50, 20]).map([100, 100]), [150, 120], 1e-9);
  close(sized("e", [50, 99]).map([300, 200]), [350, 200], 1e-9);
  close(sized("se", [200, 0], { even: true }).map([300, 200]), [500, 300], 1e-9);
  close(sized("se", [50, 20], { middle: true }).map([100, 100]), [50, 80], 1e-9);
  close(sized("se", [-900, 0]).map([300, 200]), [101, 200], 1e-9, "never through itself");
  close(resize([100, 100, 300, 100], "se", [50, 50]).map([300, 100]), [350, 100], 1e-9, "a level line stays one");
  assert.equal(turned([0, 0], [10, 0], [1, 9], true), 90);
  assert.deepEqual(Object.keys(handles([0, 0, 10, 10], 1)), ["se", "turn"], "a small thing stays in reach of the hand");
  assert.equal(Object.keys(handles(box, 1)).length, 9);
  for (const side of [0, 4, 20, 60, 500]) {
    const small = [100, 100, 100 + side, 100 + side];
    const places = handles(small, 1);
    assert.equal(handleAt(places, [100 + side / 2, 100 + side / 2], 20, small, 1), null, "a finger in the middle moves, however small it is");
    for (const [name, place] of Object.entries(places)) assert.equal(handleAt(places, place, 20, small, 1), name);
  }
});

test("copies are new items: a group of their own, a goal without the name; there is one start", () => {
  const drawing = room(numbers(4));
  const { drawing: next, keys } = items.duplicated(drawing, ["strokes:1", "obstacles:0", "goals:0", "start:0"], [20, 20]);
  assert.deepEqual(keys, ["strokes:12", "obstacles:4", "goals:2"]);
  assert.equal(next.obstacles[4].label, drawing.obstacles[0].label);
  assert.deepEqual([next.goals[0].name, next.goals[2].name], ["kitchen", undefined]);
  assert.ok(next.strokes[12].group === next.obstacles[4].group && next.strokes[12].group !== drawing.strokes[1].group);
  assert.equal(next.start, drawing.start);
  assert.deepEqual(items.withGroups(next, ["strokes:12"]), ["strokes:12", "obstacles:4"]);
  assert.equal(items.duplicated(drawing, ["start:0"], [1, 1]).drawing, drawing);
});

test("groups are kept in the file and sent with the map, and an item of a group is still what it was", () => {
  const drawing = room(numbers(2));
  const again = model.fromText(model.toText(drawing));
  assert.deepEqual(items.withGroups(again, ["obstacles:0"]), ["strokes:1", "strokes:2", "obstacles:0"]);
  const body = JSON.parse(model.sketchBody(drawing));
  assert.deepEqual(body.pad.groups, [{ strokes: [1, 2], obstacles: [0] }]);
  assert.ok([...body.strokes, ...body.obstacles].every((item) => !("group" in item)), "a navigator reads no groups");
  assert.equal(items.withGroups(items.ungrouped(drawing, ["strokes:1", "strokes:2", "obstacles:0"]), ["strokes:1"]).length, 1);
  const kept = model.withoutMapAt(again, again.obstacles[0].polygon[0], 1);
  assert.deepEqual(model.fromText(model.toText(kept)).strokes.filter((s) => s.group).length, kept.strokes.filter((s) => s.group).length);
  assert.throws(() => model.fromText('{"canvas":[5,5],"strokes":[],"pad":{"groups":[{"strokes":[0]}]}}'), /pad.groups\[0\].strokes: expected numbers below 0, found 0/);
});

test("items are aligned and spread, a group as one", () => {
  const box = (x, y, side) => [[x, y], [x + side, y], [x + side, y + side], [x, y + side]];
  let drawing = model.blank(model.LANDSCAPE);
  for (const [x, y, side] of [[100, 100, 50], [200, 300, 80], [700, 250, 40], [740, 200, 60]]) drawing = model.withObstacle(drawing, box(x, y, side));
  drawing = items.grouped(drawing, ["obstacles:2", "obstacles:3"]);
  const keys = items.allKeys(drawing);
  const boxes = (d) => keys.map((key) => boxOf(items.pointsOf(d, key)));
  const left = boxes(items.aligned(drawing, keys, "left"));
  assert.deepEqual(left.map(([x]) => x), [100, 100, 100, 140], "the group keeps its form");
  assert.deepEqual(boxes(items.aligned(drawing, keys, "bottom")).map((b) => b[3]), [380, 380, 380, 350]);
  const spread = boxes(items.distributed(drawing, keys, 0));
  assert.equal(spread[1][0] - spread[0][2], spread[2][0] - spread[1][2], "equal gaps");
  assert.deepEqual([spread[0][0], spread[3][2]], [100, 800], "the first and the last stay");
});

test("points are moved, added and removed one by one, with their pressure, and never too few are left", () => {
  let drawing = model.withStroke(model.blank(model.LANDSCAPE), [[0, 0], [100, 0], [200, 0]], 5, [0.2, 0.4, 0.8]);
  drawing = model.withObstacle(drawing, [[300, 300], [400, 300], [350, 400]], "stool");
  const more = items.withPointMore(drawing, "strokes:0", 2, [150, 10]);
  assert.deepEqual(more.strokes[0], { points: [[0, 0], [100, 0], [150, 10], [200, 0]], width_px: 5, pressure: [0.2, 0.4, 0.6, 0.8] });
  assert.deepEqual(items.withPointLess(more, "strokes:0", 2), drawing);
  assert.deepEqual(items.withPointAt(drawing, "obstacles:0", 2, [350, 420]).obstacles[0], { polygon: [[300, 300], [400, 300], [350, 420]], label: "stool" });
  assert.equal(items.withPointLess(drawing, "obstacles:0", 1).obstacles.length, 0, "two corners are no obstacle");
  assert.equal(items.placeAt(drawing, "strokes:0", [140, 3], 5), 2);
  assert.equal(items.placeAt(drawing, "obstacles:0", [325, 352], 5), 3, "on the side that closes it");
  assert.equal(items.pointAt(drawing, "strokes:0", [97, 2], 10), 1);
  assert.equal(items.withPointLess(model.withRoute(drawing, [[1, 1], [2, 2]]), "route:0", 0).route, null);
});

test("a line by hand keeps its form with fewer points", () => {
  const points = Array.from({ length: 200 }, (_, i) => [i * 4, i < 100 ? Math.sin(i * 9) : (i - 100) * 3]);
  const drawing = model.withStroke(model.blank(model.LANDSCAPE), points, 5, points.map(() => 0.5));
  const [{ points: fewer, pressure }] = items.simplified(drawing, ["strokes:0"]).strokes;
  assert.ok(fewer.length < 10 && pressure.length === fewer.length, `${fewer.length}`);
  assert.ok(drawing.strokes[0].points.every((p) => distanceToLine(p, fewer) <= 2.5 + 1e-9));
});

// ---------------------------------------------------------------------------- the hand

/** A hand with the select tool, at a desk without a screen. One pixel of the screen is `px` pixels of the sheet. */
class Hand {
  constructor(drawing, px = 1) {
    this.history = steps.history(drawing);
    this.shown = drawing;
    this.time = 0;
    const change = (next) => {
      this.tool.selection.follow(this.history.now, next);
      this.history = steps.changed(this.history, next);
      this.shown = next;
    };
    this.tool = new Select({
      sheet: { px: (n) => n * px }, drawing: () => this.history.now, shown: () => this.shown, change, preview: (next) => { this.shown = next; },
      over() {}, selected() {}, say() {}, label() {}, settings: () => ({ snap: true }),
    });
  }

  get now() {
    return this.history.now;
  }

  drag(places, more = {}) {
    const samples = places.map((at) => ({ at, time: (this.time += 1000), ...more }));
    this.tool.begin(samples[0]);
    for (const sample of samples.slice(1)) this.tool.extend([sample]);
    this.tool.overlay();
    this.tool.end();
  }

  undo() {
    const before = this.now;
    this.history = steps.undone(this.history);
    this.tool.selection.follow(before, this.now);
  }
}

test("whatever a hand does, no step loses a label, a name or a pressure, the file stays readable, and undone it is what it was", () => {
  for (let seed = 1; seed <= 40; seed += 1) {
    const random = numbers(seed * 77);
    const drawing = room(random);
    const hand = new Hand(drawing, 0.5 + random() * 3);
    const { selection } = hand.tool;
    const pick = (list) => list[Math.floor(random() * list.length)];
    const place = () => (random() < 0.7 ? pick(items.pointsOf(hand.now, pick(items.allKeys(hand.now)))) : [random() * 2540, random() * 1252]);
    const keys = [
      () => selection.selectAll(), () => selection.step(1), () => selection.step(-1), () => selection.editPoints(), () => selection.insert(),
      () => selection.duplicate(), () => selection.group(), () => selection.ungroup(), () => selection.align(pick(Object.keys(items.SIDES))),
      () => selection.distribute(pick([0, 1])), () => selection.closeGaps(), () => selection.simplify(), () => selection.nudge([1, 0], 3),
      () => selection.turn(15), () => selection.stretch([0, 1], 5), () => selection.copy(), () => selection.paste(), () => hand.tool.escape(),
      () => hand.undo(),
    ];
    for (let i = 0; i < 60; i += 1) {
      const modifiers = { shift: random() < 0.3, alt: random() < 0.2, ctrl: random() < 0.3, touch: random() < 0.5 };
      if (random() < 0.5) pick(keys)();
      else hand.drag(Array.from({ length: 1 + Math.floor(random() * 4) }, place), modifiers);
      const { now } = hand;
      if (now.obstacles.length > 40 || now.strokes.length > 80) break;
      assert.ok(selection.keys.every((key) => items.itemOf(now, key)), "what is selected is there");
      assert.equal(model.toText(model.fromText(model.toText(now))), model.toText(now));
      assert.ok(now.obstacles.length >= 4 && now.obstacles.every((o) => /^table \d$/.test(o.label) && o.polygon.length >= 3));
      assert.ok(now.strokes.every((s) => s.pressure === null || s.pressure.length === s.points.length));
      assert.equal(now.goals[0].name, "kitchen");
    }
    while (hand.history.past.length) hand.undo();
    assert.equal(model.toText(hand.now), model.toText(drawing));
  }
});

test("a drag that is taken back leaves drawing and selection as they were", () => {
  const hand = new Hand(room(numbers(3)));
  const { tool, now } = hand;
  tool.selection.choose(["goals:1"]);
  tool.begin({ at: now.obstacles[1].polygon[0], time: 1 });
  tool.extend([{ at: [10, 10], time: 2, alt: true }]);
  assert.notEqual(hand.shown, now);
  tool.escape();
  assert.equal(hand.shown, now);
  assert.deepEqual([hand.now, tool.selection.keys], [now, ["goals:1"]]);
  tool.end();
  assert.equal(hand.now, now);
});

test("a double tap on an item of a group selects it alone, and another edits its points", () => {
  const hand = new Hand(room(numbers(8)));
  const [x, y] = hand.now.obstacles[0].polygon[0];
  const tap = (time) => {
    hand.tool.begin({ at: [x + 30, y + 15], time });
    hand.tool.end();
    return hand.tool.selection;
  };
  assert.deepEqual(tap(0).keys, ["strokes:1", "strokes:2", "obstacles:0"]);
  assert.deepEqual(tap(200).keys, ["obstacles:0"]);
  assert.deepEqual(tap(400).edit, { key: "obstacles:0", index: 0 });
});

// ---------------------------------------------------------------------------- snapping, gaps, doors

const walls = (...lines) => lines.reduce((drawing, points) => model.withStroke(drawing, points, 5), model.blank(model.LANDSCAPE));

test("the end of a line snaps to ends, walls, directions, and to be level with a corner", () => {
  const around = targets(walls([[100, 100], [500, 100]], [[500, 100], [500, 400]]));
  assert.deepEqual(snappedPoint([104, 95], around, 10).at, [100, 100]);
  close(snappedPoint([300, 104], around, 10).at, [300, 100], 1e-9);
  assert.deepEqual(snappedPoint([300, 150], around, 10), { at: [300, 150], guides: [] });
  const end = (from, to, steps) => snappedEnd(from, to, around, 10, steps).at;
  close(end([100, 100], [103, 330]), [100, 330], 1e-9, "upright");
  close(end([100, 100], [103, 397]), [100, 400], 1e-9, "upright, and level with the corner:");
  close(end([200, 300], [495, 302]), [500, 300], 1e-9, "level, to the wall that it meets:");
  close(end([200, 300], [497, 396]), [500, 400], 1e-9, "an end");
  close(end([200, 300], [300, 398]), [299, 399], 1e-9, "45°");
  assert.deepEqual(end([200, 300], [300, 360]), [300, 360]);
  const [x, y] = end([200, 300], [300, 360], true);
  assert.ok(Math.abs(Math.atan2(y - 300, x - 200) - Math.PI / 6) < 1e-9, "with Shift, 30°");
});

test("a line that begins at a wall snaps to go along and across it", () => {
  const around = targets(walls([[100, 100], [400, 200]]));
  const { at } = snappedEnd([400, 200], [335, 404], around, 10);
  assert.ok(Math.abs((at[0] - 400) * 300 + (at[1] - 200) * 100) < 1e-6, `${at} is across`);
});

test("what is moved snaps by its ends, or else beside what stands there", () => {
  const drawing = walls([[100, 100], [300, 100]], [[500, 140], [700, 140]]);
  const [own, others] = [targets(drawing, { only: ["strokes:1"] }), targets(drawing, { except: ["strokes:1"] })];
  assert.deepEqual(snappedMove(own, [-196, -37], others, 10).by, [-200, -40]);
  const beside = snappedMove(own, [100, -37], others, 10);
  assert.deepEqual(beside.by, [100, -40]);
  assert.deepEqual(beside.guides, [{ line: [[100, 100], [800, 100]] }]);
  assert.deepEqual(snappedMove(own, [100, 300], others, 10), { by: [100, 300], guides: [] });
});

test("gaps close: corners where the walls cross, walls in line halfway, an end at a wall on it; what was not chosen stays", () => {
  const drawing = walls([[0, 0], [200, 0]], [[210, 10], [210, 200]], [[0, 90], [90, 90]], [[110, 90], [190, 90]]);
  const after = (keys) => closings(drawing, keys).reduce((next, { key, index, at }) => items.withPointAt(next, key, index, at), drawing);
  const keys = items.allKeys(drawing);
  const closed = after(keys);
  assert.deepEqual(closed.strokes.map((s) => s.points), [[[0, 0], [210, 0]], [[210, 0], [210, 200]], [[0, 90], [100, 90]], [[100, 90], [210, 90]]]);
  assert.deepEqual(closings(closed, keys), [], "closed once is closed");
  const one = after(["strokes:0"]);
  assert.deepEqual(one.strokes[0].points[1], [210, 10]);
  assert.deepEqual(one.strokes.slice(1), drawing.strokes.slice(1));
});

test("a closed wall stays one when gaps are closed at any place", () => {
  const random = numbers(9);
  for (let i = 0; i < 100; i += 1) {
    const jog = () => (random() - 0.5) * 16;
    const corners = [[100, 100], [600, 100], [600, 500], [100, 500]];
    const drawing = walls(...corners.map((a, k) => [a, corners[(k + 1) % 4]].map(([x, y]) => [x + jog(), y + jog()])));
    const keys = items.allKeys(drawing);
    const closed = closings(drawing, keys).reduce((next, { key, index, at }) => items.withPointAt(next, key, index, at), drawing);
    const ends = closed.strokes.flatMap((s) => s.points);
    assert.ok(ends.every((p, a) => ends.some((q, b) => a !== b && distance(p, q) < 0.02)), "every end meets another");
    assert.equal(closings(closed, keys).length, 0);
  }
});

test("a door opens the wall along it and leaves a wall that crosses", () => {
  const drawing = walls([[0, 100], [300, 100], [600, 100]], [[350, 0], [350, 200]]);
  const next = model.withDoor(drawing, [200, 102], [400, 98], 14);
  assert.deepEqual(next.strokes.map((s) => s.points.map(([x, y]) => [Math.round(x), y])), [[[0, 100], [200, 100]], [[400, 100], [600, 100]], [[350, 0], [350, 200]]]);
  assert.equal(model.withDoor(drawing, [200, 300], [400, 300], 14), drawing);
  assert.equal(model.withDoor(drawing, [200, 100], [200, 100], 14), drawing);
});

test("a door in a wall by hand is as wide as the drag, wherever it is", () => {
  const random = numbers(5);
  for (let i = 0; i < 100; i += 1) {
    const points = Array.from({ length: 60 }, (_, k) => [k * 10, 200 + (random() - 0.5) * 6]);
    const [a, b] = [[100 + random() * 150, 200], [350 + random() * 150, 200]];
    const drawing = model.withStroke(model.blank(model.LANDSCAPE), points, 5, points.map(() => random()));
    const [left, right, ...more] = model.withDoor(drawing, b, a, 14).strokes;
    assert.equal(more.length, 0);
    assert.ok(Math.abs(left.points.at(-1)[0] - a[0]) < 0.01 && Math.abs(right.points[0][0] - b[0]) < 0.01);
    assert.ok([left, right].every((s) => s.pressure.length === s.points.length));
  }
});

test("an ellipse fills its box, and an arc goes through its three points on a circle", () => {
  const box = boxOf(ellipse([100, 100], [300, 180]));
  assert.ok(box.every((v, i) => Math.abs(v - [100, 100, 300, 180][i]) < 1.5), `${box}`);
  assert.deepEqual(even([10, 10], [40, 0]), [40, -20]);
  const random = numbers(6);
  for (let i = 0; i < 200; i += 1) {
    const [a, b, via] = Array.from({ length: 3 }, () => [random() * 500, random() * 500]);
    const points = arc(a, b, via);
    assert.deepEqual([points[0], points.at(-1)], [a, b]);
    if (points.length === 2) continue;
    const steps = points.slice(1).map((p, k) => distance(p, points[k]));
    assert.ok(distanceToLine(via, points) <= Math.max(...steps) / 2, "through the third");
    assert.ok(Math.max(...steps) - Math.min(...steps) < 1e-6, "in equal steps");
  }
  assert.equal(arc([0, 0], [100, 0], [50, 0.1]).length, 2);
});
