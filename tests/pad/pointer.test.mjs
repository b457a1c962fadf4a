// The rules for pointers: which one draws, which one moves the sheet, and which one is a palm.

import assert from "node:assert/strict";
import { test } from "node:test";

import { Pointers } from "../../services/pad/page/pointer.js";

/** Pointers whose listener records its calls. */
function hand(options = {}) {
  const told = [];
  const listener = {
    begin: (s) => told.push(["begin", ...s.at, ...(s.eraser ? ["eraser"] : [])]),
    extend: (all) => told.push(["extend", all.length]),
    end: () => told.push(["end"]),
    cancel: () => told.push(["cancel"]),
    hover: () => {},
    pan: (dx, dy) => told.push(["pan", dx, dy]),
    zoom: (at, factor) => told.push(["zoom", Math.round(factor * 100) / 100]),
  };
  const pointers = new Pointers(listener, () => ({ hand: false, fingers: true, ...options }));
  const event = (type, id, x, y, more = {}) => ({ id, type, x, y, pressure: 0.5, buttons: 1, shift: false, time: 0, ...more });
  return { pointers, told, pen: (...a) => event("pen", ...a), touch: (...a) => event("touch", ...a), mouse: (...a) => event("mouse", ...a) };
}

test("a pen draws, with every coalesced point", () => {
  const { pointers, told, pen } = hand();
  pointers.down(pen(1, 10, 10));
  pointers.move(pen(1, 20, 10), [pen(1, 14, 10), pen(1, 17, 10), pen(1, 20, 10)]);
  pointers.up(pen(1, 20, 10));
  assert.deepEqual(told, [["begin", 10, 10], ["extend", 3], ["end"]]);
  assert.ok(pointers.penSeen && !pointers.drawing);
});

test("one finger draws until a pen was seen, from then on it moves the sheet", () => {
  const { pointers, told, pen, touch } = hand();
  pointers.down(touch(1, 0, 0));
  pointers.up(touch(1, 0, 0));
  pointers.down(pen(2, 5, 5));
  pointers.up(pen(2, 5, 5));
  pointers.down(touch(3, 0, 0));
  pointers.move(touch(3, 7, -2));
  pointers.up(touch(3, 7, -2));
  assert.deepEqual(told, [["begin", 0, 0], ["end"], ["begin", 5, 5], ["end"], ["pan", 7, -2]]);
});

test("two fingers at once are a pinch, and what the first has drawn is dropped", () => {
  const { pointers, told, touch } = hand();
  pointers.down(touch(1, 0, 0));
  pointers.down(touch(2, 100, 0, { time: 50 }));
  pointers.move(touch(2, 200, 0));
  pointers.up(touch(1, 0, 0));
  pointers.move(touch(2, 210, 0));
  assert.deepEqual(told, [["begin", 0, 0], ["cancel"], ["pan", 50, 0], ["zoom", 2], ["pan", 10, 0]]);
});

test("a second finger beside a stroke that is well under way does nothing at all", () => {
  const { pointers, told, touch } = hand();
  pointers.down(touch(1, 0, 0));
  pointers.move(touch(1, 80, 0, { time: 400 }));
  pointers.down(touch(2, 300, 300, { time: 500 }));
  pointers.move(touch(2, 320, 300));
  pointers.move(touch(1, 90, 0));
  pointers.up(touch(2, 320, 300));
  pointers.up(touch(1, 90, 0));
  assert.deepEqual(told, [["begin", 0, 0], ["extend", 1], ["extend", 1], ["end"]]);
});

test("a palm beside the pen does nothing, whether it comes before or after it", () => {
  const { pointers, told, pen, touch } = hand();
  pointers.down(touch(1, 200, 200));
  pointers.down(pen(2, 5, 5));
  pointers.move(touch(1, 220, 200));
  pointers.down(touch(3, 230, 230));
  pointers.move(touch(3, 240, 230));
  pointers.move(pen(2, 6, 5));
  pointers.up(pen(2, 6, 5));
  pointers.up(touch(1, 220, 200));
  assert.deepEqual(told, [["begin", 200, 200], ["cancel"], ["begin", 5, 5], ["extend", 1], ["end"]]);
});

test("what the browser cancels is dropped", () => {
  const { pointers, told, pen } = hand();
  pointers.down(pen(1, 1, 1));
  pointers.cancel(pen(1, 1, 1));
  pointers.move(pen(1, 2, 2));
  pointers.up(pen(1, 2, 2));
  assert.deepEqual(told, [["begin", 1, 1], ["cancel"]]);
  pointers.down(pen(1, 1, 1));
  pointers.cancelAll();
  assert.deepEqual(told.slice(2), [["begin", 1, 1], ["cancel"]]);
});

test("the mouse's first button draws, its others move the sheet; a pen's other end erases", () => {
  const { pointers, told, mouse, pen } = hand();
  pointers.down(mouse(1, 0, 0, { buttons: 2 }));
  pointers.move(mouse(1, 3, 4));
  pointers.up(mouse(1, 3, 4));
  pointers.down(pen(2, 9, 9, { buttons: 32 }));
  assert.deepEqual(told, [["pan", 3, 4], ["begin", 9, 9, "eraser"]]);
});

test("with the hand as the tool everything moves the sheet, and fingers draw only where they may", () => {
  const moving = hand({ hand: true });
  moving.pointers.down(moving.pen(1, 0, 0));
  moving.pointers.move(moving.pen(1, 1, 1));
  assert.deepEqual(moving.told, [["pan", 1, 1]]);
  const calm = hand({ fingers: false });
  calm.pointers.down(calm.touch(1, 0, 0));
  calm.pointers.move(calm.touch(1, 1, 1));
  assert.deepEqual(calm.told, [["pan", 1, 1]]);
});
