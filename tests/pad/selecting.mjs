// Acts as a person who selects with mouse, pen, fingers and keys on the running page: `node selecting.mjs URL OUT`.
// Environment: SKETCHNAV_PLAYWRIGHT (the folder of node_modules), SKETCHNAV_CHROMIUM.
//
// Uses each tool that changes existing items, checks what the page would save, and undoes the change. Sends a drawing, changes it,
// and sends it again. Saves screenshots in OUT: light and dark, wide and on a phone. Fails at the first violation.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";

import { inkWork } from "./figures.mjs";
import { BROWSER, assertNoFaults, chromium, inTurn, opened } from "./visit.mjs";

const [url, out] = process.argv.slice(2);
const CANVAS = [2540, 1252];
const browser = await chromium.launch(BROWSER);
const SCREEN = { width: 1500, height: 900 };

/** A room with items of every kind. */
const ROOM = {
  canvas: CANVAS,
  strokes: [
    { points: [[300, 200], [1300, 200]], width_px: 5 },
    { points: [[1300, 200], [1300, 900]], width_px: 5 },
    { points: [[300, 900], [300, 220]], width_px: 5 },
  ],
  obstacles: [
    { polygon: [[500, 400], [700, 400], [700, 500], [500, 500]], label: "table" },
    { polygon: [[900, 600], [1000, 600], [1000, 700], [900, 700]], label: "" },
  ],
  start: { at: [600, 750], heading_deg: 0 },
  goals: [{ name: "door", at: [1150, 350] }, { at: [1800, 900] }],
};

/** The drawing of a mission, for the screenshots. */
const COURT = JSON.parse(readFileSync(new URL("../../sim/missions/routes/court-01.json", import.meta.url), "utf8"));

async function visit(context) {
  const { page, hand } = await opened(context, url, CANVAS);
  // Pauses of a busy machine must not count as a hand that holds still.
  await page.click("#menu-button");
  await page.uncheck("#hold");
  await page.click("#menu-button");
  return new Person(page, hand);
}

/** A user of the page. */
class Person {
  constructor(page, hand) {
    Object.assign(this, { page, hand });
  }

  /** Begins with the room and the select tool. */
  async room(drawing = ROOM) {
    await this.hand.open("room.json", JSON.stringify(drawing));
    await this.page.focus("#sheet");
    await this.keys("0", "v");
    await this.hand.look();
    this.before = await this.hand.saved();
    await this.page.focus("#sheet");
  }

  async keys(...keys) {
    for (const key of keys) await this.page.keyboard.press(key);
  }

  /** Drags the mouse over places on the sheet, with keys held down. */
  async drag(places, ...held) {
    const [first, ...others] = places.map((place) => this.hand.at(place));
    for (const key of held) await this.page.keyboard.down(key);
    await this.page.mouse.move(first.x, first.y);
    await this.page.mouse.down();
    for (const { x, y } of others) await this.page.mouse.move(x, y, { steps: 4 });
    await this.page.mouse.up();
    for (const key of held) await this.page.keyboard.up(key);
  }

  async click(place, ...held) {
    await this.drag([place], ...held);
  }

  async press(does) {
    await this.page.click(`#selection [data-does="${does}"]`);
  }

  async drawing() {
    const saved = JSON.parse(await this.hand.saved());
    await this.page.focus("#sheet");
    return saved;
  }

  /** A single undo restores the room. */
  async undone(words) {
    await this.keys("Control+z");
    assert.equal(await this.hand.saved(), this.before, `${words}: undone with one step`);
    await this.page.focus("#sheet");
  }

  /** Requires that the points are within a screen pixel of their expected places. */
  near(found, wanted, words) {
    const least = 1.5 / this.hand.view.scale;
    assert.equal(found.length, wanted.length, words);
    const off = Math.max(...found.map((p, i) => Math.hypot(p[0] - wanted[i][0], p[1] - wanted[i][1])));
    assert.ok(off <= least, `${words}: expected ${JSON.stringify(wanted)} within ${least}, found ${JSON.stringify(found)}`);
  }

