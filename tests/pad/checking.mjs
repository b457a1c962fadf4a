// Acts as a person whose drawing is checked before a robot drives by it: `node checking.mjs URL OUT`.
// Environment: SKETCHNAV_PLAYWRIGHT (the folder of node_modules), SKETCHNAV_CHROMIUM.
//
// With mouse, fingers and keys, draws paths through walls, closed rooms and rooms that look alike, checks the page's warnings and
// marks, and corrects the drawing. Sends a goal that is named after its room. Saves screenshots in OUT. Fails at the first
// violation.

import assert from "node:assert/strict";
import { join } from "node:path";

import { BROWSER, assertNoFaults, chromium, inTurn, opened } from "./visit.mjs";


const [url, out] = process.argv.slice(2);
const CANVAS = [2540, 1252];
const browser = await chromium.launch(BROWSER);

const wall = (...points) => ({ points, width_px: 5 });
/** Two rooms of the same shape above a corridor, with one door each, and a third room without a door. */
const FLOOR = {
  canvas: CANVAS,
  strokes: [
    wall([200, 200], [2300, 200], [2300, 1100], [200, 1100], [200, 200]),
    wall([200, 700], [450, 700]), wall([550, 700], [1150, 700]), wall([1250, 700], [2300, 700]),
    wall([900, 200], [900, 700]), wall([1600, 200], [1600, 700]),
  ],
  labels: [{ text: "kitchen", at: [550, 320] }, { text: "store", at: [1950, 450] }],
  start: { at: [300, 900], heading_deg: 0 },
};

class Person {
  constructor(page, hand) {
    Object.assign(this, { page, hand });
  }

  /** Waits until the page reports exactly these faults of the drawing. */
  async doubts(...words) {
    try {
      await this.page.waitForFunction((wanted) => {
        const found = [...document.querySelectorAll("#doubts li")].map((item) => item.textContent);
        return found.length === wanted.length && wanted.every((what, i) => found[i].includes(what));
      }, words);
    } catch (error) {
      const found = await this.page.locator("#doubts li").allTextContents();
      throw new Error(`expected ${JSON.stringify(words)}, found ${JSON.stringify(found)}`, { cause: error });
    }
  }

  /** Whether a place on the sheet is marked, that is, the pixels above it show its ring. */
  async isMarked(point) {
    await this.hand.settled();
    const { x, y } = this.hand.at(point);
    return this.page.evaluate(([px, py]) => {
      const canvas = document.querySelector("#sheet canvas.marks");
      const { left, top, width } = canvas.getBoundingClientRect();
      const ratio = canvas.width / width;
      const [r, g, b, alpha] = canvas.getContext("2d").getImageData((px - left) * ratio, (py - top - 20) * ratio, 1, 1).data;
      return alpha > 200 && r > 150 && g < 150 && b < 150;
    }, [x, y]);
  }

  async floor(drawing = FLOOR) {
    await this.hand.open("floor.json", JSON.stringify(drawing));
    await this.page.focus("#sheet");
    await this.page.keyboard.press("0");
    await this.hand.look();
  }
}

async function visit(context) {
  const { page, hand } = await opened(context, url, CANVAS);
  return new Person(page, hand);
}

async function waysThroughWalls(me) {
  await me.floor();
  await me.doubts();
  await me.hand.tool("path");
  await me.hand.drag([[300, 900], [700, 900], [700, 500]]);
  await me.doubts("The path goes through a wall.", "No way leads to “store”.");
  assert.ok(await me.isMarked([700, 700]), "the wall is marked where the path meets it");
  await me.page.click("#undo");
  await me.doubts();
  await me.hand.drag([[300, 900], [500, 850], [500, 500]]);
  await me.doubts("No way leads to “store”.");
  assert.ok(!await me.isMarked([500, 700]), "a door is no wall");
  await me.page.click("#undo");
}

