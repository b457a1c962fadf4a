// Several people who draw at once: `node together.mjs URL DRAWING ROUTE OUT`.
// Environment: SKETCHNAV_PLAYWRIGHT (the folder of node_modules), SKETCHNAV_CHROMIUM.
//
// Anna at a desk and Berta with a phone draw in one drawing, see each other's pointers and changes, move and delete each other's
// walls, and undo their own steps. Berta's link breaks, she draws on, loads the page again, and finds everything together when the
// link is back. The server is killed. Carl has a drawing of his own, joins the others, and later shares his. Anna and Berta draw half of the map of a
// mission each; Anna sends it and hands over the wheel, and Berta draws the path and drives. Saves screenshots in OUT. Fails at the
// first violation.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";

import { BROWSER, LIMIT_MS, assertNoFaults, chromium, inTurn, opened, padPid } from "./visit.mjs";

const [url, drawingFile, routeFile, out] = process.argv.slice(2);
const map = JSON.parse(readFileSync(drawingFile, "utf8"));
const route = JSON.parse(readFileSync(routeFile, "utf8"));
const SHEET = [2540, 1252];
const WIDE = { width: 1500, height: 900 };
const NARROW = { width: 360, height: 780 };
const browser = await chromium.launch(BROWSER);
let anna = null;
let berta = null;
let carl = null;

class Person {
  #sockets = new Set();
  #isCut = false;

