// Acts as a person whose drawings are saved by the running page: `node keeping.mjs URL OUT draws`, and, after the server has ended,
// `node keeping.mjs URL OUT offline` with the same browser profile, in OUT.
// Environment: SKETCHNAV_PLAYWRIGHT (the folder of node_modules), SKETCHNAV_CHROMIUM.
//
// Draws, closes pages, kills the browser, and finds every drawing again; opens, renames, duplicates, deletes and restores drawings
// with mouse, fingers and keys; opens one drawing twice. Without a server, opens the page again and continues. Saves screenshots in
// OUT. Fails at the first violation.

import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";

import { BROWSER, assertNoFaults, chromium, inTurn, opened } from "./visit.mjs";


const [url, out, phase] = process.argv.slice(2);
const CANVAS = [2540, 1252];
const WIDE = { width: 1500, height: 900 };
const PROFILE = join(out, "profile");
const COURT = readFileSync(new URL("../../sim/missions/routes/court-01.json", import.meta.url), "utf8");

const launched = () => chromium.launchPersistentContext(PROFILE, {
  ...BROWSER, viewport: WIDE, hasTouch: true, acceptDownloads: true,
});

async function visit(context) {
  const { page, hand } = await opened(context, url, CANVAS);
  await hand.look();
  return { page, hand };
}

/** Waits until the drawing on the sheet has been saved under this name. */
const isKept = (page, name) => page.waitForFunction((is) => document.getElementById("drawing-name").textContent === is, name);

/** Waits until the library has the drawing on the sheet, with this number of strokes. */
const hasAll = (page, strokes) => page.waitForFunction((count) => {
  const of = (key) => JSON.parse(sessionStorage.getItem(key) ?? "{}");
  return of("kept").saved && of("draft").strokes.length === count;
}, strokes);

/** The names on the cards of the library, in order. */
const names = (page) => page.locator("#shelf input").evaluateAll((all) => all.map((field) => field.value));
const card = (page, name) => page.locator("#shelf li").filter({ has: page.locator(`[aria-label="Open “${name}”"]`) });
const closed = (page) => page.waitForFunction(() => !document.getElementById("library").open);

async function library(page) {
  await page.click("#menu-button");
  await page.click("#library-open");
  await page.waitForSelector("#shelf li");
}

/** The number of pixels in a card's picture that are not paper. */
async function ink(page, name) {
  const image = card(page, name).locator("img");
  await image.evaluate((element) => new Promise((done) => {
    const look = () => (element.naturalWidth ? done() : element.addEventListener("load", done, { once: true }));
    look();
  }));
  return image.evaluate((element) => {
    const canvas = Object.assign(document.createElement("canvas"), { width: element.naturalWidth, height: element.naturalHeight });
    const context = canvas.getContext("2d");
    context.drawImage(element, 0, 0);
    const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
    return data.filter((value, i) => i % 4 === 0 && value < 128).length;
  });
}

// ---------------------------------------------------------------------------- saved without being asked

async function aPageThatIsClosedLosesNothing(context) {
  let { page, hand } = await visit(context);
  await hand.draw([[300, 300], [900, 310]]);
  await isKept(page, "Drawing 1");
  const before = await hand.saved();
  await page.close();
  ({ page, hand } = await visit(context));
  await isKept(page, "Drawing 1");
  assert.equal(await hand.saved(), before, "the next page has the drawing");
  // The page is closed directly after a stroke, before any transaction could complete.
  await hand.draw([[300, 600], [900, 610]]);
  await page.goto("about:blank");
  await page.close();
  ({ page, hand } = await visit(context));
  await isKept(page, "Drawing 1");
  assert.equal(JSON.parse(await hand.saved()).strokes.length, 2, "a stroke right before the page was left");
  await page.reload();
  await hand.look();
  assert.equal(JSON.parse(await hand.saved()).strokes.length, 2, "a page that is loaded again");

  // A killed browser may forget that the leftovers of a page were already saved and then changed. They reappear, and must be
  // recognized.
  await hand.draw([[300, 700], [900, 710]]);
  await hasAll(page, 3);
  const left = await page.evaluate(() => ({ ...JSON.parse(sessionStorage.getItem("kept")), text: sessionStorage.getItem("draft") }));
  await page.click("#undo");
  await hasAll(page, 2);
  await page.evaluate((known) => localStorage.setItem(`left:${known.id}`, JSON.stringify(known)), left);
  await page.close();
  ({ page, hand } = await visit(context));
  await isKept(page, "Drawing 1");
  assert.equal(JSON.parse(await hand.saved()).strokes.length, 2);
  const entries = await page.evaluate(async () => {
    const { Shelf } = await import("/shelf.js");
    return (await new Shelf().list()).length;
  });
  assert.equal(entries, 1, "no copy of it");
  await page.close();
}

