// Tests a robot that learns, on the running system: `node learning.mjs URL DRAWING.svg OUT`.
// Environment: SKETCHNAV_PLAYWRIGHT (the folder of node_modules), SKETCHNAV_CHROMIUM.
//
// Draws the walls of a drawing with a pen, marks the start and two goals, and lets the robot drive. Watches the corrected drawing
// grow on the way, also on a second page. Then looks at the learned map, accepts it, and lets the robot drive back without a marked
// start. Then rejects the additions of the second drive, and finally the whole map. Saves screenshots in OUT. Fails at the first
// violation.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";

import { BROWSER, LIMIT_MS, assertNoFaults, chromium, inTurn, opened } from "./visit.mjs";

const [url, drawingFile, out] = process.argv.slice(2);
const CANVAS = [2540, 1252];
const numbers = (text) => text.split(/[ ,]+/).map(Number);
const pairs = (list) => list.flatMap((x, i) => (i % 2 ? [] : [[x, list[i + 1]]]));
const walls = [...readFileSync(drawingFile, "utf8").matchAll(/<polyline points="([^"]+)"/g)].map(([, text]) => pairs(numbers(text)));
const [START, FIRST, SECOND] = [[234, 600], [463, 323], [731, 307]];

const browser = await chromium.launch(BROWSER);
let page = null;
let hand = null;

const says = async (id, words) => {
  await page.waitForFunction(
    ([where, what]) => document.getElementById(where).textContent.includes(what), [id, words], { timeout: LIMIT_MS },
  );
};
const press = (id) => page.click(`#${id}:enabled`);

async function draws() {
  const context = await browser.newContext({ viewport: { width: 1500, height: 900 } });
  ({ page, hand } = await opened(context, url, CANVAS));
  await says("headline", "No map yet");
  await hand.menu("new-landscape");
  await hand.look();
  for (const wall of walls) await hand.draw(wall);
  await hand.tool("start");
  await hand.drag([START, [START[0] + 200, START[1]]]);
  await hand.tool("goal");
  for (const goal of [FIRST, SECOND]) await hand.tap(goal);
}

async function drives() {
  await press("send-sketch");
  await says("headline", "Map sent");
  await press("send-path");
  await says("headline", "Path sent");
  assert.equal(await page.locator("#learned").isVisible(), false, "nothing was learned yet");
  const { page: other } = await opened(await browser.newContext(), url, CANVAS);
  await press("execute");
  await says("headline", "Driving");
  await grows(other);
  await says("headline", "Finished");
  await says("task", "2 of 2 tasks reached");
}

/** Numbers of dark and of grey pixels of the corrected drawing: walls that were seen, and those as drawn. */
const walled = () => page.evaluate(async () => {
  const picture = document.getElementById("corrected-picture");
  while (!picture.complete || picture.naturalWidth === 0) await new Promise(requestAnimationFrame);
  const canvas = Object.assign(document.createElement("canvas"), { width: picture.naturalWidth, height: picture.naturalHeight });
  const context = canvas.getContext("2d");
  context.drawImage(picture, 0, 0);
  const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
  const tones = Array.from({ length: data.length / 4 }, (_, i) => data.slice(4 * i, 4 * i + 3).join());
  return ["28,28,28", "184,184,184"].map((tone) => tones.filter((found) => found === tone).length);
});

/** While the robot drives, the corrected drawing grows: what it saw is black, and the rest as drawn and grey. */
async function grows(other) {
  await says("learned-words", "corrects the drawing by what it sees");
  for (const id of ["accept", "correct", "reject"]) {
    assert.equal(await page.locator(`#${id}`).isVisible(), false, `${id} while the robot drives`);
  }
  await other.waitForFunction(() => document.getElementById("learned-words").textContent.includes("corrects the drawing"));
  await page.click("#show-corrected");
  const [seen, drawn] = await walled();
  assert.ok(seen > 100 && drawn > 100, `${seen} pixels of walls seen, ${drawn} as drawn`);
  await other.click("#show-corrected");
  await other.waitForFunction(() => document.getElementById("corrected-picture").naturalWidth > 0);
  await other.context().close();
  const end = Date.now() + LIMIT_MS;
  let later = seen;
  while (later <= seen && Date.now() < end) {
    await hand.settled();
    [later] = await walled();
  }
  assert.ok(later > seen, `${seen} pixels of walls seen, then ${later}`);
  await isLookedAt("growing");
  assert.equal(await page.locator("#corrected").isVisible(), false, "closed again");
}