  /** Opens the page; `isCut`: without a link to the server. */
  static async arrives(more, isCut = false) {
    const me = new Person();
    me.#isCut = isCut;
    const context = await browser.newContext({ acceptDownloads: true, hasTouch: true, ...more });
    await context.routeWebSocket(/\/ws\?/, (socket) => {
      if (me.#isCut) socket.close();
      else {
        socket.connectToServer();
        me.#sockets.add(socket);
      }
    });
    await context.route("**/api/**", (request) => (me.#isCut ? request.abort() : request.continue()));
    Object.assign(me, await opened(context, url, SHEET));
    await me.page.click("#menu-button");
    // Pauses of a busy machine must not count as a hand that holds still, and a finger's breadth is far on a phone.
    for (const setting of ["#hold", "#snap"]) await me.page.uncheck(setting);
    await me.page.click("#menu-button");
    return me;
  }

  /** Breaks the link. */
  async cut() {
    this.#isCut = true;
    await Promise.all([...this.#sockets].map((socket) => socket.close()));
    this.#sockets.clear();
    await this.says("link-role", "Not connected");
  }

  async mend() {
    this.#isCut = false;
    await this.page.waitForFunction(() => document.getElementById("link").dataset.up === "true");
  }

  async says(id, words) {
    await this.page.waitForFunction(([where, what]) => document.getElementById(where).textContent.includes(what), [id, words], { timeout: LIMIT_MS })
      .catch(async (error) => {
        throw new Error(`#${id}: expected "${words}", found "${await this.page.locator(`#${id}`).textContent()}"`, { cause: error });
      });
  }

  /** Selects a tool, with the whole sheet in sight. */
  async takes(tool) {
    await this.hand.tool(tool);
    await this.page.click("#fit");
    await this.hand.settled();
    await this.hand.look();
  }

  async draws(...walls) {
    await this.takes("pen");
    for (const wall of walls) await this.hand.draw(wall);
  }

  /** Drags with the select tool. */
  async moves(from, to) {
    await this.takes("select");
    await this.hand.drag([from, [(from[0] + to[0]) / 2, (from[1] + to[1]) / 2], to]);
  }

  async key(keys) {
    await this.page.focus("#sheet");
    await this.page.keyboard.press(keys);
  }

  /** The drawing as the page has kept it, which it does shortly after every change. */
  kept() {
    return this.page.evaluate(() => JSON.parse(sessionStorage.getItem("draft")));
  }

  /** Waits until the walls begin at these places, from left to right. */
  async has(...walls) {
    try {
      await this.page.waitForFunction((wanted) => {
        const { strokes } = JSON.parse(sessionStorage.getItem("draft") ?? '{"strokes":[]}');
        const found = strokes.map(({ points }) => points[0].map((v) => Math.round(v / 50) * 50).join()).sort();
        return found.join(" ") === wanted;
      }, walls.map((wall) => wall.join()).sort().join(" "), { timeout: 30000 });
    } catch (error) {
      const { strokes } = await this.kept();
      throw new Error(`expected walls at ${JSON.stringify(walls)}, found ${JSON.stringify(strokes.map((s) => s.points[0]))}`, { cause: error });
    }
  }
}

const wall = (x, y) => [[x, y], [x + 200, y], [x + 400, y]];

/** Both themes, at the width of a phone and of a desk. */
async function pictures({ page }, name) {
  const before = page.viewportSize();
  for (const [look, size] of Object.entries({ wide: WIDE, phone: NARROW })) {
    for (const colorScheme of ["light", "dark"]) {
      await page.setViewportSize(size);
      await page.emulateMedia({ colorScheme });
      const frames = () => page.evaluate(() => new Promise((drawn) => { requestAnimationFrame(() => requestAnimationFrame(drawn)); }));
      await frames();
      await page.click("#fit");
      await frames();
      await page.screenshot({ path: join(out, `${name}-${look}-${colorScheme}.png`), animations: "disabled" });
    }
  }
  await page.setViewportSize(before);
  await page.emulateMedia({ colorScheme: null });
}

async function twoDrawAtOnce() {
  anna = await Person.arrives({ viewport: WIDE });
  await anna.says("link-role", "You drive");
  assert.equal(await anna.page.locator("#people-button").isVisible(), false, "nobody else is here");
  await anna.draws(wall(300, 300));
  berta = await Person.arrives({ viewport: NARROW });
  await berta.has([300, 300]);
  await anna.page.waitForSelector("#people-button");
  await Promise.all([anna.draws(wall(300, 500), wall(1000, 500)), berta.draws(wall(300, 700), wall(1000, 700))]);
  const all = [[300, 300], [300, 500], [1000, 500], [300, 700], [1000, 700]];
  await anna.has(...all);
  await berta.has(...all);
}

/** A name is a text, whatever it looks like. */
async function peopleHaveNames() {
  await anna.page.click("#people-button");
  await anna.says("people-list", "guest 2");
  await anna.page.fill("#own-name", "Anna");
  await anna.page.press("#own-name", "Enter");
  await berta.page.waitForSelector("#people-button[aria-label='People: Anna']");
  await berta.page.click("#people-button");
  await berta.says("people-list", "Anna (drives)");
  await berta.says("people-list", "guest 2 (you)");
  await berta.page.fill("#own-name", "<i>Bert</i>");
  await berta.page.press("#own-name", "Enter");
  await anna.page.waitForSelector("#people-button[aria-label='People: <i>Bert</i>']");
  assert.equal(await anna.page.locator("#people-list i").count(), 0);
  await berta.page.click("#people-button");
  await berta.page.fill("#own-name", "Berta");
  await berta.page.press("#own-name", "Enter");
  await anna.page.waitForSelector("#people-button[aria-label='People: Berta']");
}

/** A line is seen while it is being drawn, with the name of its author. */
async function linesAreSeenWhileTheyAreDrawn() {
  await berta.takes("pen");
  const half = anna.page.waitForFunction(() => {
    const line = document.querySelector("#others polyline");
    return line?.getAttribute("points").split(" ").length > 3 && document.querySelector("#others text").textContent === "Berta";
  });
  // The pen waits until Anna has seen the line.
  let moves = 0;
  await berta.hand.drag([[1700, 900], [1800, 1000], [1900, 900], [2000, 1000], [2100, 900]], () => ((moves += 1) < 4 ? berta.hand.settled() : half));
  await anna.page.waitForFunction(() => document.querySelector("#others polyline") === null);
  await anna.has([300, 300], [300, 500], [1000, 500], [300, 700], [1000, 700], [1700, 900]);
  await anna.page.waitForFunction(() => document.querySelector("#others text")?.textContent === "Berta");
}

async function itemsOfOthersAreMovedAndDeleted() {
  await berta.moves([500, 500], [600, 600]);
  await anna.has([300, 300], [400, 600], [1000, 500], [300, 700], [1000, 700], [1700, 900]);
  await anna.takes("select");
  await anna.hand.tap([1200, 700]);
  await anna.key("Delete");
  await berta.has([300, 300], [400, 600], [1000, 500], [300, 700], [1700, 900]);
}

async function undoIsOnesOwn() {
  await berta.draws(wall(300, 1000));
  await anna.has([300, 300], [400, 600], [1000, 500], [300, 700], [1700, 900], [300, 1000]);
  await anna.key("Control+z");
  const back = [[300, 300], [400, 600], [1000, 500], [300, 700], [1700, 900], [300, 1000], [1000, 700]];
  await berta.has(...back);
  // Anna drew the wall that Berta has moved: her undo takes back another one, and leaves this one to Berta.
  await anna.key("Control+z");
  const without = back.filter((at) => at.join() !== "1000,500");
  await berta.has(...without);
  await berta.page.click("#undo");
  await anna.has(...without.filter((at) => at.join() !== "300,1000"));
  await berta.page.click("#redo");
  await anna.key("Control+y");
  await anna.has(...back);
  await berta.has(...back);
}

/** While Anna drags a wall, Berta deletes another one and draws; the wall that Anna drags is the same afterwards. */
async function aGestureGoesOnWhileOthersDraw() {
  await anna.takes("select");
  let first = true;
  await anna.hand.drag([[500, 300], [550, 350], [600, 400]], async () => {
    if (!first) return;
    first = false;
    await berta.takes("select");
    await berta.hand.tap([500, 1000]);
    await berta.page.click("#selection [data-does='remove']");
    await berta.draws(wall(1000, 1000));
    await anna.has([300, 300], [400, 600], [1000, 500], [300, 700], [1700, 900], [1000, 700], [1000, 1000]);
  });
  const all = [[400, 400], [400, 600], [1000, 500], [300, 700], [1700, 900], [1000, 700], [1000, 1000]];
  await anna.has(...all);
  await berta.has(...all);
  await anna.key("Shift+ArrowRight");
  await anna.key("Control+z");
  assert.equal(await anna.page.locator("#selected").textContent(), "Wall selected");
}

/** Nothing is lost that is drawn while the link is broken, even if the page is loaded again. */
async function aPageThatWasCutOffComesBack() {
  await berta.cut();
  await berta.draws(wall(1700, 600));
  await berta.takes("select");
  await berta.hand.tap([500, 700]);
  await berta.page.click("#selection [data-does='remove']");
  await anna.draws(wall(300, 1100));
  await anna.takes("select");
  await anna.hand.tap([1200, 500]);
  await anna.key("Delete");
  await anna.has([400, 400], [400, 600], [300, 700], [1700, 900], [1000, 700], [1000, 1000], [300, 1100]);
  await berta.has([400, 400], [400, 600], [1000, 500], [1700, 900], [1000, 700], [1000, 1000], [1700, 600]);
  await berta.page.reload();
  await berta.draws(wall(1700, 100));
  await berta.has([400, 400], [400, 600], [1000, 500], [1700, 900], [1000, 700], [1000, 1000], [1700, 600], [1700, 100]);
  await berta.mend();
  const all = [[400, 400], [400, 600], [1700, 900], [1000, 700], [1000, 1000], [300, 1100], [1700, 600], [1700, 100]];
  await anna.has(...all);
  await berta.has(...all);
}

/** The server dies, and with it all that it knows of the drawing. The pages tell its successor. */
async function theServersSuccessorHearsOfTheDrawing() {
  const pid = padPid();
  if (!pid) return;
  process.kill(pid, "SIGKILL");
  const walls = (await anna.kept()).strokes.map(({ points }) => points[0].map((v) => Math.round(v / 50) * 50));
  await Promise.all([anna.draws(wall(600, 100)), berta.draws(wall(600, 1200))]);
  for (const me of [anna, berta]) await me.has(...walls, [600, 100], [600, 1200]);
  for (const me of [anna, berta]) {
    await me.page.waitForFunction(() => document.getElementById("link").dataset.up === "true");
    await me.page.click("#undo");
  }
  for (const me of [anna, berta]) await me.has(...walls);
  await anna.says("link-role", "You drive");
}

/** A drawing of one's own stays, whether one joins the others or they join. */
async function aNewcomerHasADrawingOfHisOwn() {
  const shared = (await anna.kept()).strokes.map(({ points }) => points[0]);
  carl = await Person.arrives({ viewport: WIDE }, true);
  await carl.draws(wall(800, 800));
  await carl.has([800, 800]);
  await carl.mend();
  await carl.says("together-words", "Anna and Berta draw in another drawing.");
  await carl.page.click("#menu-button");
  await carl.says("drawing-name", "Drawing 1");
  await carl.page.click("#menu-button");
  await pictures(carl, "together-choice");
  await carl.page.click("#join");
  await carl.page.waitForSelector("#together", { state: "hidden" });
  await carl.has(...shared.map((at) => at.map((v) => Math.round(v / 50) * 50)));
  await carl.draws(wall(800, 900));
  await anna.page.waitForFunction((count) => JSON.parse(sessionStorage.getItem("draft")).strokes.length === count, shared.length + 1);
  await carl.key("Control+o");
  await carl.page.waitForSelector("#shelf li:nth-child(2)");
  assert.deepEqual(await carl.page.locator("#shelf input").evaluateAll((all) => all.map((field) => field.value)), ["Drawing 2", "Drawing 1"]);
  await carl.page.click("#shelf [aria-label='Open “Drawing 1”']");
  await carl.has([800, 800]);
  await carl.page.waitForSelector("#together");
  await anna.page.click("#people-button");
  await anna.says("people-list", "guest 3 (in another drawing)");
  await anna.page.click("#people-button");
  await carl.page.click("#share");
  await anna.has([800, 800]);
  await berta.has([800, 800]);
  await anna.says("say", "Another drawing is shared now.");
  await anna.draws(wall(800, 400));
  await carl.has([800, 800], [800, 400]);
  // The last drawing is still in the library.
  await anna.key("Control+o");
  await anna.page.waitForSelector("#shelf li:nth-child(2)");
  await anna.page.click("#library-close");
  await carl.page.context().close();
}

const press = ({ page }, id) => page.click(`#${id}:enabled`);

/** The map of a mission, drawn by two, sent by one, driven by the other. */
async function theMapOfTwoIsDriven() {
  // The others leave, or follow: a new drawing is shared by whoever wants to.
  await anna.hand.menu(map.canvas[0] > map.canvas[1] ? "new-landscape" : "new-portrait");
  for (const me of [anna, berta]) me.hand.canvas = map.canvas;
  await anna.says("together-words", "Berta draws in another drawing.");
  await press(anna, "share");
  await berta.says("say", "Another drawing is shared now.");
  const strokes = map.strokes.map(({ points }) => points);
  const half = strokes.length >> 1;
  await Promise.all([anna.draws(...strokes.slice(0, half)), berta.draws(...strokes.slice(half))]);
  for (const [i, { polygon }] of (map.obstacles ?? []).entries()) {
    const me = [anna, berta][i % 2];
    await me.takes("polygon");
    for (const corner of [...polygon, polygon[0]]) await me.hand.tap(corner);
    await me.page.press("#label-text", "Enter");
  }
  const counts = [strokes.length, (map.obstacles ?? []).length];
  for (const { page } of [anna, berta]) {
    await page.waitForFunction(([walls, things]) => {
      const { strokes: a, obstacles: b } = JSON.parse(sessionStorage.getItem("draft"));
      return a.length === walls && b.length === things;
    }, counts);
  }
  await anna.page.click("#menu-button");
  await anna.page.fill("#limit", "60");
  await anna.page.press("#limit", "Enter");
  await anna.says("say", "pauses after 60 s");
  await anna.page.click("#menu-button");
  await press(anna, "send-sketch");
  await anna.says("say", "The map has arrived");
  assert.equal(await berta.page.locator("#send-path").isVisible(), false, "one page drives");

  await berta.page.click("#plea button");
  await anna.says("pleas", "Berta asks for the wheel.");
  await anna.page.click("#pleas button:text('Hand over')");
  await berta.says("link-role", "You drive");
  await berta.takes("path");
  await berta.hand.draw(route);
  await anna.page.waitForFunction((count) => JSON.parse(sessionStorage.getItem("draft")).route?.length >= count, 2);
  await press(berta, "send-path");
  await berta.says("say", "The path has arrived");
  await press(berta, "execute");
  await anna.says("headline", "Driving");
  await anna.takes("pen");
  await berta.takes("pen");
  await anna.page.click("#shows summary");
  // Berta holds the pen while the pictures are taken.
  const line = [[0.45, 0.08], [0.5, 0.2], [0.53, 0.12], [0.58, 0.24], [0.6, 0.15]].map((at) => at.map((part, i) => part * map.canvas[i]));
  let moved = 0;
  await berta.hand.drag(line, async () => {
    moved += 1;
    await berta.hand.settled();
    if (moved < line.length - 1) return;
    await anna.page.waitForSelector("#others polyline");
    await pictures(anna, "together");
  });
  await berta.page.click("#undo");
  await anna.says("headline", "Finished");
  await anna.says("task", "1 of 1 task reached");
  await anna.page.click("#plea button");
  await berta.says("pleas", "Anna asks for the wheel.");
  await berta.page.click("#pleas button:text('Hand over')");
  await anna.says("link-role", "You drive");
}

try {
  await inTurn(
    [
      twoDrawAtOnce, peopleHaveNames, linesAreSeenWhileTheyAreDrawn, itemsOfOthersAreMovedAndDeleted, undoIsOnesOwn,
      aGestureGoesOnWhileOthersDraw, aPageThatWasCutOffComesBack, theServersSuccessorHearsOfTheDrawing,
      aNewcomerHasADrawingOfHisOwn, theMapOfTwoIsDriven,
    ],
    (step) => step(), () => anna?.page, out,
  );
  assertNoFaults(/WebSocket|ERR_|Failed to load/);
} finally {
  await browser.close();
}