async function roomsWithoutADoor(me) {
  await me.floor();
  await me.hand.tool("goal");
  await me.hand.tap([1900, 350]);
  await me.doubts("Goal 1 cannot be reached");
  assert.ok(await me.isMarked([1900, 350]));
  // A door fixes this.
  await me.hand.tool("door");
  await me.hand.drag([[1900, 700], [2000, 700]]);
  await me.doubts();
  assert.ok(!await me.isMarked([1900, 350]));
  await me.page.keyboard.press("Control+z");
  await me.doubts("Goal 1 cannot be reached");
  // With the keys, the goal is moved out of the wall in which it was placed.
  await me.hand.tool("select");
  await me.hand.tap([1900, 350]);
  await me.page.focus("#sheet");
  for (let i = 0; i < 6; i += 1) await me.page.keyboard.press("Shift+ArrowUp");
  await me.page.keyboard.press("Delete");
  await me.doubts();
}

async function roomsThatLookAlike(me) {
  await me.floor();
  await me.hand.tool("goal");
  await me.hand.tap([550, 450]);
  await me.hand.tap([1250, 450]);
  await me.doubts("No way leads to “store”.", "Goal 1 looks like goal 2", "Goal 2 looks like goal 1");
  assert.ok(await me.isMarked([1250, 450]));
  // A table in one of them tells them apart.
  await me.hand.tool("box");
  await me.hand.drag([[1300, 300], [1500, 550]]);
  await me.page.keyboard.press("Escape");
  await me.doubts("No way leads to “store”.");
}

/** A goal is named after its room when it is sent to the robot, and only then. */
async function goalsHaveTheNamesOfRooms(me) {
  await me.floor({ ...FLOOR, labels: FLOOR.labels.slice(0, 1) });
  await me.hand.tool("goal");
  await me.hand.tap([500, 500]);
  await me.hand.tap([1200, 900]);
  await me.page.click("#send-sketch:enabled");
  await me.page.waitForSelector("#send-path:enabled");
  const sent = me.page.waitForRequest((request) => request.url().endsWith("/api/path"));
  await me.page.click("#send-path");
  const { goals } = JSON.parse((await sent).postData());
  assert.equal(goals[0].name, "kitchen");
  assert.ok(Array.isArray(goals[1]), "the corridor has no name");
  await me.page.waitForFunction(() => /arrived/.test(document.getElementById("say").textContent));
  assert.deepEqual(JSON.parse(await me.hand.saved()).goals.map(({ name }) => name), [undefined, undefined]);
}

/** With a finger on a phone, and in both themes on a phone and on a desktop. */
async function byFingers() {
  const context = await browser.newContext({ viewport: { width: 360, height: 740 }, hasTouch: true, acceptDownloads: true, reducedMotion: "reduce" });
  const me = await visit(context);
  await me.floor();
  await me.hand.tool("goal");
  await me.hand.fingers("touchStart", [2050, 600]);
  await me.hand.fingers("touchEnd");
  await me.doubts("Goal 1 cannot be reached");
  assert.ok(await me.isMarked([2050, 600]));
  for (const [look, viewport] of [["phone", { width: 360, height: 740 }], ["wide", { width: 1500, height: 900 }]]) {
    await me.page.setViewportSize(viewport);
    await me.page.keyboard.press("0");
    for (const scheme of ["light", "dark"]) {
      await me.page.emulateMedia({ colorScheme: scheme });
      await me.hand.settled();
      await me.page.screenshot({ path: join(out, `checks-${look}-${scheme}.png`) });
    }
  }
  await context.close();
}

async function main() {
  const context = await browser.newContext({ viewport: { width: 1500, height: 900 }, hasTouch: true, acceptDownloads: true });
  const me = await visit(context);
  await me.page.click("#menu-button");
  await me.page.uncheck("#hold");
  await me.page.click("#menu-button");
  await inTurn([waysThroughWalls, roomsWithoutADoor, roomsThatLookAlike, byFingers, goalsHaveTheNamesOfRooms], (step) => step(me), () => me.page, out);
  await context.close();
  assertNoFaults(/WebSocket|ERR_CONNECTION|404/);
}

try {
  await main();
} finally {
  await browser.close();
}
