// Acts as a person with a pen on the running system: `node browser.mjs URL DRAWING.json ROUTE.json OUT`. Environment:
// SKETCHNAV_PLAYWRIGHT (the folder of node_modules), SKETCHNAV_CHROMIUM, SKETCHNAV_PAD_PID (the process that serves the page, which
// is killed during the test), SKETCHNAV_FEED_SECONDS (the duration for which the feed is measured).
//
// Draws the map and the route of a mission by hand, sends both, lets the robot drive, stops it, lets it continue, and checks that
// it arrives. Along the way, checks what is drawn, saved and counted. Prints its figures as one JSON object, and saves screenshots
// in OUT. Fails at the first violation. The only purpose of its time limits is to detect a test that hangs.

import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";

import { feedCost, inkWork, manyStrokes, pageSize } from "./figures.mjs";
import { BROWSER, LIMIT_MS, assertNoFaults, chromium, opened, padPid } from "./visit.mjs";

const [url, drawingFile, routeFile, out] = process.argv.slice(2);
const drawing = JSON.parse(readFileSync(drawingFile, "utf8"));
const route = JSON.parse(readFileSync(routeFile, "utf8"));
const figures = {};

const browser = await chromium.launch(BROWSER);


/** Opens the page, with a hand on its sheet. */
const visit = (context, canvas = drawing.canvas) => opened(context, url, canvas);

const text = (page, id) => page.locator(`#${id}`).textContent();
const says = async (page, id, words) => {
  try {
    await page.waitForFunction(
      ([where, what]) => document.getElementById(where).textContent.includes(what), [id, words], { timeout: LIMIT_MS },
    );
  } catch (error) {
    const found = await page.evaluate(() => ["say", "headline", "link-role"].map((id) => document.getElementById(id).textContent));
    throw new Error(`#${id}: expected "${words}", found say, headline, role: ${JSON.stringify(found)}`, { cause: error });
  }
};
/** Waits until the robot drives on or has already arrived, so that the speed of this browser has no effect. */
const goesOn = (page) => page.waitForFunction(
  () => /Driving|Finished/.test(document.getElementById("headline").textContent), null, { timeout: LIMIT_MS },
);
/** Presses a button once it is enabled. */
const press = (page, id) => page.click(`#${id}:enabled`);
const isOn = (page, id) => page.locator(`#${id}`).isEnabled();

/** Draws every stroke and obstacle of the mission. */
async function drawMap({ page, hand }) {
  await hand.menu(drawing.canvas[0] > drawing.canvas[1] ? "new-landscape" : "new-portrait");
  await hand.look();
  for (const { points } of drawing.strokes) await hand.draw(points);
  await hand.tool("polygon");
  for (const { polygon, label } of drawing.obstacles ?? []) {
    for (const corner of [...polygon, polygon[0]]) await hand.tap(corner);
    await page.fill("#label-text", label);
    await page.keyboard.press("Enter");
  }
  await hand.tool("pen");
}

/** The maximum distance between the drawn points and those given to the hand, canvas pixels. */
function worst(drawn, told) {
  assert.equal(drawn.length, told.length, "points of a stroke");
  return Math.max(...drawn.map((p, i) => Math.hypot(p[0] - told[i][0], p[1] - told[i][1])));
}

/** The points without repetitions: a pen that does not move sends nothing new. */
const moved = (points) => points.filter((p, i) => i === 0 || p[0] !== points[i - 1][0] || p[1] !== points[i - 1][1]);

async function nothingIsLost({ hand }) {
  const saved = JSON.parse(await hand.saved());
  assert.equal(saved.strokes.length, drawing.strokes.length);
  const off = saved.strokes.map((stroke, i) => worst(stroke.points, moved(drawing.strokes[i].points)));
  const pixel = 1 / hand.view.scale;
  assert.ok(Math.max(...off) <= pixel, `expected every point within a screen's pixel (${pixel}), found ${Math.max(...off)}`);
  assert.deepEqual(saved.obstacles.map((o) => o.label), (drawing.obstacles ?? []).map((o) => o.label));
  const shown = await hand.figures();
  figures.points = shown["Points in them"];
  figures.pen_movements = shown["Pen movements"];
  figures.farthest_point_px = Math.max(...off);
}

async function drawsAgainIdentically({ hand }) {
  const [before, ink, marks] = [await hand.saved(), await hand.pixels("ink"), await hand.pixels("marks")];
  await hand.menu("new-landscape");
  await hand.menu("new-portrait");
  assert.notEqual(await hand.pixels("ink"), ink);
  await hand.open("drawing.json", before);
  await hand.settled();
  assert.equal(await hand.saved(), before, "a file saved, loaded and saved again");
  assert.equal(await hand.pixels("ink"), ink, "its strokes, pixel by pixel");
  assert.equal(await hand.pixels("marks"), marks, "its obstacles, pixel by pixel");
}