  /** Presses a button that sends a request, and waits for the answer. */
  async sends(id, words) {
    await this.hush();
    await this.page.click(`#${id}:enabled`);
    await this.page.waitForFunction((what) => document.getElementById("say").textContent.includes(what), words);
  }

  /** Removes the message that temporarily covers the sheet of a phone. */
  hush() {
    return this.page.evaluate(() => { document.getElementById("say").textContent = ""; });
  }

  async selected(count) {
    const shown = await this.page.locator("#selection").isVisible();
    assert.equal(shown, count > 0, count ? "something is selected" : "nothing is selected");
  }
}

const moved = (points, [dx, dy]) => points.map(([x, y]) => [x + dx, y + dy]);

// ---------------------------------------------------------------------------- what is selected, and moved

async function tapsAndDrags(me) {
  await me.room();
  await me.selected(0);
  await me.click([600, 450]);
  await me.selected(1);
  await me.drag([[600, 450], [610, 800]], "Control");
  let drawing = await me.drawing();
  me.near(drawing.obstacles[0].polygon, moved(ROOM.obstacles[0].polygon, [10, 350]), "a drag moves");
  assert.equal(drawing.obstacles[0].label, "table");
  await me.undone("a move");
  await me.click([1700, 300]);
  await me.selected(0);
  // A wall can be dragged without being selected first; with Shift, it moves along one axis.
  await me.drag([[800, 200], [830, 500]], "Shift");
  drawing = await me.drawing();
  me.near(drawing.strokes[0].points, moved(ROOM.strokes[0].points, [0, 300]), "Shift keeps the axis");
  await me.undone("a wall");
  await me.keys("Escape");
  await me.drag([[1150, 350], [1150, 600]], "Control");
  drawing = await me.drawing();
  assert.deepEqual([drawing.goals[0].name, drawing.goals.length], ["door", 2], "a goal keeps its name and its place in the row");
  me.near([drawing.goals[0].at], [[1150, 600]], "a goal");
  await me.undone("a goal");
}

async function marquees(me) {
  await me.room();
  await me.drag([[400, 300], [1100, 800]]);
  await me.keys("Delete");
  let drawing = await me.drawing();
  assert.deepEqual([drawing.obstacles.length, drawing.start, drawing.strokes.length, drawing.goals.length], [0, undefined, 3, 2], "what lies within whole");
  await me.undone("deleted");
  await me.selected(0);
  await me.click([600, 450]);
  await me.click([950, 650], "Shift");
  await me.drag([[650, 450], [650, 550]], "Control");
  drawing = await me.drawing();
  me.near(drawing.obstacles.flatMap((o) => o.polygon), moved(ROOM.obstacles.flatMap((o) => o.polygon), [0, 100]), "Shift adds");
  await me.undone("two");
  await me.click([600, 450], "Shift");
  await me.keys("Backspace");
  drawing = await me.drawing();
  assert.deepEqual(drawing.obstacles.map((o) => o.label), ["table"], "Shift takes away, too");
  await me.undone("one of two");
  await me.keys("Control+a", "Delete");
  drawing = await me.drawing();
  assert.deepEqual([drawing.strokes, drawing.obstacles, drawing.goals], [[], [], undefined]);
  await me.undone("everything");
  await me.keys("Control+a", "Escape");
  await me.selected(0);
}

async function copies(me) {
  await me.room();
  await me.click([600, 450]);
  await me.drag([[600, 450], [600, 800]], "Alt", "Control");
  let drawing = await me.drawing();
  me.near(drawing.obstacles[0].polygon, ROOM.obstacles[0].polygon, "what was copied stays");
  me.near(drawing.obstacles[2].polygon, moved(ROOM.obstacles[0].polygon, [0, 350]), "its copy moves");
  assert.equal(drawing.obstacles[2].label, "table");
  await me.undone("a copy by Alt");
  await me.click([600, 450]);
  await me.keys("Control+d", "Delete");
  assert.equal((await me.drawing()).obstacles.length, 2, "the copy is what is selected");
  await me.keys("Control+z", "Control+z");
  await me.click([600, 450]);
  await me.keys("Control+c", "Control+v", "Control+v");
  drawing = await me.drawing();
  assert.deepEqual(drawing.obstacles.map((o) => o.label), ["table", "", "table", "table"]);
  await me.keys("Control+z");
  await me.undone("two pasted");
  await me.click([600, 450]);
  await me.keys("Control+x");
  assert.equal((await me.drawing()).obstacles.length, 1);
  await me.undone("cut");
}

