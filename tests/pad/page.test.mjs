// What the page shows and enables, depending on the server's messages; the view; the trail; the settings.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { mock, test } from "node:test";

import { oneMore } from "../../services/pad/page/desk.js";
import { carried, drawFeed, trailed } from "../../services/pad/page/feed.js";
import { learnedWords } from "../../services/pad/page/learned.js";
import { Link, pauseMs } from "../../services/pad/page/link.js";
import { LANDSCAPE, blank, withGoal, withStroke } from "../../services/pad/page/model.js";
import { warnings } from "../../services/pad/page/panel.js";
import { merged } from "../../services/pad/page/settings.js";
import { advice, enabled, headline, isAsked, meant, missing, role, seconds, stages, taskWords, tooMuch, wheelNews } from "../../services/pad/page/states.js";
import { fitted, held, onScreen, onSheet, panned, zoomed } from "../../services/pad/page/view.js";

const feed = (state, ...allowed) => ({ state, allowed, ready: true });
const page = (more) => ({ up: true, drives: true, busy: false, feed: null, map: true, path: true, ...more });
const on = (state) => Object.entries(enabled(state)).filter(([, is]) => is).map(([step]) => step);

test("a button is enabled where its step is allowed, the navigation is ready, and there is something to send", () => {
  assert.deepEqual(on(page({ feed: feed("no-sketch", "sketch") })), ["sketch"]);
  assert.deepEqual(on(page({ feed: feed("no-sketch", "sketch"), map: false })), []);
  assert.deepEqual(on(page({ feed: { ...feed("no-sketch", "sketch"), ready: false } })), []);
  assert.deepEqual(on(page({ feed: feed("sketch", "sketch", "path"), path: false })), ["sketch"]);
  assert.deepEqual(on(page({ feed: feed("path", "sketch", "path", "execute") })), ["sketch", "path", "execute", "mission"]);
  assert.deepEqual(on(page({ feed: feed("aborted", "restore", "again"), busy: true })), []);
  assert.deepEqual(on(page({ feed: null })), []);
});

test("stopping waits for no answer and needs no wheel, only a link", () => {
  const driving = feed("driving", "abort");
  assert.deepEqual(on(page({ feed: driving, busy: true })), ["abort"]);
  assert.deepEqual(on(page({ feed: driving, drives: false })), ["abort"]);
  assert.deepEqual(on(page({ feed: driving, up: false })), []);
});

test("a page that asked for the wheel hears what became of it", () => {
  const asks = { ...feed("driving"), asks: true };
  assert.equal(wheelNews(null, asks), null);
  assert.equal(wheelNews(asks, asks), null);
  assert.equal(wheelNews(asks, null), null);
  assert.equal(wheelNews(asks, { ...feed("driving"), drives: true }), "You drive.");
  assert.match(wheelNews(asks, { ...feed("driving"), drives: false }), /keeps the wheel/);
  assert.match(advice(page({ drives: false, feed: asks })), /asked for the wheel/);
});

test("whoever may draw but does not drive is not called a watcher", () => {
  const words = [{ up: false }, { up: true, drives: true, draws: true }, { up: true, draws: true }, { up: true }].map(role);
  assert.deepEqual(words, ["Not connected", "You drive", "You draw", "You watch"]);
  const other = (more) => advice(page({ drives: false, feed: feed("sketch"), ...more }));
  assert.deepEqual([{ draws: true, together: true }, { draws: true }, {}].map(other), [
    "You draw with the others. Another page drives.", "Another page drives.", "Another page drives; this one watches.",
  ]);
});

