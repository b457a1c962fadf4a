// Tests a robot that asks for its position, on the page of `run --pad`: `node asking.mjs URL OUT`.
// Environment: SKETCHNAV_PLAYWRIGHT (the folder of node_modules), SKETCHNAV_CHROMIUM.
//
// Waits until the page shows the question and its places, taps the second one on the sheet, checks that the robot drives on, and
// answers the next question with its button. Saves screenshots in OUT. Fails at the first violation.

import assert from "node:assert/strict";
import { join } from "node:path";

import { Hand } from "./hand.mjs";
import { BROWSER, LIMIT_MS, chromium, faults } from "./visit.mjs";

const [url, out] = process.argv.slice(2);
const browser = await chromium.launch(BROWSER);

/** The server's last message. */
const told = { canvas: null, question: null };

function listen(socket) {
  socket.on("framereceived", ({ payload }) => {
    const { hello, feed } = JSON.parse(payload);
    told.canvas = hello?.canvas ?? told.canvas;
    if (feed) told.question = feed.question ?? null;
  });
}

async function main() {
  const context = await browser.newContext({ viewport: { width: 1200, height: 800 } });
  const page = await context.newPage();
  page.setDefaultTimeout(LIMIT_MS);
  page.on("pageerror", (error) => faults.push(error.stack));
  page.on("websocket", listen);
  await page.goto(url);
  const says = (id, words) => page.waitForFunction(
    ([where, what]) => document.getElementById(where).textContent.includes(what), [id, words], { timeout: LIMIT_MS },
  );
  await says("headline", "Where is the robot?");
  await page.waitForSelector("#question button:nth-child(2)");
  const { text, places } = told.question;
  assert.equal(await page.locator("#advice").textContent(), text);
  const buttons = await page.locator("#question button").allTextContents();
  assert.deepEqual(buttons, places.map((place) => place.name), "a button for each place");
  const hand = new Hand(page, await context.newCDPSession(page), told.canvas);
  await hand.look();
  await hand.settled();
  await page.screenshot({ path: join(out, "asks.png") });

  // A tap next to the letter counts as well.
  const [x, y] = places[1].at;
  await hand.tap([x + 6 / hand.view.scale, y]);
  await says("say", "The place has been sent to the robot.");
  await says("headline", "Driving");
  assert.equal(await page.locator("#question button").count(), 0, "it asks no more");
  await says("headline", "Where is the robot?");
  await page.waitForSelector("#question button");
  await page.screenshot({ path: join(out, "asks-again.png") });
  await page.click("#question button:first-child");
  await says("say", "The place has been sent to the robot.");
  assert.deepEqual(faults, [], "errors on the page");
}

try {
  await main();
} finally {
  await browser.close();
}