/** Takes screenshots for people to look at: on a wide screen and on a phone, in both themes. */
async function isLookedAt(name) {
  for (const [size, viewport] of [["wide", { width: 1500, height: 900 }], ["phone", { width: 360, height: 740 }]]) {
    await page.setViewportSize(viewport);
    await page.locator("#shows").evaluate((shows, is) => { shows.open = is; }, size === "wide");
    for (const colorScheme of ["light", "dark"]) {
      await page.emulateMedia({ colorScheme });
      await hand.settled();
      await page.screenshot({ path: join(out, `${name}-${size}-${colorScheme}.png`) });
    }
    const wide = await page.evaluate(() => document.documentElement.scrollWidth) - viewport.width;
    assert.ok(wide <= 0, `the page is ${wide} px wider than the screen`);
    const small = await page.evaluate(() => [...document.querySelectorAll("#learned button")].filter((b) => b.checkVisibility())
      .map((b) => b.getBoundingClientRect()).filter((box) => box.width < 43.5 || box.height < 43.5).length);
    assert.equal(small, 0, "buttons below 44 px");
  }
  await page.emulateMedia({ colorScheme: "light" });
  await page.setViewportSize({ width: 1500, height: 900 });
  await page.locator("#shows").evaluate((shows) => { shows.open = true; });
  if (await page.isVisible("#corrected")) await page.click("#close-corrected");
  await page.click("#fit");
  await hand.look();
}

/** Waits until a layer has changed. A picture that has just arrived must first be decoded. */
async function changes(layer, before) {
  while ((await hand.pixels(layer)) === before) await hand.settled();
}

async function isOffered() {
  await page.waitForSelector("#accept:enabled");
  await says("learned-words", "has learned what it saw");
  const shown = await hand.pixels("feed");
  await page.uncheck('[data-show="learned"]');
  await changes("feed", shown);
  await page.check('[data-show="learned"]');
  await isLookedAt("learned");
}

/** The robot stands where the first drive ended, and nobody marks this place. */
async function accepts() {
  await press("accept");
  await says("say", "drives by what it has learned");
  await says("headline", "Map sent");
  await hand.menu("clear-path");
  await hand.tool("goal");
  await hand.tap(FIRST);
  await says("advice", "Send the path.");
  await press("send-path");
  await says("headline", "Path sent");
  await page.click("#menu-button");
  await page.fill("#mission-name", "again");
  await page.click("#save-mission:enabled");
  await says("say", "again.learned");
  await press("execute");
  await says("headline", "Finished");
  await says("task", "1 of 1 task reached");
  await isLookedAt("again");
}

/** The second drive has added to the map, and the person may reject this. */
async function rejects() {
  await page.waitForSelector("#accept:enabled");
  await press("reject");
  await says("learned-words", "drives by what it has learned, from anywhere");
  assert.equal(await page.locator("#accept").isVisible(), false);
  await press("reject");
  await says("say", "is forgotten");
  await says("headline", "Map sent");
  await page.waitForFunction(() => document.getElementById("learned").hidden);
  await says("advice", "Send the path.");
}

/** The learned map is placed under the drawing of a person who corrects it. */
async function corrects() {
  const ink = await hand.pixels("ink");
  await press("correct");
  await says("say", "lies under the drawing");
  await changes("ink", ink);
  await page.click("#undo");
  await hand.settled();
}

try {
  await inTurn([draws, drives, isOffered, corrects, accepts, rejects], (step) => step(), () => page, out);
  assertNoFaults(/^$/);
} finally {
  await browser.close();
}