/** Send was enabled for goals without a start although only the method `outline` finds it out; the server then refused them. */
test("the page says what is missing before goals can be sent, and sends nothing until then", () => {
  const empty = blank(LANDSCAPE);
  const goals = withGoal(empty, [3, 3]);
  const marked = { ...goals, start: { at: [1, 1], heading_deg: 0 } };
  const route = { ...empty, route: [[1, 1], [9, 9]] };
  const sketch = feed("sketch", "sketch", "path");
  const lacks = (more) => missing({ placing: "start", drawing: goals, feed: sketch, learned: null, ...more });
  assert.match(lacks({}), /^Mark the start: /);
  assert.match(lacks({ placing: "path" }), /^Draw a path /);
  assert.match(lacks({ placing: "path", drawing: marked }), /^Draw a path /);
  assert.match(lacks({ learned: { accepted: false } }), /^Mark the start: /);
  for (const more of [
    { placing: "anywhere" }, { placing: null }, { drawing: marked }, { drawing: route }, { drawing: empty }, { learned: { accepted: true } },
    // The robot was placed by an earlier path.
    { feed: feed("ended", "sketch", "path") },
  ]) assert.equal(lacks(more), null, JSON.stringify(more));
  const state = page({ feed: sketch, placing: "start", lacks: lacks({}) });
  assert.deepEqual([on(state), advice(state)], [["sketch"], lacks({})]);
  assert.deepEqual(on(page({ feed: sketch, placing: "start", lacks: null })), ["sketch", "path"]);
  // Before there is anything to send, the page says what to mark.
  const first = ["anywhere", "start", "path"].map((placing) => advice(page({ feed: sketch, path: false, placing })));
  assert.deepEqual(first.map((words) => [/goals/.test(words), /Without a mark/.test(words)]), [[true, true], [true, false], [false, false]]);
});

test("every state has a headline and advice", () => {
  for (const state of ["no-sketch", "sketch", "path", "driving", "aborted", "paused", "ended"]) {
    assert.notEqual(headline(page({ feed: feed(state) })), state);
    assert.ok(advice(page({ feed: feed(state) })).length > 5);
  }
  assert.equal(headline(page({ up: false })), "Not connected");
  assert.match(advice(page({ up: false, refusal: "expected the token" })), /expected the token/);
  assert.deepEqual(stages(feed("path")).map(([, is]) => is), ["done", "done", "now"]);
  assert.deepEqual(stages(feed("ended")).map(([, is]) => is), ["done", "done", "done"]);
  assert.deepEqual(stages(null).map(([, is]) => is), ["now", "later", "later"]);
});

test("words for tasks, times, limits", () => {
  assert.equal(taskWords({ index: 0, count: 2, name: "kitchen", state: "blocked", reason: "a chair" }), "Task 1 of 2 “kitchen”: blocked, a chair");
  assert.equal(taskWords({ index: 2, count: 3, state: "finished", reached: 2 }), "2 of 3 tasks reached");
  assert.equal(taskWords({ index: 0, count: 1, name: "route", state: "driving", reason: "around a chair" }), "Task 1 of 1 “route”: driving", "the warnings say it");
  assert.equal(taskWords(null), null);
  assert.equal(seconds(125.9), "2:05");
  assert.equal(seconds(undefined), "–");
  const limits = { bytes: 100, points: 10, strokes: 2, goals: 1, path_points: 5 };
  assert.equal(tooMuch(limits, { strokes: 3, points: 1, bytes: 1 }), "Too large: at most 2 strokes, found 3.");
  assert.equal(tooMuch(limits, { strokes: 2, points: 10, bytes: 100 }), null);
  assert.equal(tooMuch(undefined, { strokes: 1e9 }), null);
});

test("a link that is down or silent is warned of", () => {
  assert.deepEqual(warnings({ up: false, seen: true, silentS: 0, feed: { warnings: [{ text: "lost" }] } }), ["Not connected to the robot.", "lost"]);
  assert.deepEqual(warnings({ up: true, silentS: 3.4, feed: null }), ["No word from the robot for 3 s."]);
  assert.deepEqual(warnings({ up: false, seen: false, silentS: 0, feed: null }), []);
  assert.ok(pauseMs(0) < pauseMs(3) && pauseMs(50) === pauseMs(4));
});