async function sizesAndTurns(me) {
  await me.room();
  const px = 1 / me.hand.view.scale;
  await me.click([600, 450]);
  await me.drag([[700 + 8 * px, 500 + 8 * px], [900 + 8 * px, 600 + 8 * px]]);
  let drawing = await me.drawing();
  me.near(drawing.obstacles[0].polygon, [[500, 400], [900, 400], [900, 600], [500, 600]], "a corner scales");
  await me.undone("a size");
  await me.drag([[700 + 8 * px, 500 + 8 * px], [900 + 8 * px, 500 + 8 * px]], "Shift");
  drawing = await me.drawing();
  me.near(drawing.obstacles[0].polygon, [[500, 400], [900, 400], [900, 600], [500, 600]], "Shift keeps the form");
  await me.undone("an even size");
  const stem = [600, 400 - 8 * px - 30 * px];
  await me.drag([stem, [700, 300], [900, 452]], "Shift");
  drawing = await me.drawing();
  me.near(drawing.obstacles[0].polygon, [[650, 350], [650, 550], [550, 550], [550, 350]], "the handle above turns");
  assert.equal(drawing.obstacles[0].label, "table");
  await me.undone("a turn");
  // The start is turned by the tip of its arrow.
  await me.click([600, 750]);
  await me.drag([[600 + 34 * px, 750], [640, 700], [600, 650]], "Shift");
  drawing = await me.drawing();
  assert.deepEqual(drawing.start, { at: [600, 750], heading_deg: 90 });
  await me.undone("a heading");
  // Escape cancels a gesture.
  const { x, y } = me.hand.at([600, 450]);
  await me.page.mouse.move(x, y);
  await me.page.mouse.down();
  await me.page.mouse.move(x + 80, y + 40, { steps: 3 });
  await me.keys("Escape");
  await me.page.mouse.up();
  assert.equal(await me.hand.saved(), me.before, "Escape in the middle of a drag");
}

// ---------------------------------------------------------------------------- with keys, fingers, pen

async function byKeys(me) {
  await me.room();
  // The start is last, since it is on top; the first stroke is first.
  await me.keys("n", "ArrowRight", "ArrowRight", "Shift+ArrowDown");
  assert.equal(await me.page.textContent("#selected"), "Wall selected", "for those who hear the page");
  let drawing = await me.drawing();
  const px = 1 / me.hand.view.scale;
  me.near(drawing.strokes[0].points, moved(ROOM.strokes[0].points, [2 * px, 5 * px]), "arrows move");
  await me.undone("arrows in a row");
  await me.keys("Escape", "N", "Period", "Period");
  drawing = await me.drawing();
  assert.equal(drawing.start.heading_deg, -30, "a key turns");
  await me.undone("turns in a row");
  await me.keys("Escape");
  await me.click([600, 450]);
  await me.keys("Alt+Shift+ArrowRight", "Alt+Shift+ArrowRight");
  drawing = await me.drawing();
  me.near(drawing.obstacles[0].polygon, [[500, 400], [700 + 10 * px, 400], [700 + 10 * px, 500], [500, 500]], "Alt and arrows scale");
  await me.undone("sizes in a row");
  // With the crosshair only, a marquee is drawn around the middle of the sheet.
  await me.keys("Escape", ...Array(4).fill("ArrowLeft"), " ", ...Array(6).fill("ArrowLeft"), ...Array(10).fill("ArrowDown"), " ");
  await me.keys("Escape");
  assert.equal(await me.hand.saved(), me.before, "a marquee changes nothing");
  await me.page.focus("#sheet");
  // The name of an obstacle.
  await me.click([950, 650]);
  await me.keys("F2");
  await me.page.fill("#label-text", "stool");
  await me.keys("Enter");
  assert.equal((await me.drawing()).obstacles[1].label, "stool");
  await me.undone("a name");
}

