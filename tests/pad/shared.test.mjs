// Tests of the drawing that several pages change at once: pages agree, nothing of another person is undone, nothing is lost. Run
// with `node --test`.

import assert from "node:assert/strict";
import { test } from "node:test";

import * as steps from "../../services/pad/page/history.js";
import * as items from "../../services/pad/page/items.js";
import * as model from "../../services/pad/page/model.js";
import { thinned } from "../../services/pad/page/people.js";
import { Shared, idOf, replayed, unwired, wired } from "../../services/pad/page/shared.js";
import { Together } from "../../services/pad/page/together.js";
import { move } from "../../services/pad/page/transform.js";

const begun = () => ({ ...model.blank(model.LANDSCAPE), id: "kitchen" });
const wall = (x) => [[x, 0], [x, 100]];

/** Pseudorandom numbers that are the same in each run. */
function numbers(seed) {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}

/** A page without a sheet: what Desk and Together do with a drawing. */
class Page {
  constructor(name, drawing = begun()) {
    this.shared = new Shared(drawing, name);
    this.shared.follow(drawing);
    this.history = steps.history(this.shared.drawing(drawing));
    this.unsent = new Set(this.shared.all().map(({ id }) => id));
  }

  get drawing() {
    return this.history.now;
  }

  #follows(history, now) {
    this.history = history;
    this.shared.follow(this.drawing, now).forEach((id) => this.unsent.add(id));
    this.history = { ...this.history, now: this.shared.drawing(this.drawing) };
  }

  change(next, now = 1) {
    this.#follows(steps.changed(this.history, next), now);
  }

  undo(now = 1) {
    this.#follows(steps.undone(this.history), now);
  }

  redo(now = 1) {
    this.#follows(steps.redone(this.history), now);
  }

  /** What this page sends, as text. */
  sends() {
    const entries = [...this.unsent].map((id) => wired(this.shared.get(id)));
    this.unsent.clear();
    return entries.map((entry) => JSON.stringify(entry));
  }

  hears(entries) {
    entries.forEach((entry) => this.shared.take(unwired(JSON.parse(entry))));
    this.history = { ...this.history, now: this.shared.drawing(this.drawing) };
  }
}

/** Two pages that know the same drawing. */
function two(drawing = begun()) {
  const [anna, berta] = [new Page("anna", drawing), new Page("berta")];
  berta.hears(anna.sends());
  assert.equal(model.toText(berta.drawing), model.toText(anna.drawing));
  return [anna, berta];
}

function tell(...pages) {
  const sent = pages.map((page) => page.sends());
  pages.forEach((page, i) => page.hears(sent.filter((_, j) => j !== i).flat()));
  for (const page of pages) assert.equal(model.toText(page.drawing), model.toText(pages[0].drawing));
}

const furnished = () => {
  let drawing = begun();
  for (const x of [100, 200, 300]) drawing = model.withStroke(drawing, wall(x), 5);
  drawing = model.withText(model.withObstacle(drawing, [[10, 10], [50, 10], [30, 40]], "table"), "kitchen", [700, 400]);
  return model.withGoal(model.withGoal(model.withStart(drawing, [5, 5], 90), [400, 400]), [500, 500]);
};

test("two people who draw at once see both drawings, in the same order", () => {
  const [anna, berta] = two(furnished());
  anna.change(model.withGoal(model.withStroke(anna.drawing, wall(400), 5), [1, 1]));
  berta.change(model.withGoal(model.withStroke(berta.drawing, wall(500), 5, [0.5, 1]), [2, 2]));
  tell(anna, berta);
  assert.equal(anna.drawing.strokes.length, 5);
  assert.equal(anna.drawing.goals.length, 4);
});

/** Regression test: the server refused it, because the entry of the removed path did not say that it had been a path. */
test("whoever comes after a path was undone can draw another", () => {
  const [anna, clara] = [new Page("anna"), new Page("clara")];
  anna.change(model.withRoute(anna.drawing, [[0, 0], [9, 9]]));
  anna.undo();
  clara.hears(anna.shared.all().map((entry) => JSON.stringify(wired(entry))));
  clara.change(model.withRoute(clara.drawing, [[1, 1], [5, 5]]));
  const sent = clara.sends().map((entry) => JSON.parse(entry)).find(({ id }) => id === "route");
  assert.deepEqual(sent.shape, { route: [[1, 1], [5, 5]] });
});

