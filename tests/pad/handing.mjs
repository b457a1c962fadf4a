// Two people and one robot, on the page of `run --pad`: `node handing.mjs URL OUT`.
// Environment: SKETCHNAV_PLAYWRIGHT (the folder of node_modules), SKETCHNAV_CHROMIUM.
//
// One page drives. The other asks for the wheel, is declined, asks again and gets it with one tap, while the robot drives on. It
// stops the robot, and hands the wheel back. Saves screenshots in OUT. Fails at the first violation.

import assert from "node:assert/strict";
import { join } from "node:path";

import { BROWSER, LIMIT_MS, assertNoFaults, chromium, inTurn, opened } from "./visit.mjs";

const [url, out] = process.argv.slice(2);
const browser = await chromium.launch(BROWSER);
/** The states of the mission that a page received. */
const states = new Set();
let desktop = null;
let phone = null;

function listen(page) {
  page.on("websocket", (socket) => socket.on("framereceived", ({ payload }) => {
    const { feed } = JSON.parse(payload);
    if (feed) states.add(feed.state);
  }));
}

const says = (page, id, words) => page.waitForFunction(
  ([where, what]) => document.getElementById(where).textContent.includes(what), [id, words], { timeout: LIMIT_MS },
);
const driven = (page) => page.evaluate(() => parseFloat(document.getElementById("n-path").textContent) || 0);

/** Both themes, at the width of a phone and of a desk. */
async function pictures(page, name) {
  const before = page.viewportSize();
  const sizes = { wide: { width: 1500, height: 900 }, phone: { width: 360, height: 780 } };
  for (const [look, size] of Object.entries(sizes)) {
    for (const colorScheme of ["light", "dark"]) {
      await page.setViewportSize(size);
      await page.emulateMedia({ colorScheme });
      // The sheet takes its new size in one frame, and is drawn in the next.
      await page.evaluate(() => new Promise((drawn) => { requestAnimationFrame(() => requestAnimationFrame(drawn)); }));
      await page.click("#fit");
      await page.evaluate(() => new Promise((drawn) => { requestAnimationFrame(() => requestAnimationFrame(drawn)); }));
      await page.screenshot({ path: join(out, `${name}-${look}-${colorScheme}.png`), animations: "disabled" });
    }
  }
  await page.setViewportSize(before);
  await page.emulateMedia({ colorScheme: null });
}

async function oneDrivesAndOneWatches() {
  const desk = await browser.newContext({ viewport: { width: 1500, height: 900 } });
  ({ page: desktop } = await opened(desk, url, null, listen));
  await says(desktop, "link-role", "You drive");
  await says(desktop, "headline", "Driving");
  const hand = await browser.newContext({ viewport: { width: 360, height: 780 }, isMobile: true, hasTouch: true });
  ({ page: phone } = await opened(hand, url, null));
  await says(phone, "link-role", "You watch");
  // The rule that hides the hand tool on a phone used to hide the sheet of a page that watches a mission, too.
  assert.ok(await phone.locator("#sheet").isVisible(), "the sheet is shown");
  assert.equal(await desktop.locator("#plea").isVisible(), false, "the page that drives has nothing to ask for");
  assert.equal(await desktop.locator("#pleas").isVisible(), false, "nobody asks");
}

/** Without a name, the page has a number. */
async function theDriverDeclines() {
  await phone.click("#plea button");
  await says(phone, "advice", "has been asked for the wheel");
  await says(desktop, "pleas", "guest 2 asks for the wheel.");
  await desktop.click("#pleas button:text('Not now')");
  await says(phone, "say", "keeps the wheel");
  await says(desktop, "link-role", "You drive");
  await desktop.waitForSelector("#pleas", { state: "hidden" });
}

async function aRequestIsWithdrawn() {
  await phone.fill("#plea-name", "Anna");
  await phone.click("#plea button");
  await says(desktop, "pleas", "Anna asks for the wheel.");
  await phone.click("#plea button:text('Stop asking')");
  await desktop.waitForSelector("#pleas", { state: "hidden" });
  await says(phone, "say", "no longer ask");
}

/** The robot drives on while the wheel changes hands. */
async function theDriverHandsOver() {
  await pictures(phone, "may-ask");
  await phone.click("#plea button");
  await says(desktop, "pleas", "Anna asks for the wheel.");
  await pictures(desktop, "asked");
  await pictures(phone, "asks");
  const before = await driven(desktop);
  await desktop.click("#pleas button:text('Hand over')");
  await says(phone, "link-role", "You drive");
  await says(phone, "say", "You drive.");
  await says(desktop, "link-role", "You watch");
  await phone.waitForFunction((way) => parseFloat(document.getElementById("n-path").textContent) !== way, before, { timeout: LIMIT_MS });
  assert.deepEqual([...states].filter((state) => !["path", "driving"].includes(state)), [], "the robot never stopped");
}

async function theNewDriverDrives() {
  await phone.tap("#abort");
  await says(phone, "headline", "Stopped");
  assert.equal(await desktop.locator("#restore").isEnabled(), false, "who watches does not restore");
  await phone.click("#restore:enabled");
  await says(desktop, "headline", "Driving");
}

async function theWheelComesBack() {
  await desktop.fill("#plea-name", "Bert");
  await desktop.press("#plea-name", "Enter");
  await says(phone, "pleas", "Bert asks for the wheel.");
  await phone.tap("#pleas button:text('Hand over')");
  await says(desktop, "link-role", "You drive");
  await desktop.click("#abort");
  await says(desktop, "headline", "Stopped");
  assertNoFaults(/^$/);
}

try {
  await inTurn(
    [oneDrivesAndOneWatches, theDriverDeclines, aRequestIsWithdrawn, theDriverHandsOver, theNewDriverDrives, theWheelComesBack],
    (step) => step(), () => desktop, out,
  );
} finally {
  await browser.close();
}