async function byFingersAndPen(me) {
  await me.room();
  const finger = async (...places) => {
    await me.hand.fingers("touchStart", places[0]);
    for (const place of places.slice(1)) await me.hand.fingers("touchMove", place);
    await me.hand.fingers("touchEnd");
  };
  await finger([600, 450]);
  await me.selected(1);
  await me.press("adds");
  await finger([950, 650]);
  await finger([600, 450], [620, 480], [640, 550]);
  let drawing = await me.drawing();
  const by = [drawing.obstacles[0].polygon[0][0] - 500, drawing.obstacles[0].polygon[0][1] - 400];
  assert.ok(by[1] > 80, "a finger moves");
  me.near(drawing.obstacles[1].polygon, moved(ROOM.obstacles[1].polygon, by), "what was added comes along");
  await me.undone("by a finger");
  await me.hand.tap([1150, 350]);
  await me.hand.drag([[1150, 350], [1160, 400], [1180, 480]]);
  drawing = await me.drawing();
  me.near([drawing.goals[0].at], [[1180, 480]], "a pen moves");
  await me.undone("by the pen");
  // After the pen, one finger still selects, and two fingers zoom.
  await finger([1700, 300]);
  await finger([600, 450]);
  await me.press("remove");
  assert.equal((await me.drawing()).obstacles.length, 1);
  await me.undone("by a finger after the pen");
  await me.hand.fingers("touchStart", [600, 450]);
  await me.hand.fingers("touchStart", [600, 450], [900, 450]);
  await me.hand.fingers("touchMove", [500, 450], [1000, 450]);
  await me.hand.fingers("touchEnd");
  assert.equal(await me.hand.saved(), me.before, "two fingers move nothing");
}

// ---------------------------------------------------------------------------- points, groups, walls

async function editsPoints(me) {
  await me.room();
  await me.click([800, 200]);
  // The ends of a straight wall have handles immediately; with Shift, the wall snaps to multiples of 15°.
  await me.drag([[1300, 200], [1290, 1100]], "Shift");
  let drawing = await me.drawing();
  me.near([drawing.strokes[0].points[0]], [[300, 200]], "the other end stays");
  const [[x0, y0], [x1, y1]] = drawing.strokes[0].points;
  assert.ok(Math.abs(Math.atan2(y1 - y0, x1 - x0) - Math.PI / 4) < 1e-3, "45°");
  await me.undone("an end of a wall");
  await me.keys("Enter");
  await me.drag([[1300, 200], [1400, 260]], "Control");
  drawing = await me.drawing();
  me.near(drawing.strokes[0].points, [[300, 200], [1400, 260]], "a point moves");
  await me.undone("a point");
  await me.drag([[800, 200], [800, 340]], "Control");
  drawing = await me.drawing();
  me.near(drawing.strokes[0].points, [[300, 200], [800, 340], [1300, 200]], "a drag of the line adds one");
  await me.keys("Delete");
  drawing = await me.drawing();
  me.near(drawing.strokes[0].points, [[300, 200], [1300, 200]], "and Delete removes it");
  await me.keys("Control+z");
  await me.undone("added");
  // With the keys: the next point, one more, moved.
  await me.keys("n", "n", "i", "Shift+ArrowDown");
  drawing = await me.drawing();
  assert.equal(drawing.strokes[0].points.length, 3);
  await me.keys("Control+z");
  await me.undone("by keys");
  await me.keys("Escape");
  await me.selected(1);
  await me.keys("Escape");
  await me.selected(0);
  // A double tap on an obstacle edits its corners, and it remains an obstacle.
  await me.hand.twice([950, 650]);
  await me.drag([[1000, 700], [1100, 800]], "Control");
  drawing = await me.drawing();
  me.near(drawing.obstacles[1].polygon, [[900, 600], [1000, 600], [1100, 800], [900, 700]], "a corner");
  await me.undone("a corner");
  // The route has points as well.
  await me.room({ ...ROOM, goals: [], route: [[400, 800], [600, 850], [900, 800]], start: undefined });
  await me.click([500, 826]);
  await me.keys("Enter");
  await me.drag([[600, 850], [600, 600]], "Control");
  drawing = await me.drawing();
  me.near(drawing.route, [[400, 800], [600, 600], [900, 800]], "a point of the route");
  await me.undone("a point of the route");
}

