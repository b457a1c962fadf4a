// Tests of the drawing as a value: history, eraser, file. Run with `node --test`.

import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { test } from "node:test";

import { erased, inside, meantStraight, squared, roomAt } from "../../services/pad/page/geometry.js";
import * as steps from "../../services/pad/page/history.js";
import * as model from "../../services/pad/page/model.js";

const sheet = () => model.blank(model.LANDSCAPE);
const missions = new URL("../../sim/missions/", import.meta.url);

/** Pseudorandom numbers that are the same in each run. */
function numbers(seed) {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}

function scribble(random) {
  let drawing = sheet();
  for (let i = 0; i < 40; i += 1) {
    const points = Array.from({ length: 1 + Math.floor(random() * 30) }, () => [random() * 2540, random() * 1252]);
    drawing = model.withStroke(drawing, points, 5, i % 2 ? points.map(() => random()) : null);
  }
  drawing = model.withObstacle(drawing, [[10, 10], [50.125, 10], [30, 40]], "a \"small\" table");
  drawing = model.withText(model.withText(drawing, "living room", [700.125, 400]), "“hall”", [random() * 2540, 200]);
  return model.withStart(model.withGoal(drawing, [random() * 2540, 400]), [200, 300], 87.25);
}

test("what was saved and loaded is saved again as the same bytes", () => {
  for (let seed = 1; seed <= 20; seed += 1) {
    const text = model.toText(scribble(numbers(seed)));
    assert.equal(model.toText(model.fromText(text)), text);
  }
  const pictures = { ...sheet(), underlay: "data:image/jpeg;base64,AAAA", photo: "data:image/png;base64,BBBB" };
  assert.equal(model.toText(model.fromText(model.toText(pictures))), model.toText(pictures));
});

test("texts are written, changed, erased, and sent with the map", () => {
  const drawing = model.withText(model.withText(sheet(), "kitchen", [100, 100]), "hall", [500, 100]);
  assert.deepEqual(JSON.parse(model.sketchBody(drawing)).labels, [{ text: "kitchen", at: [100, 100] }, { text: "hall", at: [500, 100] }]);
  assert.equal("labels" in JSON.parse(model.sketchBody(sheet())), false);
  assert.deepEqual(model.withOtherText(drawing, 1, "bath").labels.map((l) => l.text), ["kitchen", "bath"]);
  assert.deepEqual(model.withOtherText(drawing, 0, "").labels.map((l) => l.text), ["hall"]);
  assert.deepEqual([model.touched(drawing, [105, 100], 14), model.touched(drawing, [300, 100], 14)], ["map", null]);
  assert.deepEqual(model.withoutMapAt(drawing, [105, 100], 14).labels.map((l) => l.text), ["hall"]);
  assert.deepEqual([model.isBlank(sheet()), model.isBlank(drawing), model.hasMap(drawing)], [true, false, false]);
});

test("the drawings that ship are read, and lose nothing on the way", () => {
  const folders = ["building", "laboratory", "routes"].map((name) => new URL(`${name}/`, missions));
  const files = folders.flatMap((f) => readdirSync(f).filter((n) => n.endsWith(".json")).map((n) => new URL(n, f)));
  assert.ok(files.length > 20);
  for (const file of files) {
    const shipped = JSON.parse(readFileSync(file, "utf8"));
    const again = JSON.parse(model.toText(model.fromText(readFileSync(file, "utf8"))));
    assert.deepEqual(again.strokes, shipped.strokes);
    assert.deepEqual(again.obstacles, shipped.obstacles ?? []);
    assert.deepEqual(again.canvas, shipped.canvas);
  }
});