test("a silent link is restarted, after a longer time while a long message arrives", () => {
  const sockets = [];
  let [now, tick] = [0, null];
  const storage = { getItem: () => null, setItem: () => {} };
  mock.method(performance, "now", () => now);
  globalThis.window = {
    location: { protocol: "http:", host: "pad" }, sessionStorage: storage, addEventListener: () => {}, clearTimeout: () => {}, setTimeout: () => 0,
    setInterval: (run) => { tick = run; },
  };
  globalThis.WebSocket = class {
    static OPEN = 1;

    constructor() {
      sockets.push(this);
    }

    close() {}
  };
  try {
    const link = new Link("", { changed: () => {}, hello: () => {} });
    const hears = (message) => sockets[0].onmessage({ data: JSON.stringify(message) });
    const isUpAfter = (ms) => {
      now += ms;
      tick();
      return link.up;
    };
    hears({ hello: { session: "a" } });
    assert.ok(isUpAfter(5900));
    hears({ long: 4e6 });
    assert.ok(isUpAfter(59000));
    hears({ drawn: null });
    assert.ok(isUpAfter(5900) && !isUpAfter(200));
  } finally {
    mock.restoreAll();
    delete globalThis.window;
    delete globalThis.WebSocket;
  }
});

test("what was learned is said while it grows and afterwards, and on pages that watch", () => {
  const [growing, grown] = [{ growing: true, accepted: false }, { growing: false, accepted: false }];
  assert.equal(learnedWords({ feed: null, learned: null, watches: true }), null);
  assert.match(learnedWords({ feed: feed("driving"), learned: growing, watches: true }), /corrects the drawing/);
  assert.match(learnedWords({ feed: feed("paused"), learned: grown, watches: true }), /corrected by what the robot saw/);
  assert.match(learnedWords({ feed: feed("finished", "accept"), learned: grown }), /Accept it/);
  assert.equal(learnedWords({ feed: feed("path"), learned: grown }), null);
});

test("the view: there and back, zooming about a place, never out of sight", () => {
  const view = fitted(LANDSCAPE, [1000, 600]);
  const back = onSheet(view, onScreen(view, [123.4, 567.8]));
  assert.ok(Math.abs(back[0] - 123.4) < 1e-9 && Math.abs(back[1] - 567.8) < 1e-9);
  const place = onSheet(view, [300, 200]);
  const near = onScreen(zoomed(view, [300, 200], 3), place);
  assert.ok(Math.abs(near[0] - 300) < 1e-9 && Math.abs(near[1] - 200) < 1e-9);
  const away = held(panned(view, 1e6, -1e6), LANDSCAPE, [1000, 600]);
  assert.ok(away.x === 940 && away.y + 1252 * away.scale >= 60 - 1e-9);
});

test("a stroke more is told from any other change, so that the ink is not drawn anew", () => {
  const one = withStroke(blank(LANDSCAPE), [[1, 1], [2, 2]], 5);
  const two = withStroke(one, [[5, 5]], 5);
  assert.ok(oneMore(one, two) && !oneMore(two, one) && !oneMore(one, one));
  assert.ok(!oneMore(one, withGoal(one, [3, 3])));
  assert.ok(!oneMore(one, { ...two, strokes: [two.strokes[1], two.strokes[0]] }));
});

test("the trail grows by steps and stays bounded", () => {
  let trail = [];
  for (let i = 0; i < 20000; i += 1) trail = trailed(trail, [i * 4, 0]);
  assert.ok(trail.length <= 4000 && trail.at(-1)[0] === 19999 * 4 && trail[0][0] === 0);
  assert.equal(trailed(trail, [19999 * 4 + 1, 0]), trail);
  assert.equal(trailed(trail, undefined), trail);
});

/** The names of the calls that draw a feed with these shapes. */
function drawn(scene, shows, lasting = null) {
  const calls = [];
  const context = new Proxy({}, { get: (_, name) => () => calls.push(name), set: () => true });
  const sheet = { wipe: () => context, px: (n) => n, colors: {} };
  drawFeed(sheet, { feed: { scene }, trail: [], cloud: null, lasting, walls: null }, shows, [100, 100]);
  return (name) => calls.filter((call) => call === name).length;
}

test("each shape of a navigator is drawn, and a setting hides those of its colour", () => {
  const points = [[1, 2], [3, 4]];
  const scene = [
    { shape: "line", points, color: "plan", stroke: "dashed" }, { shape: "dots", points, color: "scan" },
    { shape: "area", points, color: "edge" }, { shape: "rings", points, color: "goal" },
    { shape: "discs", points, color: "goal" }, { shape: "text", at: [1, 2], text: "3", color: "ink" },
  ];
  const lasting = [{ shape: "dots", points, color: "seen" }];
  const all = drawn(scene, { scan: true, plan: true }, lasting);
  assert.deepEqual(["rect", "arc", "stroke", "fill", "fillText"].map(all), [4, 4, 3, 5, 1]);
  const few = drawn(scene, { scan: false, plan: false }, lasting);
  assert.deepEqual(["rect", "arc", "stroke", "fill", "fillText"].map(few), [0, 4, 2, 3, 1]);
});