async function groupsAndAligns(me) {
  await me.room();
  await me.click([600, 450]);
  await me.click([950, 650], "Shift");
  await me.keys("Control+g", "Escape");
  await me.drag([[950, 650], [950, 750]], "Control");
  let drawing = await me.drawing();
  me.near(drawing.obstacles[0].polygon, moved(ROOM.obstacles[0].polygon, [0, 100]), "a group moves as one");
  assert.deepEqual(drawing.pad.groups, [{ strokes: [], obstacles: [0, 1] }]);
  await me.keys("Control+Shift+g", "Escape");
  await me.keys("Control+z", "Control+z");
  await me.undone("a group");
  await me.click([600, 450]);
  await me.click([950, 650], "Shift");
  await me.page.click('[popovertarget="arrange"]');
  await me.press("align left");
  drawing = await me.drawing();
  assert.deepEqual(drawing.obstacles.map((o) => o.polygon[0][0]), [500, 500]);
  await me.undone("aligned");
  await me.keys("Control+Shift+ArrowDown");
  drawing = await me.drawing();
  assert.deepEqual(drawing.obstacles.map((o) => o.polygon[2][1]), [700, 700]);
  await me.undone("aligned by keys");
  await me.keys("Control+a", "Alt+h");
  assert.notEqual(await me.hand.saved(), me.before);
  await me.undone("spread");
}

async function snapsAndCloses(me) {
  await me.room();
  // A line that ends near another end snaps to it, and one that is nearly vertical becomes vertical. With Ctrl, neither happens.
  await me.keys("l");
  await me.drag([[306, 895], [700, 895], [1294, 905]]);
  let drawing = await me.drawing();
  assert.deepEqual(drawing.strokes[3].points, [[300, 900], [1300, 900]]);
  await me.undone("a wall between two ends");
  await me.drag([[306, 895], [1294, 905]], "Control");
  drawing = await me.drawing();
  me.near(drawing.strokes[3].points, [[306, 895], [1294, 905]], "Ctrl");
  await me.undone("a wall without snapping");
  await me.drag([[1600, 300], [1610, 800]]);
  drawing = await me.drawing();
  assert.equal(drawing.strokes[3].points[0][0], drawing.strokes[3].points[1][0], "upright");
  await me.undone("an upright wall");
  // Moved items snap to the ends of the others.
  await me.keys("v");
  await me.drag([[300, 500], [300, 484]]);
  drawing = await me.drawing();
  assert.deepEqual(drawing.strokes[2].points, [[300, 880], [300, 200]], "a wall that is moved closes the corner");
  await me.undone("moved");
  await me.click([300, 500]);
  await me.press("gaps");
  drawing = await me.drawing();
  assert.deepEqual(drawing.strokes[2].points, [[300, 900], [300, 200]]);
  await me.undone("a gap");
}