/** The processes of this test's browser: those with its profile. */
function kill() {
  const command = (pid) => {
    try {
      return readFileSync(`/proc/${pid}/cmdline`, "utf8");
    } catch {
      return "";
    }
  };
  const own = readdirSync("/proc").filter((pid) => /^\d+$/.test(pid) && command(pid).includes(`--user-data-dir=${PROFILE}\0`));
  own.forEach((pid) => process.kill(Number(pid), "SIGKILL"));
  return own.length;
}

async function aBrowserThatIsKilledLosesNothing(context) {
  const { page, hand } = await visit(context);
  await isKept(page, "Drawing 1");
  await hand.draw([[300, 800], [900, 810]]);
  await hasAll(page, 3);
  const gone = new Promise((done) => { context.once("close", done); });
  assert.ok(kill() > 0, "a browser to kill");
  await gone;
  const again = await launched();
  const next = await visit(again);
  await isKept(next.page, "Drawing 1");
  assert.equal(JSON.parse(await next.hand.saved()).strokes.length, 3, "after the kill");
  await next.page.close();
  return again;
}

// ---------------------------------------------------------------------------- the library

async function drawingsAreOpenedRenamedCopiedAndDeleted(context) {
  const { page, hand } = await visit(context);
  await isKept(page, "Drawing 1");
  // The driving page has been killed.
  await page.click("#wheel:visible");
  await page.getByText("You drive", { exact: true }).waitFor();
  await hand.menu("new-landscape");
  await hand.draw([[500, 200], [1500, 200], [1500, 900]]);
  await isKept(page, "Drawing 2");
  await hand.open("court.json", COURT);
  await isKept(page, "1-court");
  await library(page);
  assert.deepEqual(await names(page), ["1-court", "Drawing 2", "Drawing 1"], "the last change comes first");
  for (const name of await names(page)) assert.ok(await ink(page, name) > 100, `${name} has a picture`);
  assert.equal(await page.locator("#shelf [aria-current]").count(), 1);

  await card(page, "Drawing 2").locator("input").fill("corner");
  await page.keyboard.press("Enter");
  await card(page, "corner").waitFor();
  await card(page, "corner").getByTitle("Duplicate").click();
  await card(page, "corner, copy").waitFor();
  assert.deepEqual(await names(page), ["1-court", "corner, copy", "corner", "Drawing 1"]);
  for (const name of ["corner, copy", "Drawing 1"]) await card(page, name).getByTitle("Delete").click();
  await card(page, "Drawing 1").getByText("Restore").click();
  await page.screenshot({ path: join(out, "library-wide.png") });
  await card(page, "corner").locator(".drawing").click();
  await closed(page);
  await isKept(page, "corner");
  assert.deepEqual(JSON.parse(await hand.saved()).strokes.map((s) => s.points.length), [3]);

  // Undo leads to the previous drawing, and changes to it are saved to its own entry.
  await page.click("#undo");
  await isKept(page, "1-court");
  await hand.draw([[100, 100], [200, 100]]);
  const court = JSON.parse(COURT).strokes.length;
  assert.equal(JSON.parse(await hand.saved()).strokes.length, court + 1);
  await library(page);
  assert.deepEqual(await names(page), ["1-court", "corner", "Drawing 1"], "what was deleted is gone");
  await card(page, "Drawing 1").locator(".drawing").click();
  await closed(page);
  await isKept(page, "Drawing 1");
  assert.equal(JSON.parse(await hand.saved()).strokes.length, 3);
  await page.close();
}

/** Two pages with a link draw in the same drawing, which is saved once. */
async function aDrawingThatIsOpenTwiceIsOne(context) {
  const [one, two] = [await visit(context), await visit(context)];
  await isKept(one.page, "Drawing 1");
  await one.page.bringToFront();
  await one.hand.draw([[1000, 200], [1400, 200]]);
  await hasAll(two.page, 4);
  await two.page.bringToFront();
  await two.hand.draw([[1000, 250], [1400, 250]]);
  await hasAll(one.page, 5);
  for (const { page } of [one, two]) {
    await page.bringToFront();
    await page.click("#undo");
  }
  for (const { page } of [one, two]) await hasAll(page, 3);
  await library(one.page);
  assert.deepEqual(await names(one.page), ["Drawing 1", "1-court", "corner"]);
  for (const { page } of [one, two]) await page.close();
}

/** If two pages without a link change one drawing, both versions are saved. */
async function aDrawingThatIsChangedTwiceIsKeptTwice(context) {
  await context.routeWebSocket(/\/ws\?/, (socket) => socket.close());
  const [one, two] = [await visit(context), await visit(context)];
  for (const { page } of [two, one]) {
    await page.bringToFront();
    await isKept(page, "Drawing 1");
  }
  await one.hand.draw([[1000, 300], [1400, 300]]);
  await hasAll(one.page, 4);
  await two.page.bringToFront();
  for (const y of [400, 500]) await two.hand.draw([[1000, y], [1400, y]]);
  await isKept(two.page, "Drawing 1, another");
  await one.page.bringToFront();
  await library(one.page);
  assert.deepEqual(await names(one.page), ["Drawing 1, another", "Drawing 1", "1-court", "corner"]);
  await card(one.page, "Drawing 1, another").locator(".drawing").click();
  await isKept(one.page, "Drawing 1, another");
  assert.equal(JSON.parse(await one.hand.saved()).strokes.length, 5);
  await one.page.click("#undo");
  assert.equal(JSON.parse(await one.hand.saved()).strokes.length, 4);
  for (const { page } of [one, two]) await page.close();
  await context.routeWebSocket(/\/ws\?/, (socket) => socket.connectToServer());
}