test("a file that is no drawing is refused with what is wrong and where", () => {
  const refused = (text, words) => assert.throws(() => model.fromText(text), (error) => error.message.includes(words));
  refused("{", "expected a drawing in JSON");
  refused("[]", "the drawing: expected an object");
  refused('{"canvas":[0,5],"strokes":[]}', "canvas: expected two sides of 1 to 30000 px, found [0,5]");
  refused('{"canvas":[5,5],"strokes":[{"points":[[1,2],[3,null]]}]}', "strokes[0].points[1]: expected a point");
  refused('{"canvas":[5,5],"strokes":[],"labels":[{"text":" ","at":[1,1]}]}', 'labels[0].text: expected a text, found " "');
  refused('{"canvas":[5,5],"strokes":[],"labels":[{"text":"hall"}]}', "labels[0].at: expected a point, found nothing");
  refused('{"canvas":[5,5],"strokes":[{"points":[[1,1]],"width_px":0}]}', "strokes[0].width_px: expected above 0");
  refused('{"canvas":[5,5],"strokes":[],"obstacles":[{"polygon":[[1,1],[2,2]]}]}', "obstacles[0].polygon: expected 3 points or more, found 2");
  refused('{"canvas":[5,5],"strokes":[{"points":[[1,1]]}],"pad":{"pressure":[[2]]}}', "strokes[0]: pad.pressure");
  const long = JSON.stringify("é".repeat(401));
  refused(`{"canvas":[5,5],"strokes":[],"labels":[{"text":${long},"at":[1,1]}]}`, "labels[0].text: expected at most 400 characters, found 401");
  refused(`{"canvas":[5,5],"strokes":[],"goals":[{"name":${long},"at":[1,1]}]}`, "goals[0].name: expected at most 400 characters, found 401");
  refused(`{"canvas":[5,5],"strokes":[],"obstacles":[{"polygon":[[1,1],[2,2],[3,1]],"label":${long}}]}`, "obstacles[0].label: expected at most 400");
  refused('{"canvas":[5,5],"strokes":[],"colour":1}', 'found "colour"');
  refused('{"canvas":[5,5],"strokes":[],"pad":{"underlay":"http://elsewhere"}}', "pad.underlay: expected a PNG or JPEG");
});

test("a heading beyond a full turn is read as the same direction", () => {
  const read = (heading_deg) => model.fromText(JSON.stringify({ canvas: [5, 5], strokes: [], start: { at: [1, 1], heading_deg } })).start.heading_deg;
  assert.deepEqual([90, 360, -360, 450, -725].map(read), [90, 360, -360, 90, -5]);
});

test("every step is undone and done again to the very same value", () => {
  const random = numbers(7);
  let history = steps.history(sheet());
  const states = [history.now];
  for (let i = 0; i < 60; i += 1) {
    const place = [random() * 2540, random() * 1252];
    const next = i % 3 === 0 ? model.withGoal(history.now, place) : model.withStroke(history.now, [place, [5, 5]], 5);
    history = steps.changed(history, next);
    states.push(next);
  }
  for (let i = states.length - 2; i >= 0; i -= 1) assert.equal((history = steps.undone(history)).now, states[i]);
  assert.equal(steps.undone(history), history);
  for (let i = 1; i < states.length; i += 1) assert.equal((history = steps.redone(history)).now, states[i]);
  assert.equal(steps.redone(history), history);
  history = steps.changed(steps.undone(history), sheet());
  assert.equal(history.future.length, 0);
  assert.equal(steps.changed(history, history.now), history);
});

test("an eraser cuts at its edge and leaves the rest as it was", () => {
  const line = [[0, 0], [100, 0], [200, 0]];
  const [left, right] = erased(line, [0, 0.5, 1], [100, 0], 10);
  assert.deepEqual(left.points, [[0, 0], [90, 0]]);
  assert.deepEqual(right.points, [[110, 0], [200, 0]]);
  assert.ok(Math.abs(left.values[1] - 0.45) < 1e-9 && Math.abs(right.values[0] - 0.55) < 1e-9);
  assert.equal(erased(line, null, [100, 11], 10), null);
  assert.deepEqual(erased(line, null, [100, 0], 500), []);
  assert.deepEqual(erased([[3, 3]], null, [4, 3], 5), []);
  assert.equal(erased([[3, 3]], null, [40, 3], 5), null);
});

test("no erased point lies under the eraser, none outside is lost", () => {
  const random = numbers(3);
  for (let round = 0; round < 200; round += 1) {
    const points = Array.from({ length: 12 }, () => [random() * 100, random() * 100]);
    const center = [random() * 100, random() * 100];
    const pieces = erased(points, null, center, 20);
    if (pieces === null) continue;
    const kept = pieces.flatMap((piece) => piece.points);
    const far = (p) => Math.hypot(p[0] - center[0], p[1] - center[1]);
    assert.ok(kept.every((p) => far(p) > 20 - 1e-6));
    const outside = points.filter((p) => far(p) > 20 + 1e-6);
    assert.ok(outside.every((p) => kept.some((k) => Math.hypot(k[0] - p[0], k[1] - p[1]) < 1e-6)));
  }
});