test("undo and redo concern one's own steps, whatever others have drawn since", () => {
  const [anna, berta] = two(furnished());
  anna.change(model.withStroke(anna.drawing, wall(400), 5));
  anna.change(items.transformed(anna.drawing, ["strokes:0", "labels:0"], move([7, 0])));
  tell(anna, berta);
  berta.change(model.withStroke(berta.drawing, wall(500), 5));
  berta.change(items.transformed(berta.drawing, ["labels:0"], move([0, 9])));
  tell(anna, berta);
  anna.undo();
  tell(anna, berta);
  assert.deepEqual(berta.drawing.strokes.map((s) => s.points[0][0]), [100, 200, 300, 400, 500], "the wall is back, Berta's stays");
  assert.deepEqual(berta.drawing.labels[0].at, [707, 409], "what Berta has moved since stays there");
  anna.undo();
  anna.redo();
  anna.redo();
  tell(anna, berta);
  assert.deepEqual(anna.drawing.strokes.map((s) => s.points[0][0]), [107, 200, 300, 400, 500]);
  berta.undo();
  berta.undo();
  tell(anna, berta);
  assert.deepEqual(berta.drawing.strokes.map((s) => s.points[0][0]), [107, 200, 300, 400]);
});

test("a step of which others have changed everything is no step any more", () => {
  const [anna, berta] = two(furnished());
  anna.change(model.withStroke(anna.drawing, wall(400), 5));
  anna.change(items.transformed(anna.drawing, ["strokes:0"], move([7, 0])));
  tell(anna, berta);
  berta.change(items.without(berta.drawing, ["strokes:0"]));
  tell(anna, berta);
  anna.undo();
  tell(anna, berta);
  assert.deepEqual(berta.drawing.strokes.map((s) => s.points[0][0]), [200, 300]);
});

test("what is deleted comes back in its place", () => {
  const [anna, berta] = two(furnished());
  anna.change(items.without(anna.drawing, ["strokes:1", "goals:0"]));
  tell(anna, berta);
  berta.change(model.withStroke(berta.drawing, wall(500), 5));
  tell(anna, berta);
  anna.undo();
  tell(anna, berta);
  assert.deepEqual(anna.drawing.strokes.map((s) => s.points[0][0]), [100, 200, 300, 500]);
  assert.deepEqual(anna.drawing.goals.map((g) => g.at[0]), [400, 500]);
});

test("an erased part leaves pieces, and a copy is another item", () => {
  const [anna, berta] = two(furnished());
  const whole = idOf(anna.drawing.strokes[1]);
  anna.change(model.withoutMapAt(anna.drawing, [200, 50], 10));
  anna.change(items.duplicated(anna.drawing, ["obstacles:0"], [50, 50]).drawing);
  tell(anna, berta);
  assert.equal(anna.drawing.strokes.length, 4);
  const ids = [...anna.drawing.strokes, ...anna.drawing.obstacles].map(idOf);
  assert.equal(new Set(ids).size, 6);
  assert.ok(ids.includes(whole));
  assert.deepEqual(anna.drawing.strokes.map((s) => s.points[0][0]), [100, 200, 200, 300], "pieces stay in place");
});

test("of two changes of one item, the later stays, and if both are equally late, that of the greater name", () => {
  for (const [first, second, x] of [[10, 20, 409], [20, 10, 407], [10, 10, 409]]) {
    const [anna, berta] = two(furnished());
    anna.change(items.transformed(anna.drawing, ["goals:0"], move([7, 0])), first * 1e12);
    berta.change(items.transformed(berta.drawing, ["goals:0"], move([9, 0])), second * 1e12);
    tell(anna, berta);
    assert.equal(anna.drawing.goals[0].at[0], x);
  }
});

test("a page whose clock is slow still changes what it sees", () => {
  const [anna, berta] = two(furnished());
  anna.change(items.transformed(anna.drawing, ["goals:0"], move([7, 0])), 1e12);
  tell(anna, berta);
  berta.change(items.transformed(berta.drawing, ["goals:0"], move([9, 0])), 5);
  tell(anna, berta);
  assert.equal(anna.drawing.goals[0].at[0], 416);
});

