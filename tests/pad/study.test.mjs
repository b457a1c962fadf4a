// The measurements of a study while somebody draws.

import assert from "node:assert/strict";
import { test } from "node:test";

import { changed, history, redone, undone } from "../../services/pad/page/history.js";
import { transformed, without } from "../../services/pad/page/items.js";
import { NOTHING, measured, report } from "../../services/pad/page/measure.js";
import { LANDSCAPE, blank, withLabel, withObstacle, withRoute, withStroke, withoutMapAt } from "../../services/pad/page/model.js";
import { advice } from "../../services/pad/page/states.js";
import { move } from "../../services/pad/page/transform.js";

/** A hand that spends two seconds on each step, and pauses for one. */
class Drawing {
  history = history(blank(LANDSCAPE));
  measure = NOTHING;
  now = 100000;

  step(how, next) {
    const before = this.history.now;
    this.history = next;
    const [began, ended] = [this.now, this.now + 2000];
    this.measure = measured(this.measure, before, next.now, { how, began, ended, screen: "landscape" });
    this.now = ended + 1000;
  }

  draw(change) {
    this.step("draw", changed(this.history, change(this.history.now)));
  }
}

const stroke = (x) => (drawing) => withStroke(drawing, [[x, 10], [x, 400]], 5);

test("drawing time goes from the first touch to the last change of the map", () => {
  const hand = new Drawing();
  assert.equal(report(hand.measure), null, "nothing was drawn yet");
  hand.draw(stroke(100));
  assert.deepEqual(report(hand.measure), { drawing_s: 2, path_s: 0, strokes: 1, undone: 0, erased: 0, screen: "landscape" });
  hand.draw(stroke(200));
  hand.draw((drawing) => withRoute(drawing, [[10, 10], [50, 50]]));
  const after = report(hand.measure);
  assert.deepEqual([after.drawing_s, after.path_s], [5, 2], "the path has its own time");
  hand.draw(stroke(300));
  assert.equal(report(hand.measure).drawing_s, 11, "who returns to the map still draws it");
});

test("strokes that are undone have been drawn all the same", () => {
  const hand = new Drawing();
  hand.draw(stroke(100));
  hand.draw(stroke(200));
  hand.step("undo", undone(hand.history));
  hand.step("redo", redone(hand.history));
  hand.step("undo", undone(hand.history));
  hand.draw((drawing) => withObstacle(drawing, [[1, 1], [9, 1], [9, 9]]));
  const { strokes, undone: steps, erased } = report(hand.measure);
  assert.deepEqual([strokes, steps, erased], [3, 2, 0]);
});

test("an eraser that splits a stroke draws none, and a word on an obstacle is no stroke", () => {
  const hand = new Drawing();
  hand.draw(stroke(100));
  hand.draw((drawing) => withoutMapAt(drawing, [100, 200], 20));
  assert.equal(hand.history.now.strokes.length, 2);
  hand.draw((drawing) => withObstacle(drawing, [[300, 1], [400, 1], [400, 90]]));
  hand.draw((drawing) => withLabel(drawing, 0, "table"));
  const { strokes, erased, drawing_s } = report(hand.measure);
  assert.deepEqual([strokes, erased, drawing_s], [2, 1, 11]);
});

test("what is moved counts for nothing, what is selected and deleted as erased", () => {
  const hand = new Drawing();
  hand.draw(stroke(100));
  hand.draw(stroke(200));
  const edit = (change) => hand.step("edit", changed(hand.history, change(hand.history.now)));
  edit((drawing) => transformed(drawing, ["strokes:0"], move([30, 0])));
  assert.deepEqual([hand.measure.strokes, hand.measure.erased, report(hand.measure).drawing_s], [2, 0, 8]);
  edit((drawing) => without(drawing, ["strokes:0"]));
  assert.equal(hand.measure.erased, 1);
});

test("what does not change the drawing counts for nothing", () => {
  const hand = new Drawing();
  hand.draw((drawing) => drawing);
  hand.step("undo", undone(hand.history));
  assert.equal(hand.measure, NOTHING);
});

test("who practises is told that nothing counts, and who has driven that there are questions", () => {
  const page = { up: true, drives: true, feed: { state: "ended", allowed: [], ready: true }, map: true, path: true };
  assert.match(advice({ ...page, practising: true }), /Nothing counts/);
  assert.match(advice({ ...page, questions: true }), /questions/);
  assert.match(advice(page), /another path/);
});