test("particles are carried along with the robot, turned as it turns", () => {
  const cloud = { points: [[110, 50]], pose: { x: 100, y: 50, heading_rad: 0 } };
  const [[x, y]] = carried(cloud, { x: 200, y: 80, heading_rad: Math.PI / 2 });
  // A particle ten pixels ahead, to the right, is then ten pixels ahead, upwards.
  assert.ok(Math.abs(x - 200) < 1e-9 && Math.abs(y - 70) < 1e-9, `${x} ${y}`);
  assert.equal(carried(null, { x: 0, y: 0, heading_rad: 0 }), null);
  assert.equal(carried(cloud, null), null);
});

test("settings of another kind fall back to the defaults", () => {
  const settings = merged({ width_px: "wide", hold: false, shows: { scan: false, plan: 3 }, more: 1 });
  assert.deepEqual(settings, { width_px: 5, hold: false, snap: true, fingers: true, shows: { particles: true, scan: false, plan: true, trail: true, walls: false, learned: true } });
});

/** The contrast of two colours `#rrggbb` according to WCAG. */
function contrast(...colors) {
  const [light, dark] = colors.map((color) => {
    const [r, g, b] = [1, 3, 5].map((i) => parseInt(color.slice(i, i + 2), 16) / 255)
      .map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  }).sort((a, b) => b - a);
  return (light + 0.05) / (dark + 0.05);
}

test("contrast is AA in both themes: 4.5 for text, 3 for lines that tell something", () => {
  const style = readFileSync(new URL("../../services/pad/page/style.css", import.meta.url), "utf8");
  const blocks = [...style.matchAll(/:root(?:, #sheet\.lit)? \{([^}]*)\}/g)].map(([, body]) => (
    Object.fromEntries([...body.matchAll(/--([a-z-]+): (#[0-9a-f]{6})/g)].map(([, name, value]) => [name, value]))
  ));
  assert.equal(blocks.length, 3, "the light page, its paper, and both in the dark");
  const themes = [{ ...blocks[0], ...blocks[1] }, blocks[2]];
  const texts = ["text page", "text panel", "quiet page", "quiet panel", "text soft", "accent-text accent", "danger-text danger", "warn-text warn", "danger panel", "obstacle-text obstacle", "goal-text goal"];
  const lines = ["ink paper", "obstacle paper", "goal paper", "start paper", "select paper", "guide paper", "robot paper", "scan paper", "plan paper", "accent page", "accent panel", "good panel"];
  for (const theme of themes) {
    for (const [pairs, least] of [[texts, 4.5], [lines, 3]]) {
      for (const pair of pairs) {
        const ratio = contrast(...pair.split(" ").map((name) => theme[name]));
        assert.ok(ratio >= least, `${pair}: expected ${least}, found ${ratio.toFixed(2)}`);
      }
    }
  }
});

test("a robot that asks is answered by who drives, at the place that a tap means", () => {
  const question = { text: "Is the robot at A or B? Tap where it is.", places: [{ name: "A", at: [100, 100] }, { name: "B", at: [300, 100] }] };
  const asks = { ...feed("paused", "here", "restore", "abort"), drives: true, question };
  assert.ok(isAsked(asks));
  assert.ok(!isAsked({ ...asks, drives: false }) && !isAsked({ ...asks, allowed: ["abort"] }) && !isAsked({ ...asks, question: undefined }));
  assert.equal(advice(page({ feed: asks, watches: true })), question.text);
  assert.match(advice(page({ feed: asks, drives: false })), /The page that drives answers/);
  assert.equal(headline(page({ feed: asks })), "Where is the robot?");
  assert.deepEqual(meant(question, [310, 95], 28), [300, 100]);
  assert.deepEqual(meant(question, [200, 100], 28), [200, 100]);
  assert.deepEqual(meant({ places: [] }, [7, 8], 28), [7, 8]);
});