test("of a path and goals that were drawn at once, the later stay", () => {
  for (const [first, second] of [[1e13, 2e13], [2e13, 1e13]]) {
    const [anna, berta] = two();
    anna.change(model.withRoute(anna.drawing, wall(50)), first);
    berta.change(model.withGoal(berta.drawing, [5, 5]), second);
    tell(anna, berta);
    assert.deepEqual([anna.drawing.route === null, anna.drawing.goals.length], first < second ? [true, 1] : [false, 0]);
    anna.change(model.withStroke(anna.drawing, wall(1), 5), 3e13);
    tell(anna, berta);
  }
});

test("a gesture goes on while others draw, and does not bring back what they delete", () => {
  const [anna, berta] = two(furnished());
  const base = anna.drawing;
  const dragged = items.transformed(base, ["strokes:0", "strokes:1", "goals:1"], move([7, 0]));
  berta.change(items.without(model.withStroke(berta.drawing, wall(500), 5), ["strokes:1"]));
  berta.change(items.transformed(berta.drawing, ["strokes:0"], move([0, 50])));
  anna.hears(berta.sends());
  anna.change(replayed(anna.drawing, base, dragged));
  tell(anna, berta);
  assert.deepEqual(berta.drawing.strokes.map((s) => s.points[0]), [[107, 0], [300, 0], [500, 0]]);
  assert.equal(berta.drawing.goals[1].at[0], 507);
});

test("a selection follows its items", () => {
  const [anna, berta] = two(furnished());
  const before = anna.drawing;
  berta.change(items.transformed(items.without(berta.drawing, ["strokes:0", "goals:1", "start:0"]), ["strokes:1"], move([3, 3])));
  anna.hears(berta.sends());
  const keys = ["strokes:0", "strokes:2", "obstacles:0", "goals:0", "goals:1", "start:0"];
  assert.deepEqual(keys.map((key) => items.movedKey(key, before, anna.drawing)), [null, "strokes:1", "obstacles:0", "goals:0", null, null]);
});

test("a drawing that was closed and opened again is merged with what others have drawn", () => {
  const [anna, berta] = two(furnished());
  anna.change(items.without(anna.drawing, ["strokes:2"]));
  anna.change(items.grouped(anna.drawing, ["strokes:1", "obstacles:0"]));
  tell(anna, berta);
  // Without a link, both go on.
  anna.change(model.withStroke(anna.drawing, wall(400), 5));
  anna.change(items.without(anna.drawing, ["labels:0"]));
  const text = model.toText(anna.drawing, anna.shared.kept(anna.drawing));
  berta.change(items.without(berta.drawing, ["strokes:0"]));
  berta.change(model.withStroke(berta.drawing, wall(500), 5));
  berta.change(items.transformed(berta.drawing, ["strokes:0"], move([3, 0])));

  const drawing = { ...model.fromText(text), id: "kitchen" };
  assert.equal(model.toText(drawing), model.toText(anna.drawing));
  const again = new Page("anna", begun());
  again.shared = Shared.restored(drawing, JSON.parse(text).pad.shared, "another");
  again.history = steps.history(again.shared.drawing(drawing));
  assert.equal(again.drawing.strokes, drawing.strokes, "nothing has changed");
  again.unsent = new Set(again.shared.all().map(({ id }) => id));
  berta.unsent = new Set(berta.shared.all().map(({ id }) => id));
  tell(again, berta);
  assert.deepEqual(berta.drawing.strokes.map((s) => s.points[0][0]).sort(), [203, 400, 500]);
  const groups = [again, berta].map(({ drawing: { strokes, obstacles } }) => [strokes[0].group, obstacles[0].group]);
  assert.ok(groups.flat().every((group) => group && group === groups[0][0]), `one group, found ${groups}`);
  assert.equal(berta.drawing.labels.length, 0);
});

test("a drawing from before it was shared is taken in as it is", () => {
  const drawing = furnished();
  const shared = Shared.restored(drawing, {}, "anna");
  assert.equal(model.toText(shared.drawing(drawing)), model.toText(drawing));
});