async function opensDoorsAndBends(me) {
  await me.room();
  await me.keys("d");
  await me.drag([[700, 205], [800, 196], [900, 204]]);
  let drawing = await me.drawing();
  const [left, right] = [drawing.strokes[0].points, drawing.strokes[1].points];
  me.near([...left, ...right], [[300, 200], [700, 200], [900, 200], [1300, 200]], "a door");
  await me.undone("a door");
  await me.drag([[1600, 400], [1800, 400]]);
  assert.equal(await me.hand.saved(), me.before, "no wall, no door");
  await me.page.focus("#sheet");
  await me.keys("a");
  await me.drag([[1600, 400], [2000, 400]]);
  await me.click([1800, 600]);
  drawing = await me.drawing();
  const { points } = drawing.strokes[3];
  me.near([points[0], points.at(-1)], [[1600, 400], [2000, 400]], "the ends of an arc");
  assert.ok(points.length > 20 && points.every(([x, y]) => Math.abs(Math.hypot(x - 1800, y - 400) - 200) < 4), "a half circle");
  await me.undone("an arc");
  await me.keys("o");
  await me.drag([[1600, 400], [1800, 420]], "Shift");
  await me.page.fill("#label-text", "pillar");
  await me.keys("Enter");
  drawing = await me.drawing();
  const [pillar] = drawing.obstacles.slice(2);
  assert.ok(pillar.label === "pillar" && pillar.polygon.every(([x, y]) => Math.abs(Math.hypot(x - 1700, y - 500) - 100) < 3), "a circle with Shift");
  await me.keys("Control+z");
  await me.undone("a pillar");
  // Switching from the eraser to another tool shows the drawing, even if the eraser was not used.
  await me.keys("e", "p", "e");
  await me.drag([[600, 450]]);
  await me.keys("p");
  const [shown, saved] = [await me.hand.pixels("marks"), await me.hand.saved()];
  await me.hand.open("again.json", saved);
  assert.equal(await me.hand.pixels("marks"), shown, "what was erased stays erased");
}

/** The tools for obstacles, goals and the start, used as by a person. */
async function drawsBoxesGoalsAndAStart(me) {
  await me.room();
  await me.keys("b");
  await me.drag([[1500, 300], [1700, 380]]);
  await me.page.fill("#label-text", "bench");
  await me.keys("Enter", "b");
  await me.drag([[1900, 300], [2100, 320]], "Shift");
  await me.keys("Enter", "g");
  await me.click([2000, 800]);
  await me.keys("s");
  await me.drag([[1600, 900], [1600, 800]]);
  await me.keys("y");
  for (const corner of [[1500, 600], [1700, 600], [1600, 700], [1500, 600]]) await me.click(corner);
  await me.keys("Enter");
  const { obstacles, goals, start } = await me.drawing();
  me.near(obstacles[2].polygon, [[1500, 300], [1700, 300], [1700, 380], [1500, 380]], "a box");
  me.near(obstacles[3].polygon, [[1900, 300], [2100, 300], [2100, 500], [1900, 500]], "a square with Shift");
  me.near(obstacles[4].polygon, [[1500, 600], [1700, 600], [1600, 700]], "a shape by its corners");
  me.near([goals[2].at, start.at], [[2000, 800], [1600, 900]], "marks");
  assert.deepEqual([obstacles[2].label, Math.round(start.heading_deg)], ["bench", 90]);
}

// ---------------------------------------------------------------------------- what the robot is sent

/** The changed drawing is sent again and accepted, and another page shows it with its groups. */
async function sendsWhatWasChanged(me) {
  await me.room();
  await me.sends("send-sketch", "The map has arrived");
  await me.sends("send-path", "The goals have arrived");
  await me.page.focus("#sheet");
  await me.click([600, 450]);
  await me.click([950, 650], "Shift");
  await me.keys("Control+g", "Shift+ArrowDown", "Escape");
  await me.drag([[1800, 900], [1150, 700]], "Control");
  await me.keys("Escape");
  await me.click([600, 750]);
  await me.keys("Period");
  await me.sends("send-sketch", "The map has arrived");
  await me.sends("send-path", "The goals have arrived");
  const drawing = await me.drawing();
  const context = await browser.newContext({ acceptDownloads: true });
  const other = await visit(context);
  await other.page.waitForFunction(() => document.getElementById("link-role").textContent === "You draw");
  assert.deepEqual(await other.drawing(), drawing, "the other page");
  await context.close();
  assert.deepEqual([drawing.pad.groups.length, drawing.start.heading_deg, drawing.goals[0].name], [1, -15, "door"]);
}

