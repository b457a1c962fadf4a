// Tests a robot that drives past landmarks on the running system: `node landmarks.mjs URL SKETCH.json OUT`.
// Environment: SKETCHNAV_PLAYWRIGHT (the folder of node_modules), SKETCHNAV_CHROMIUM.
//
// Draws the objects of a sketch except for one, and the first half of its route, with a pen, and lets the robot drive. The robot
// finds nothing where the route ends, is lost, and offers places where it may be. Chooses one of them with its button and, when
// the robot asks again, taps its position. Then adds the missing object, draws the rest of
// the route from the robot's position, and lets it drive to its goal. Saves the mission, and screenshots in OUT. Fails at the first
// violation.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";

import { BROWSER, LIMIT_MS, assertNoFaults, chromium, inTurn, opened } from "./visit.mjs";

const [url, sketchFile, out] = process.argv.slice(2);
const { canvas, strokes, route } = JSON.parse(readFileSync(sketchFile, "utf8"));
/** The first half of the route ends in open space, after the second turn, too far from the missing object to stop in front of it. */
const HALF = 20;
/** Index of the object that is missing at first, the cabinet at the last turn. */
const FORGOTTEN = 6;
const browser = await chromium.launch(BROWSER);
let page = null;
let hand = null;
/** The server's last message, and how often the robot resumed after a question. */
const told = { feed: null, resumed: 0 };

const says = async (id, words) => {
  await page.waitForFunction(
    ([where, what]) => document.getElementById(where).textContent.includes(what), [id, words], { timeout: LIMIT_MS },
  );
};
const press = (id) => page.click(`#${id}:enabled`);
const pose = () => told.feed.pose;

function listen(newPage) {
  newPage.on("websocket", (socket) => socket.on("framereceived", ({ payload }) => {
    const { feed } = JSON.parse(payload);
    if (feed && !feed.question && told.feed?.question) told.resumed += 1;
    told.feed = feed ?? told.feed;
  }));
}

async function draws() {
  const context = await browser.newContext({ viewport: { width: 1500, height: 900 } });
  ({ page, hand } = await opened(context, url, canvas, listen));
  await says("headline", "No map yet");
  await hand.menu("new-landscape");
  await hand.look();
  for (const { points } of strokes.filter((_, i) => i !== FORGOTTEN)) await hand.draw(points);
  await hand.tool("path");
  await hand.draw(route.slice(0, HALF));
}

async function drives() {
  await press("send-sketch");
  await says("headline", "Map sent");
  await press("send-path");
  await says("headline", "Path sent");
  await press("execute");
  await says("headline", "Driving");
}

/** The robot finds nothing where the route ends, and asks. After each answer, it looks again and asks again. */
async function asks() {
  await says("headline", "Where is the robot?");
  await hand.settled();
  await page.screenshot({ path: join(out, "landmarks-lost.png") });
  const { x, y } = pose();
  const { text, places } = told.feed.question;
  // In real time, the robot stops a little earlier or later, which decides how many places fit.
  assert.match(text, /^Is the robot at A.*\? Tap where it is\.$/);
  const buttons = await page.locator("#question button").allTextContents();
  assert.deepEqual(buttons, places.map((place) => place.name), "a button for each place");
  await answers(() => page.click("#question button:first-child"));
  await answers(() => hand.tap([x, y]));
  await press("abort");
  await says("headline", "Stopped");
}

/** Gives an answer, and waits until the robot has driven on and asks again. */
async function answers(answer) {
  const before = told.resumed;
  await answer();
  await says("say", "The place has been sent to the robot.");
  for (const end = Date.now() + LIMIT_MS; told.resumed === before;) {
    assert.ok(Date.now() < end, "the robot does not drive on");
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
  await says("headline", "Where is the robot?");
}

/** Adds the missing object, and draws the rest of the route from the robot's position, beginning in the direction of its heading. */
async function drawsOn() {
  const { x, y, heading_rad: heading } = pose();
  const ahead = [x + 60 * Math.cos(heading), y - 60 * Math.sin(heading)];
  const rest = route.slice(HALF + 1).filter(([column]) => column > ahead[0] + 40);
  assert.ok(rest.length > 2, `the rest of the route from ${x}, ${y}: ${JSON.stringify(rest)}`);
  await hand.tool("pen");
  await hand.draw(strokes[FORGOTTEN].points);
  await hand.menu("clear-path");
  await hand.tool("path");
  await hand.draw([[x, y], ahead, ...rest]);
  await hand.settled();
  await page.screenshot({ path: join(out, "landmarks-corrected.png") });
  await press("send-sketch");
  await says("headline", "Map sent");
  await press("send-path");
  await says("headline", "Path sent");
  await press("execute");
  await says("headline", "Finished");
  await says("task", "1 of 1 task reached");
  await hand.settled();
  await page.screenshot({ path: join(out, "landmarks-arrived.png") });
}

async function saves() {
  await page.click("#menu-button");
  await page.fill("#mission-name", "past-the-table");
  await page.click("#save-mission:enabled");
  await says("say", "past-the-table.toml");
}

try {
  await inTurn([draws, drives, asks, drawsOn, saves], (step) => step(), () => page, out);
  assertNoFaults(/^$/);
} finally {
  await browser.close();
}