/** With fingers on a phone, and with keys only. */
async function byFingersAndByKeys(context) {
  const { page, hand } = await visit(context);
  await page.setViewportSize({ width: 360, height: 740 });
  await page.tap("#menu-button");
  await page.tap("#library-open");
  await card(page, "corner").locator(".drawing").waitFor();
  for (const scheme of ["light", "dark"]) {
    await page.emulateMedia({ colorScheme: scheme });
    await hand.settled();
    await page.screenshot({ path: join(out, `library-phone-${scheme}.png`) });
  }
  const narrow = await page.evaluate(() => [...document.querySelectorAll("#library button")].filter((b) => b.checkVisibility())
    .map((b) => [b.ariaLabel, b.getBoundingClientRect()]).filter(([, box]) => box.width < 43.5 || box.height < 43.5 || box.right > innerWidth));
  assert.deepEqual(narrow, [], "buttons below 44 px, or beside the screen");
  await card(page, "corner").locator(".drawing").tap();
  await closed(page);
  await isKept(page, "corner");

  await page.setViewportSize(WIDE);
  await page.emulateMedia({ colorScheme: "light" });
  await page.focus("#sheet");
  await page.keyboard.press("Control+o");
  await page.waitForFunction(() => document.activeElement.ariaLabel === "Open “corner”");
  const reached = new Set();
  for (let i = 0; i < 20; i += 1) {
    await page.keyboard.press("Tab");
    reached.add(await page.evaluate(() => document.activeElement.ariaLabel ?? ""));
  }
  for (const name of ["Duplicate", "Delete", "Name of the drawing", "Close", "Open “1-court”"]) assert.ok(reached.has(name), `${name}: ${[...reached]}`);
  await page.focus('[aria-label="Open “1-court”"]');
  // The sheet's keys have no effect here.
  for (const key of ["Delete", "e"]) await page.keyboard.press(key);
  await page.keyboard.press("Enter");
  await closed(page);
  await isKept(page, "1-court");
  assert.equal(await page.getAttribute("#sheet", "data-tool"), "pen");
  await page.keyboard.press("Control+o");
  await page.keyboard.press("Escape");
  await closed(page);
  await page.close();
}

async function isAnAppThatInstalls(context) {
  const { page, hand } = await visit(context);
  await page.evaluate(() => navigator.serviceWorker.ready.then(() => true));
  const { installabilityErrors } = await hand.cdp.send("Page.getInstallabilityErrors");
  assert.deepEqual(installabilityErrors, []);
  const { errors, data } = await hand.cdp.send("Page.getAppManifest");
  assert.deepEqual(errors, []);
  assert.equal(JSON.parse(data).display, "standalone");
  const tokens = await page.evaluate(async () => {
    const requests = await (await caches.open("page")).keys();
    return requests.map((request) => request.url).filter((address) => address.includes("token"));
  });
  assert.deepEqual(tokens, [], "no cache holds the token of the link");
  await page.close();
}

// ---------------------------------------------------------------------------- without a server

async function withoutAServer(context) {
  const { page, hand } = await visit(context);
  await page.getByText("Not connected").first().waitFor();
  await isKept(page, "1-court");
  const before = JSON.parse(await hand.saved()).strokes.length;
  await hand.draw([[200, 200], [300, 200]]);
  await hand.menu("new-landscape");
  await hand.draw([[200, 200], [800, 200], [800, 700]]);
  await isKept(page, "Drawing 2");
  await library(page);
  await page.screenshot({ path: join(out, "library-offline.png") });
  await card(page, "1-court").locator(".drawing").click();
  await isKept(page, "1-court");
  assert.equal(JSON.parse(await hand.saved()).strokes.length, before + 1);
  await page.close();
  const next = await visit(context);
  await isKept(next.page, "1-court");
  await next.page.close();
}

const PHASES = {
  draws: [
    aPageThatIsClosedLosesNothing, aBrowserThatIsKilledLosesNothing, drawingsAreOpenedRenamedCopiedAndDeleted,
    aDrawingThatIsOpenTwiceIsOne, aDrawingThatIsChangedTwiceIsKeptTwice, byFingersAndByKeys, isAnAppThatInstalls,
  ],
  offline: [withoutAServer],
};

let context = await launched();
try {
  await inTurn(PHASES[phase], async (step) => {
    context = await step(context) ?? context;
  }, () => context.pages().at(-1), out);
  assertNoFaults(/WebSocket|ERR_|404|Failed to load/);
} finally {
  await context.close();
}