/** While the robot drives, the drawing can be changed but not sent, and Escape stops the robot before it deselects. */
async function changesWhileItDrives(me) {
  const says = (words) => me.page.waitForFunction((what) => document.getElementById("headline").textContent === what, words);
  await me.room({ ...COURT, start: { at: [382, 1008], heading_deg: 0 }, goals: [{ at: [2150, 1000] }] });
  await me.sends("send-sketch", "The map has arrived");
  await me.sends("send-path", "The goal has arrived");
  await me.page.click("#execute:enabled");
  await says("Driving");
  await me.page.focus("#sheet");
  await me.click([700, 750]);
  await me.keys("ArrowRight");
  assert.equal(await me.page.locator("#send-sketch").isEnabled(), false, "no map is sent under a robot that drives");
  await me.keys("Escape");
  await says("Stopped");
  await me.selected(1);
  await me.keys("Escape");
  await me.selected(0);
  // The robot continues in the changed map from its current position.
  const before = await me.drawing();
  await me.sends("send-sketch", "The start is now where the robot stands.");
  const after = await me.drawing();
  const off = Math.hypot(after.start.at[0] - before.start.at[0], after.start.at[1] - before.start.at[1]);
  assert.ok(off > 0 && after.start.at.every((c, i) => c > 0 && c < CANVAS[i]), `${JSON.stringify(after.start)}`);
  assert.deepEqual(after.goals, before.goals);
  await me.sends("send-path", "The goal has arrived");
  await me.page.click("#execute:enabled");
  await says("Finished");
  assert.match(await me.page.textContent("#task"), /1 of 1 task reached/);
}

// ---------------------------------------------------------------------------- the look, and the work

/** For any selection, every button has a name and is large enough for a finger, and nothing is wider than the screen. */
async function isAtHand({ page }, words) {
  const small = await page.evaluate(() => [...document.querySelectorAll("button")].filter((b) => b.checkVisibility())
    .map((b) => [b.id || b.dataset.tool || b.dataset.does, b.getBoundingClientRect(), b.ariaLabel || b.innerText.trim() || b.title])
    .filter(([, box, name]) => box.width < 43.5 || box.height < 43.5 || !name || box.left < 0 || box.right > innerWidth).map(([id]) => id));
  assert.deepEqual(small, [], `${words}: buttons below 44 px, without a name, or beside the screen`);
  const wide = await page.evaluate(() => document.documentElement.scrollWidth) - page.viewportSize().width;
  assert.ok(wide <= 0, `${words}: the page is ${wide} px wider than the screen`);
  const hidden = await page.evaluate(() => document.querySelector("#tools").scrollHeight - document.querySelector("#tools").clientHeight);
  assert.ok(hidden <= 0, `${words}: ${hidden} px of the tools are beyond the screen`);
}

/** Light and dark, on a desktop and on a phone: takes screenshots, and checks what must hold in all of them. */
async function looksRight(me) {
  for (const [name, width, height] of [["wide", 1500, 800], ["phone", 360, 740]]) {
    for (const colorScheme of ["light", "dark"]) {
      const picture = (what) => me.page.screenshot({ path: join(out, `${what}-${name}-${colorScheme}.png`) });
      await me.page.setViewportSize({ width, height });
      await me.page.emulateMedia({ colorScheme });
      await me.room(COURT);
      await me.drag([[1350, 192], [2130, 540]]);
      await isAtHand(me, name);
      await me.hush();
      await picture("select");
      await me.keys("Escape", "t");
      await me.click([700, 400]);
      await isAtHand(me, `${name}, a text`);
      await picture("text");
      await me.keys("Enter", "v");
      await me.click([700, 750]);
      await me.keys("Enter");
      await isAtHand(me, `${name}, points`);
      await picture("points");
      await me.keys("?");
      await isAtHand(me, `${name}, keys`);
      await picture("keys");
      await me.page.click("#menu-button");
      await me.page.focus("#sheet");
      await me.keys("Control+a");
      await me.page.click('[popovertarget="arrange"]');
      await isAtHand(me, `${name}, everything`);
      await picture("arrange");
      await me.keys("Escape", "Escape");
    }
  }
  await me.page.setViewportSize(SCREEN);
  await me.page.emulateMedia({ colorScheme: null });
}