test("the eraser takes the map or the marks, not both", () => {
  let drawing = model.withStroke(sheet(), [[0, 100], [400, 100]], 5);
  drawing = model.withObstacle(drawing, [[600, 600], [700, 600], [650, 700]], "crate");
  drawing = model.withRoute(drawing, [[200, 0], [200, 50], [200, 200]]);
  assert.equal(model.touched(drawing, [200, 100], 10), "marks");
  assert.equal(model.touched(drawing, [20, 100], 10), "map");
  assert.equal(model.touched(drawing, [1000, 1000], 10), null);
  assert.equal(model.withoutMapAt(drawing, [200, 100], 10).strokes.length, 2);
  assert.deepEqual(model.withoutMarksAt(drawing, [200, 100], 10).route, [[200, 0], [200, 50], [200, 90]]);
  assert.equal(model.withoutMarksAt(drawing, [200, 0], 10).route, null);
  assert.equal(model.withoutMapAt(drawing, [650, 640], 10).obstacles.length, 0);
  assert.equal(model.withoutMapAt(drawing, [1000, 1000], 10), drawing);
  assert.equal(model.withoutMarksAt(drawing, [1000, 1000], 10), drawing);
});

test("a route and goals take each other's place; the start goes once", () => {
  const goals = model.withStart(model.withGoal(model.withGoal(sheet(), [1, 2]), [3, 4]), [9, 9], 90);
  assert.equal(model.pathBody(goals), '{"start":{"at":[9,9],"heading_deg":90},"goals":[[1,2],[3,4]]}');
  assert.equal(model.pathBody(goals, { at: [9, 9], heading_deg: 90 }), '{"goals":[[1,2],[3,4]]}');
  const route = model.withRoute(goals, [[0, 0], [5, 5]]);
  assert.equal(model.pathBody(route), '{"route":[[0,0],[5,5]]}');
  const goal = model.withGoal(sheet(), [1, 1]);
  assert.deepEqual([goal, goals, route, sheet()].map(model.hasPath), [true, true, true, false]);
  assert.equal(model.withGoal(route, [1, 1]).route, null);
  const sent = model.withPath(sheet(), JSON.parse(model.pathBody(goals)));
  assert.equal(model.pathBody(sent), model.pathBody(goals));
});

test("what is sent is the map: no marks, no underlay", () => {
  const drawing = { ...scribble(numbers(5)), underlay: "data:image/png;base64,AAAA" };
  const body = JSON.parse(model.sketchBody(drawing));
  assert.deepEqual(Object.keys(body), ["canvas", "strokes", "obstacles", "labels", "pad"]);
  assert.deepEqual(Object.keys(body.pad), ["pressure"]);
  assert.deepEqual(body.strokes[3].points, drawing.strokes[3].points);
});

test("holding still straightens what was nearly straight, and nothing else", () => {
  assert.ok(meantStraight([[0, 0], [50, 4], [100, -3], [200, 0]]));
  assert.ok(!meantStraight([[0, 0], [100, 60], [200, 0]]));
  assert.ok(!meantStraight([[0, 0], [20, 0]]));
  assert.deepEqual(squared([0, 0], [100, 5]), [100, 0]);
  assert.deepEqual(squared([0, 0], [5, 100]), [0, 100]);
  assert.deepEqual(squared([0, 0], [100, 50]), [100, 50]);
});

test("inside a polygon, and how wide it is there", () => {
  const triangle = [[0, 0], [100, 0], [50, 100]];
  assert.ok(inside([50, 50], triangle) && !inside([5, 90], triangle));
  assert.equal(roomAt([50, 50], triangle, 0), 50);
  assert.equal(roomAt([50, 50], triangle, 20), 40, "its corners are within, too");
  assert.equal(roomAt([500, 50], triangle, 0), 0);
});