async function undoesAndErases({ page, hand }) {
  const [before, ink] = [await hand.saved(), await hand.pixels()];
  await hand.draw([[400, 400], [500, 420], [600, 500]]);
  assert.notEqual(await hand.pixels(), ink);
  await page.click("#undo");
  assert.equal(await hand.pixels(), ink);
  await page.keyboard.press("Control+y");
  await page.keyboard.press("Control+z");
  await hand.tool("eraser");
  const [a, b] = drawing.strokes[0].points;
  await hand.drag([a, b]);
  assert.notEqual(await hand.pixels(), ink);
  await page.click("#undo");
  await hand.tool("pen");
  assert.equal(await hand.pixels(), ink);
  assert.equal(await hand.saved(), before);
}

async function fingersAfterThePen({ page, hand }) {
  const before = await hand.saved();
  const [cx, cy] = drawing.canvas.map((side) => side / 2);
  await hand.fingers("touchStart", [cx, cy]);
  await hand.fingers("touchMove", [cx + 200, cy + 100]);
  await hand.fingers("touchEnd");
  await page.click("#fit");
  assert.equal(await hand.saved(), before, "a finger after the pen moves the sheet and draws nothing");
}

/** On a phone without a pen: a finger draws; a second finger or a cancellation by the browser discards the stroke. */
async function fingersOnAPhone({ hand }) {
  const count = async () => JSON.parse(await hand.saved()).strokes.length;
  await hand.look();
  const start = await count();
  await hand.fingers("touchStart", [300, 300]);
  await hand.fingers("touchMove", [400, 310]);
  await hand.fingers("touchEnd");
  assert.equal(await count(), start + 1, "one finger draws");
  await hand.fingers("touchStart", [300, 500]);
  await hand.fingers("touchMove", [400, 510]);
  await hand.fingers("touchCancel");
  assert.equal(await count(), start + 1, "a cancelled stroke is dropped");
  await hand.fingers("touchStart", [300, 500]);
  await hand.fingers("touchStart", [300, 500], [800, 500]);
  await hand.fingers("touchMove", [200, 500], [900, 500]);
  await hand.fingers("touchEnd");
  assert.equal(await count(), start + 1, "two fingers zoom");
  await hand.page.click("#fit");
  await hand.page.click("#undo");
  assert.equal(await count(), start);
}

/** With keys only: the crosshair draws a wall; every enabled button can be reached and shows the focus. */
async function byKeyboard({ page, hand }) {
  const before = JSON.parse(await hand.saved()).strokes.length;
  await page.focus("#sheet");
  for (const key of ["ArrowRight", " ", "ArrowRight", "Shift+ArrowDown", " "]) await page.keyboard.press(key);
  const { strokes } = JSON.parse(await hand.saved());
  assert.equal(strokes.length, before + 1);
  assert.equal(strokes.at(-1).points.length, 3);
  await page.keyboard.press("Control+z");
  const wanted = await page.evaluate(() => [...document.querySelectorAll("button, summary, #sheet")]
    .filter((e) => e.checkVisibility() && !e.disabled && !e.closest("[popover]")).length);
  await page.evaluate(() => document.activeElement.blur());
  const reached = new Set();
  for (let i = 0; i < 4 * wanted; i += 1) {
    await page.keyboard.press("Tab");
    const found = await page.evaluate(() => {
      const e = document.activeElement;
      const style = getComputedStyle(e);
      return { name: e.id || e.dataset.tool || e.tagName, shown: e === document.body || style.outlineStyle !== "none" };
    });
    assert.ok(found.shown, `focus is not seen on ${found.name}`);
    reached.add(found.name);
  }
  assert.ok([...reached].filter((name) => name !== "BODY" && name !== "INPUT").length >= wanted, `expected ${wanted}, reached ${[...reached]}`);
}

/** Every button has a name for screen readers and is large enough for a finger. */
async function isAtHand({ page }) {
  const small = await page.evaluate(() => [...document.querySelectorAll("button")].filter((b) => b.checkVisibility())
    .map((b) => [b.id || b.dataset.tool, b.getBoundingClientRect(), b.ariaLabel || b.innerText.trim() || b.title])
    .filter(([, box, name]) => box.width < 43.5 || box.height < 43.5 || !name).map(([id]) => id));
  assert.deepEqual(small, [], "buttons below 44 px or without a name");
  const wide = await page.evaluate(() => document.documentElement.scrollWidth) - page.viewportSize().width;
  assert.ok(wide <= 0, `the page is ${wide} px wider than the screen`);
}

async function drawPath({ page, hand }) {
  await hand.tool("path");
  await page.keyboard.press("0");
  await hand.look();
  await hand.draw(route);
  await hand.tool("pen");
  const saved = JSON.parse(await hand.saved());
  assert.ok(worst(saved.route, moved(route)) <= 1 / hand.view.scale);
}

/** The drawing is saved as the files of a mission. */
async function savesTheMission({ page }) {
  await page.click("#menu-button");
  await page.fill("#mission-name", "by-hand");
  const downloads = ["toml", "json"].map((kind) => page.waitForEvent("download", (d) => d.suggestedFilename().endsWith(kind)));
  await page.click("#save-mission:enabled");
  const names = (await Promise.all(downloads)).map((download) => download.suggestedFilename());
  assert.deepEqual(names, ["by-hand.toml", "by-hand.json"]);
}