/** Each button of the bar can be reached by Tab and shows the focus. */
async function isReached(me) {
  await me.room();
  await me.keys("Control+a");
  const wanted = await me.page.locator("#selection > button:visible").count();
  const reached = new Set();
  for (let i = 0; i < 40 && reached.size < wanted; i += 1) {
    await me.keys("Tab");
    const found = await me.page.evaluate(() => {
      const e = document.activeElement;
      return e.closest("#selection") && { name: e.ariaLabel, shown: getComputedStyle(e).outlineStyle !== "none" };
    });
    if (!found) continue;
    assert.ok(found.shown, `focus is not seen on ${found.name}`);
    reached.add(found.name);
  }
  assert.equal(reached.size, wanted, [...reached].join());
  await me.page.focus('#selection [data-does="remove"]');
  await me.keys("Enter");
  assert.equal(await me.page.evaluate(() => document.activeElement.id), "sheet", "the focus is not lost with the button");
}

/** Selecting among many strokes does not draw any ink. Afterwards, the pen draws only its own segments. */
async function drawsNoMoreThanItMust(me) {
  const strokes = Array.from({ length: 500 }, (_, i) => {
    const [x, y] = [((i % 25) + 0.2) * (CANVAS[0] / 25), (Math.floor(i / 25) + 0.2) * (CANVAS[1] / 20)];
    return { points: Array.from({ length: 20 }, (__, k) => [x + k * 2, y + ((k * 7 + i) % 11)]), width_px: 5 };
  });
  await me.room({ canvas: CANVAS, strokes });
  const inks = () => me.page.evaluate(() => window.inkCounts.counts["ink.clearRect"] ?? 0);
  const before = await inks();
  await me.drag([[90, 45], [1000, 600]]);
  await me.keys("Escape");
  await me.hand.settled();
  assert.equal(await inks(), before, "a marquee among 500 strokes draws no ink");
  await me.keys("p");
  const work = () => me.page.evaluate(() => window.inkCounts.counts["live.stroke"] ?? 0);
  await me.hand.settled();
  const strokesBefore = await work();
  await me.hand.drag([[10, 10], [200, 15], [400, 10]], () => me.hand.settled());
  assert.equal(await work() - strokesBefore, 2, "the pen draws its own segments and nothing else");
}

/** Texts that name places are written, changed, moved and undone. */
async function writesTexts(me) {
  const texts = async () => ((await me.drawing()).labels ?? []).map(({ text, at }) => [text, ...at.map((c) => Math.round(c / 20) * 20)]);
  await me.room();
  await me.keys("t");
  await me.click([800, 300]);
  await me.page.fill("#label-text", "kitchen");
  await me.keys("Enter");
  assert.deepEqual(await texts(), [["kitchen", 800, 300]]);
  await me.undone("a text");
  await me.keys("Control+Shift+z", "v");
  await me.click([800, 300]);
  await me.selected(1);
  await me.keys("F2");
  await me.page.fill("#label-text", "pantry");
  await me.keys("Enter");
  await me.drag([[800, 300], [900, 260], [1000, 300]]);
  assert.deepEqual(await texts(), [["pantry", 1000, 300]], "changed and moved");
  await me.keys("Control+z", "Control+z");
  assert.deepEqual(await texts(), [["kitchen", 800, 300]], "one step each");
  await me.undone("all of it");
}

async function main() {
  const context = await browser.newContext({ viewport: SCREEN, hasTouch: true, acceptDownloads: true });
  await context.addInitScript(inkWork);
  const me = await visit(context);
  await inTurn([
    looksRight, tapsAndDrags, marquees, copies, sizesAndTurns, byKeys, editsPoints, groupsAndAligns, snapsAndCloses, opensDoorsAndBends, drawsBoxesGoalsAndAStart, writesTexts, isReached,
    drawsNoMoreThanItMust, sendsWhatWasChanged, changesWhileItDrives, byFingersAndPen,
  ], (step) => step(me), () => me.page, out);
  await context.close();
  assertNoFaults(/WebSocket|ERR_CONNECTION|404/);
}

try {
  await main();
} finally {
  await browser.close();
}
