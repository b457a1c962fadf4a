// Tests a start without a mark, on the running system: `node unmarked.mjs URL DRAWING.svg OUT`.
// Environment: SKETCHNAV_PLAYWRIGHT (the folder of node_modules), SKETCHNAV_CHROMIUM.
//
// Draws the walls of a drawing and a goal, but no start. The robot finds out where it is, and arrives. Saves screenshots in OUT.
// Fails at the first violation.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";

import { BROWSER, LIMIT_MS, assertNoFaults, chromium, inTurn, opened } from "./visit.mjs";

const [url, drawingFile, out] = process.argv.slice(2);
const CANVAS = [2540, 1252];
const [, outline] = readFileSync(drawingFile, "utf8").match(/<path d="M([^"]+) Z"/);
const corners = outline.split(/ L?/).map(Number);
const onCanvas = ([x, y]) => [400 + 2.2 * x, 40 + 2.2 * y];
const walls = corners.flatMap((x, i) => (i % 2 ? [] : [onCanvas([x, corners[i + 1]])]));
const LIBRARY = onCanvas([100, 110]);

const browser = await chromium.launch(BROWSER);
let page = null;
let hand = null;

const says = async (id, words) => {
  await page.waitForFunction(
    ([where, what]) => document.getElementById(where).textContent.includes(what), [id, words], { timeout: LIMIT_MS },
  );
};
const press = (id) => page.click(`#${id}:enabled`);
const text = (id) => page.locator(`#${id}`).textContent();

async function draws() {
  const context = await browser.newContext({ viewport: { width: 1500, height: 900 } });
  ({ page, hand } = await opened(context, url, CANVAS));
  await says("headline", "No map yet");
  await hand.menu("new-landscape");
  await hand.look();
  await hand.draw([...walls, walls[0]]);
  await press("send-sketch");
  await says("headline", "Map sent");
  assert.match(await text("advice"), /Without a mark, the robot has to find out where it is/);
  await hand.tool("goal");
  await hand.tap(LIBRARY);
}

async function finds() {
  await press("send-path");
  await says("headline", "Path sent");
  const before = await hand.pixels("feed");
  await press("execute");
  await says("headline", "Driving");
  // What it has seen is shown on the drawing, and stays there.
  const end = Date.now() + LIMIT_MS;
  while ((await hand.pixels("feed")) === before) {
    assert.ok(Date.now() < end, "nothing of what the robot has seen is shown");
    await hand.settled();
  }
  await hand.settled();
  assert.notEqual(await hand.pixels("feed"), before);
  await page.screenshot({ path: join(out, "unmarked-driving.png") });
  await says("headline", "Finished");
  await says("task", "1 of 1 task reached");
  await page.screenshot({ path: join(out, "unmarked-arrived.png") });
}

try {
  await inTurn([draws, finds], (step) => step(), () => page, out);
  assertNoFaults(/^$/);
} finally {
  await browser.close();
}