/** A random change. */
function anyChange(drawing, random) {
  const keys = items.allKeys(drawing);
  const some = keys.filter(() => random() < 0.3);
  const at = [Math.floor(random() * 2000), Math.floor(random() * 1000)];
  const kinds = [
    () => model.withStroke(drawing, [at, [at[0], at[1] + 90], [at[0] + 90, at[1]]], 5),
    () => model.withObstacle(drawing, [at, [at[0] + 30, at[1]], [at[0], at[1] + 30]], "box"),
    () => model.withGoal(drawing, at),
    () => model.withRoute(drawing, [at, [1, 1]]),
    () => model.withStart(drawing, at, 90),
    () => items.without(drawing, some),
    () => (some.length ? items.transformed(drawing, some, move([5, 5])) : drawing),
    () => (some.length ? items.duplicated(drawing, some, [9, 9]).drawing : drawing),
    () => (some.length > 1 ? items.grouped(drawing, some) : drawing),
    () => model.withoutMapAt(drawing, at, 60),
    () => model.withDoor(drawing, at, [at[0], at[1] + 60], 14),
  ];
  return kinds[Math.floor(random() * kinds.length)]();
}

test("pages that draw, undo and hear of each other in any order have the same drawing in the end", () => {
  for (let seed = 1; seed <= 60; seed += 1) {
    const random = numbers(seed);
    const pages = ["anna", "berta", "carl"].map((name) => new Page(name));
    const sent = [];
    const heard = pages.map(() => new Set());
    const hear = (i, all) => sent.forEach((text, n) => {
      if (heard[i].has(n) || (!all && random() < 0.5)) return;
      heard[i].add(n);
      pages[i].hears([text]);
    });
    for (let step = 0; step < 60; step += 1) {
      const i = Math.floor(random() * 3);
      const now = Math.floor(random() * 1000);
      const what = random();
      if (what < 0.6) pages[i].change(anyChange(pages[i].drawing, random), now);
      else if (what < 0.75) pages[i].undo(now);
      else if (what < 0.8) pages[i].redo(now);
      else hear(i, false);
      // A page that is cut off sends later.
      if (random() < 0.5) sent.push(...pages[i].sends());
      assert.equal(model.toText(pages[i].shared.drawing()), model.toText(pages[i].drawing), `seed ${seed}`);
    }
    pages.forEach((page) => sent.push(...page.sends()));
    pages.forEach((_, i) => hear(i, true));
    for (const page of pages) assert.equal(model.toText(page.drawing), model.toText(pages[0].drawing), `seed ${seed}`);
    const text = JSON.stringify(pages[0].shared.all().map(wired).sort((a, b) => (a.id < b.id ? -1 : 1)));
    for (const page of pages) assert.equal(JSON.stringify(page.shared.all().map(wired).sort((a, b) => (a.id < b.id ? -1 : 1))), text);
  }
});

test("a long line is shown with few points, and its ends", () => {
  for (const count of [0, 1, 40, 41, 80, 1000]) {
    const line = Array.from({ length: count }, (_, i) => [i, i]);
    const few = thinned(line);
    assert.ok(few.length <= 40 && few.length >= Math.min(count, 20), `${count}: ${few.length}`);
    assert.deepEqual([few[0], few.at(-1)], [line[0], line.at(-1)]);
  }
});

/** A page with a server that answers each post with the next status, and 200 in the end. */
class Served {
  posts = [];
  said = [];
  restarts = 0;

  constructor(drawing, statuses) {
    const link = {
      up: true,
      restart: () => { this.restarts += 1; },
      post: async (path, body) => {
        this.posts.push(JSON.parse(body));
        const status = statuses.shift() ?? 200;
        if (status !== 200) throw Object.assign(new Error(`refused with ${status}`), { status });
      },
    };
    this.desk = { drawing, merge: (next) => { this.desk.drawing = next; }, renew: (next) => { this.desk.drawing = next; } };
    this.together = new Together({
      desk: this.desk, link, kept: () => null, found: async () => null, begun: async () => {}, changed: () => {}, say: (words) => this.said.push(words),
    });
    this.together.linked(true);
  }

  async hears(news, people) {
    if (people) this.together.met({ me: 1, all: people });
    this.together.told(news);
    await this.settled(1);
  }

  draws(x) {
    this.desk.drawing = model.withStroke(this.desk.drawing, wall(x), 5);
    this.together.changed(this.desk.drawing);
  }

