// Acts as a participant with a pen on the page of a study: `node study.mjs URL DRAWING.json ROUTE.json OUT`.
// Environment: SKETCHNAV_PLAYWRIGHT (the folder of node_modules), SKETCHNAV_CHROMIUM.
//
// Enters a code, practises, draws the place and the path, lets the robot drive, answers, and checks that the page becomes ready for
// the next participant. Saves screenshots in OUT. Fails at the first violation.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";

import { Hand } from "./hand.mjs";
import { BROWSER, LIMIT_MS, chromium, faults } from "./visit.mjs";

const [url, drawingFile, routeFile, out] = process.argv.slice(2);
const drawing = JSON.parse(readFileSync(drawingFile, "utf8"));
const route = JSON.parse(readFileSync(routeFile, "utf8"));
const browser = await chromium.launch(BROWSER);

const strokes = async (hand) => (await hand.figures()).Strokes;

async function main() {
  const context = await browser.newContext({ viewport: { width: 1200, height: 800 } });
  const page = await context.newPage();
  page.setDefaultTimeout(LIMIT_MS);
  page.on("pageerror", (error) => faults.push(error.stack));
  await page.goto(url);
  const hand = new Hand(page, await context.newCDPSession(page), drawing.canvas);
  const says = (id, words) => page.waitForFunction(
    ([where, what]) => document.getElementById(where).textContent.includes(what), [id, words], { timeout: LIMIT_MS },
  );
  const press = (id) => page.click(`#${id}:enabled`);

  // The participant's code.
  await page.waitForSelector("#study-begin");
  await page.waitForSelector("#study-place", { state: "visible" });
  await page.keyboard.press("Escape");
  await page.fill("#study-code", "no name");
  await page.click("#study-begin button");
  await says("study-error", "expected 1 to 32 lower-case letters");
  await page.screenshot({ path: join(out, "study-begin.png") });
  await page.fill("#study-code", "p-1");
  await page.fill("#study-age", "27");
  await page.click("#study-begin button");

  // The practice drawing cannot be sent, and undo cannot bring it back.
  await page.waitForSelector("#study-start");
  assert.equal(await page.locator("#study").isVisible(), false);
  await says("advice", "Nothing counts");
  await hand.look();
  await hand.draw([[300, 300], [900, 320], [1200, 600]]);
  assert.equal(await page.locator("#send-sketch").isEnabled(), false, "practice is not sent");
  await page.click("#study-start");
  assert.equal(await strokes(hand), 0);
  assert.equal(await page.locator("#undo").isEnabled(), false);
  await page.click("#menu-button");
  assert.equal(await page.locator("#photo").isVisible(), false, "everybody draws by hand");
  await page.click("#menu-button");

  // The drawing: one stroke is undone and drawn again.
  await hand.settled();
  await hand.look();
  for (const { points } of drawing.strokes) await hand.draw(points);
  await page.click("#undo");
  await hand.draw(drawing.strokes.at(-1).points);
  await hand.tool("polygon");
  for (const { polygon } of drawing.obstacles ?? []) {
    for (const corner of [...polygon, polygon[0]]) await hand.tap(corner);
    await page.keyboard.press("Enter");
  }
  await press("send-sketch");
  await says("say", "The map has arrived.");
  await hand.tool("path");
  await hand.draw(route);
  await press("send-path");
  await says("say", "The path has arrived.");
  // After a reload, the page continues with the drawing and the measurements.
  await page.reload();
  await says("headline", "Path sent");
  assert.equal(await strokes(hand), drawing.strokes.length);
  await page.screenshot({ path: join(out, "study-drawn.png") });
  await press("execute");
  await says("headline", "Finished");

  // The questions.
  await page.click("#study-questions");
  await page.waitForSelector("#study-answers");
  const rows = page.locator("#study-statements fieldset");
  assert.equal(await rows.count(), 6);
  for (let i = 0; i < 6; i += 1) await rows.nth(i).locator("input").nth(i % 5).check();
  await page.fill("#study-suggestions", "more colours");
  await page.screenshot({ path: join(out, "study-answers.png") });
  await page.click("#study-answers button");
  await page.waitForSelector("#study-thanks");
  await page.screenshot({ path: join(out, "study-thanks.png") });

  // Nothing of this participant is left for the next one.
  await page.waitForSelector("#study-begin");
  assert.equal(await page.inputValue("#study-code"), "");
  await page.fill("#study-code", "p-2");
  await page.click("#study-begin button");
  await page.waitForSelector("#study-start");
  assert.equal(await strokes(hand), 0);
  const kept = await page.evaluate(async () => {
    const { Shelf } = await import("/shelf.js");
    return { drawings: await new Shelf().list(), left: Object.keys(localStorage).filter((key) => key !== "settings") };
  });
  assert.deepEqual(kept, { drawings: [], left: [] }, "no drawing of a participant is in the library");
  assert.deepEqual(faults, [], "errors on the page");
}

try {
  await main();
} finally {
  await browser.close();
}