/** The server dies while the path is being sent. The page sends it again, and it arrives. */
async function sendsToTheServersSuccessor({ page }) {
  await page.waitForSelector("#send-path:enabled");
  const pid = padPid();
  // It is stopped first, because the button would be disabled once the server had died.
  if (pid) process.kill(pid, "SIGSTOP");
  await page.click("#send-path:enabled");
  if (pid) process.kill(pid, "SIGKILL");
  await says(page, "say", "The path has arrived");
}

/** The server's process dies. The page reports this, reconnects by itself, and still drives. */
async function outlivesTheServer({ page }) {
  const pid = padPid();
  if (!pid) return;
  // Even a very short disconnection is reported.
  await page.evaluate(() => {
    const role = document.getElementById("link-role");
    new MutationObserver(() => { window.wasLost ||= role.textContent === "Not connected"; }).observe(role, { childList: true, subtree: true, characterData: true });
  });
  process.kill(pid, "SIGKILL");
  await page.waitForFunction(() => window.wasLost, null, { timeout: LIMIT_MS });
  await says(page, "link-role", "You drive");
  await goesOn(page);
}

const stands = (page) => page.waitForFunction(() => parseFloat(document.getElementById("n-speed").textContent) === 0, null, { timeout: LIMIT_MS });

async function main() {
  const context = await browser.newContext({ viewport: { width: 1600, height: 900 }, hasTouch: true, acceptDownloads: true });
  await context.addInitScript(inkWork);
  const desk = await visit(context);
  const { page, hand } = desk;
  await says(page, "headline", "No map yet");
  assert.equal(await isOn(page, "send-sketch"), false, "a blank sheet is no map");

  // Pauses of a busy machine must not count as a hand that holds still or as a lost link.
  await page.click("#menu-button");
  await page.uncheck("#hold");
  await page.fill("#limit", "60");
  await page.press("#limit", "Enter");
  await says(page, "say", "pauses after 60 s");
  await page.click("#menu-button");

  await drawMap(desk);
  await nothingIsLost(desk);
  await drawsAgainIdentically(desk);
  await undoesAndErases(desk);
  await fingersAfterThePen(desk);
  await byKeyboard(desk);
  await isAtHand(desk);
  for (const id of ["send-path", "execute", "abort", "restore", "again"]) assert.equal(await isOn(page, id), false, id);

  await press(page, "send-sketch");
  await says(page, "say", "The map has arrived");
  assert.equal(await isOn(page, "send-path"), false, "no path yet");
  await drawPath(desk);
  await sendsToTheServersSuccessor(desk);
  writeFileSync(join(out, "sent.json"), await hand.saved());
  await savesTheMission(desk);

  const phone = await browser.newContext({ viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, isMobile: true, hasTouch: true, acceptDownloads: true });
  const watcher = await visit(phone);
  await says(watcher.page, "link-role", "You draw");
  assert.deepEqual(JSON.parse(await watcher.hand.saved()).strokes, JSON.parse(await hand.saved()).strokes, "the watcher's drawing");
  assert.equal(await isOn(watcher.page, "execute"), false, "who watches does not drive");
  await fingersOnAPhone(watcher);

  await press(page, "execute");
  await says(page, "headline", "Driving");
  await page.waitForFunction(() => parseFloat(document.getElementById("n-path").textContent) >= 2, null, { timeout: LIMIT_MS });
  assert.ok(await isOn(watcher.page, "abort"), "anybody may stop the robot");
  await page.screenshot({ path: join(out, "desktop.png") });
  await watcher.page.screenshot({ path: join(out, "phone.png") });
  await page.keyboard.press("Escape");
  await says(page, "headline", "Stopped");
  await says(page, "task", "aborted");
  await isAtHand(watcher);
  await phone.close();
  await stands(page);
  const stood = await text(page, "n-path");
  Object.assign(figures, await manyStrokes(desk, drawing.canvas));
  assert.equal(await text(page, "n-path"), stood, "a robot that was stopped stands");

  await press(page, "restore");
  await goesOn(page);
  Object.assign(figures, await feedCost(browser, desk, Number(process.env.SKETCHNAV_FEED_SECONDS ?? 3)));
  await outlivesTheServer(desk);
  await says(page, "headline", "Finished");
  await says(page, "task", "1 of 1 task reached");
  await page.screenshot({ path: join(out, "arrived.png") });
  // The browser reports a broken link as well.
  assertNoFaults(/WebSocket|ERR_CONNECTION|ERR_SOCKET_NOT_CONNECTED/);
  Object.assign(figures, await pageSize(url));
  figures.link_ms = parseFloat(await text(page, "link-latency"));
  process.stdout.write(`${JSON.stringify(figures)}\n`);
}

try {
  await main();
} finally {
  await browser.close();
}