  /** Waits until no post comes any more. */
  async settled(ms = 120) {
    await new Promise((done) => { setTimeout(done, ms); });
  }
}

const walls = (...xs) => xs.reduce((drawing, x) => model.withStroke(drawing, wall(x), 5), begun());
const alone = [{ page: 1, sheet: "kitchen" }];
const sentTo = ({ entries }) => entries.map(({ shape }) => shape.strokes.points[0][0]);

test("what was refused is sent with the next change, as a whole", async () => {
  for (const status of [400, 413]) {
    const page = new Served(walls(1, 2, 3), [status]);
    await page.hears({ sheet: null, entries: [] }, alone);
    await page.settled();
    assert.deepEqual([page.posts.length, page.said, page.together.isInside], [1, [`The others do not see your last change: refused with ${status}`], false]);
    page.draws(4);
    await page.settled();
    assert.deepEqual(page.posts.map(sentTo), [[1, 2, 3], [1, 2, 3, 4]]);
    assert.deepEqual(page.posts.map(({ instead }) => instead), ["", ""]);
    page.draws(5);
    await page.settled();
    assert.deepEqual([page.posts.length, sentTo(page.posts[2]), page.posts[2].instead, page.together.isInside], [3, [5], undefined, true]);
  }
});

test("a refused change keeps the valid ones, and is not sent again because others draw", async () => {
  const page = new Served(walls(1), [200, 400]);
  await page.hears({ sheet: null, entries: [] }, alone);
  await page.settled();
  page.draws(2);
  await page.settled();
  const theirs = { id: "abc", time: 5, by: "berta", order: 9, shape: { strokes: { points: wall(7), width_px: 5, pressure: null } } };
  await page.hears({ sheet: { id: "kitchen", canvas: model.LANDSCAPE }, entries: [theirs] });
  page.together.changed(page.desk.drawing);
  await page.settled();
  assert.deepEqual([page.posts.length, page.together.isInside], [2, true]);
  page.draws(3);
  await page.settled();
  assert.deepEqual(sentTo(page.posts[2]), [2, 3]);
});

/** The server (together.rs) accepts a change that is later than the year 2100 only if it counts on from one that it has accepted. */
test("a page counts on from a change in its future, and goes by its clock otherwise", () => {
  const [anna, berta] = two(walls(1));
  const of = (page) => page.shared.all().find(({ id }) => id === idOf(page.drawing.strokes[0]));
  const year2100 = 4_102_444_800_000;
  for (const [page, now, time] of [[anna, year2100, year2100], [berta, 2000, year2100 + 1], [anna, 3000, year2100 + 2]]) {
    const [line] = page.drawing.strokes;
    page.change({ ...page.drawing, strokes: [{ ...line, width_px: line.width_px + 1 }] }, now);
    assert.equal(of(page).time, time);
    tell(anna, berta);
  }
  assert.equal(model.toText(anna.drawing), model.toText(berta.drawing));
});

test("what was refused as too slow or too much at once is sent again", async () => {
  for (const status of [408, 429]) {
    const page = new Served(walls(1, 2), [status]);
    await page.hears({ sheet: null, entries: [] }, alone);
    await page.settled(700);
    assert.deepEqual([page.posts.map(sentTo), page.said], [[[1, 2], [1, 2]], []]);
  }
});

test("a page whose drawing was refused learns again what the others share", async () => {
  const others = [...alone, { page: 2, sheet: "hall" }];
  const hall = { sheet: { id: "hall", canvas: model.LANDSCAPE }, entries: [] };
  const page = new Served(walls(1), [413, 413]);
  await page.hears({ sheet: null, entries: [] }, alone);
  await page.settled();
  assert.equal(page.restarts, 0);
  await page.hears(hall);
  assert.equal(page.restarts, 1, "another page was faster");
  page.together.linked(true);
  await page.hears(hall, others);
  assert.deepEqual([page.together.isInside, page.together.isOutside, page.posts.length], [false, true, 1]);
  page.together.share();
  await page.settled();
  assert.deepEqual([page.posts.length, page.posts[1].instead, page.restarts], [2, "hall", 2]);
  page.together.linked(true);
  await page.hears(hall, others);
  await page.settled();
  assert.deepEqual([page.together.isOutside, page.posts.length], [true, 2]);
});
