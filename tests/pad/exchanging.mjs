// Acts as a person who imports and exports drawings on the running page: `node exchanging.mjs URL OUT`.
// Environment: SKETCHNAV_PLAYWRIGHT (the folder of node_modules), SKETCHNAV_CHROMIUM.
//
// Drops, pastes and opens pictures and drawings of other programs, undoes each in one step, and saves PNG and SVG. Checks that
// nothing in a file is run or fetched, and the errors for bad files. Saves `exported.svg`, `exported.json` and screenshots in OUT.
// Fails at the first violation.

import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";

import { BROWSER, assertNoFaults, chromium, faults, inTurn, opened } from "./visit.mjs";


const [url, out] = process.argv.slice(2);
const CANVAS = [2540, 1252];
const COURT = readFileSync(new URL("../../sim/missions/routes/court-01.json", import.meta.url), "utf8");
const browser = await chromium.launch(BROWSER);

const part = (type, more) => ({ id: type, type, x: 0, y: 0, width: 100, height: 50, angle: 0, strokeWidth: 2, isDeleted: false, groupIds: [], backgroundColor: "transparent", ...more });
const FLAT = [
  part("rectangle", { width: 600, height: 300 }),
  part("text", { x: 100, y: 50, width: 60, height: 20, text: "kitchen" }),
  part("ellipse", { x: 350, y: 80, width: 80, height: 80, backgroundColor: "#ffc9c9" }),
  part("freedraw", { x: 300, points: [[0, 0], [2, 80], [-3, 180]] }),
  part("arrow", { x: 60, y: 200, points: [[0, 0], [180, 20], [200, -100]] }),
  part("image", { fileId: "f" }),
];
const EXCALIDRAW = JSON.stringify({ type: "excalidraw", version: 2, source: "https://excalidraw.com", elements: FLAT, files: {} });

/** A room, a table and a name, along with everything that could run or fetch something. */
const HOSTILE = `<?xml version="1.0"?>
<!DOCTYPE svg [<!ENTITY far SYSTEM "http://far.example/entity">]>
<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 200 100" onload="window.ran = 1">
<style>@import url(http://far.example/a.css); .wall { fill: none; stroke: #123; stroke-width: 2 } .far { fill: url(http://far.example/#f) }</style>
<script>window.ran = 2</script><script href="http://far.example/a.js"/>
<rect width="200" height="100" fill="white"/>
<rect class="wall" x="10" y="10" width="180" height="80"/>
<g transform="translate(100 50)"><path d="M-10-5h20v10h-20z" onclick="window.ran = 3"><title>table</title></path></g>
<use href="#door" x="40"/><defs><path id="door" d="M0 10v30" stroke="black"/></defs>
<text x="50" y="30" text-anchor="middle" font-size="8">kit<tspan>chen</tspan></text>
<image href="http://far.example/b.png" width="10" height="10"/><image xlink:href="http://far.example/c.png" width="10" height="10"/>
<foreignObject width="9" height="9"><iframe xmlns="http://www.w3.org/1999/xhtml" src="http://far.example/"/><img xmlns="http://www.w3.org/1999/xhtml" src="http://far.example/d.png" onerror="window.ran = 4"/></foreignObject>
<a href="javascript:window.ran = 5"><line x1="10" y1="60" x2="60" y2="60" stroke="rgb(0 0 0)"/></a>
<use href="http://far.example/e.svg#x"/><animate attributeName="x" onbegin="window.ran = 6" dur="1s"/>
</svg>`;

class Person {
  constructor(page, hand) {
    Object.assign(this, { page, hand });
  }

  async says(words) {
    await this.page.waitForFunction((what) => document.getElementById("say").textContent.includes(what), words);
  }

  async drawing() {
    return JSON.parse(await this.hand.saved());
  }

  file(name, content) {
    const path = join(out, name);
    writeFileSync(path, content);
    return path;
  }

  /** Drops files onto the sheet, as from a file manager. */
  async drop(...files) {
    const { x, y } = this.hand.at([400, 400]);
    const data = { items: [], files, dragOperationsMask: 1 };
    for (const type of ["dragEnter", "dragOver", "drop"]) await this.hand.cdp.send("Input.dispatchDragEvent", { type, x, y, data });
  }

  async paste() {
    await this.page.focus("#sheet");
    await this.page.keyboard.press("Control+v");
  }

  async blank() {
    await this.hand.menu("new-landscape");
    await this.page.keyboard.press("0");
    await this.hand.look();
  }
}

async function visit(context) {
  const { page, hand } = await opened(context, url, CANVAS, (page) => {
    page.on("request", (request) => /far\.example/.test(request.url()) && faults.push(`fetched ${request.url()}`));
    page.on("dialog", (dialog) => faults.push(`a dialog: ${dialog.message()}`));
  });
  await hand.look();
  return new Person(page, hand);
}

/** A picture as from a camera or a scanner: a dark bar on white. */
const picture = async (me, type) => Buffer.from(await me.page.evaluate((kind) => {
  const canvas = Object.assign(document.createElement("canvas"), { width: 400, height: 200 });
  const context = canvas.getContext("2d");
  context.fillStyle = "#fff";
  context.fillRect(0, 0, 400, 200);
  context.fillStyle = "#000";
  context.fillRect(50, 90, 300, 10);
  return canvas.toDataURL(kind).split(",")[1];
}, type), "base64");

// ---------------------------------------------------------------------------- in

async function pictures(me) {
  for (const type of ["png", "jpeg"]) {
    const file = me.file(`scan.${type}`, await picture(me, `image/${type}`));
    await me.blank();
    await me.drop(file);
    await me.says(`“scan.${type}” is open`);
    let drawing = await me.drawing();
    assert.deepEqual(drawing.canvas, [400, 200], "onto a blank sheet: the map");
    assert.match(drawing.pad.photo, /^data:image\/jpeg/);
    await me.page.click("#undo");
    assert.equal((await me.drawing()).pad, undefined, "one step back");
    await me.hand.draw([[300, 300], [900, 300]]);
    await me.drop(file);
    await me.says("lies under the sheet");
    drawing = await me.drawing();
    assert.ok(drawing.pad.underlay && !drawing.pad.photo && drawing.strokes.length === 1, "onto a drawing: under it");
    await me.page.click("#undo");
    assert.equal((await me.drawing()).pad.underlay, undefined);
  }
  await me.blank();
  await me.page.evaluate(async () => {
    const canvas = Object.assign(document.createElement("canvas"), { width: 300, height: 100 });
    const blob = await new Promise((done) => { canvas.toBlob(done, "image/png"); });
    await navigator.clipboard.write([new ClipboardItem({ "image/png": blob })]);
  });
  await me.paste();
  await me.says("is open");
  assert.deepEqual((await me.drawing()).canvas, [300, 100], "a picture that was pasted");
}

async function excalidraw(me) {
  await me.blank();
  await me.drop(me.file("flat.excalidraw", EXCALIDRAW));
  await me.says("“flat.excalidraw” is open. Left out: picture.");
  let drawing = await me.drawing();
  assert.deepEqual([drawing.strokes.length, drawing.obstacles.length, drawing.route.length, drawing.labels[0].text], [2, 1, 3, "kitchen"]);
  assert.equal(await me.page.textContent("#drawing-name"), "flat");
  await me.page.screenshot({ path: join(out, "excalidraw.png") });
  await me.page.click("#undo");
  assert.equal((await me.drawing()).strokes.length, 0);
  // When it is pasted onto a drawing, it is placed in the middle and selected.
  await me.hand.draw([[100, 100], [200, 100]]);
  await me.page.evaluate((text) => navigator.clipboard.writeText(text), JSON.stringify({ type: "excalidraw/clipboard", elements: FLAT.slice(0, 3) }));
  await me.paste();
  await me.says("A drawing was pasted.");
  drawing = await me.drawing();
  assert.deepEqual([drawing.strokes.length, drawing.obstacles.length, drawing.labels.length], [2, 1, 1]);
  const xs = drawing.strokes[1].points.map(([x]) => x);
  assert.ok(Math.abs((Math.min(...xs) + Math.max(...xs)) / 2 - CANVAS[0] / 2) < 40 && Math.max(...xs) - Math.min(...xs) < CANVAS[0] / 2, `${xs}`);
  assert.match(await me.page.textContent("#selected"), /^3 selected/);
  await me.page.keyboard.press("Control+z");
  assert.equal((await me.drawing()).strokes.length, 1);
}

async function svgRunsNothing(me) {
  await me.blank();
  await me.drop(me.file("hostile.svg", HOSTILE));
  await me.says("“hostile.svg” is open. Left out: 2 × picture, HTML, reference.");
  const drawing = await me.drawing();
  assert.deepEqual(drawing.canvas, [2540, 1270]);
  assert.equal(drawing.strokes.length, 3);
  assert.deepEqual(drawing.strokes[0].points[0], [127, 127]);
  assert.deepEqual(drawing.strokes[1].points, [[508, 127], [508, 508]], "a line that is used elsewhere");
  assert.equal(drawing.strokes[0].width_px, 25.4);
  assert.deepEqual(drawing.obstacles.map(({ label }) => label), ["table"]);
  assert.equal(drawing.labels[0].text, "kitchen");
  await me.page.screenshot({ path: join(out, "svg.png") });
  // The library shows a picture of it as well.
  await me.page.keyboard.press("Control+o");
  await me.page.waitForFunction(() => document.querySelector("#shelf img")?.naturalWidth > 0);
  await me.page.keyboard.press("Escape");
  assert.equal(await me.page.evaluate(() => window.ran), undefined, "nothing in the file has run");
}

async function badFilesSayWhatIsWrong(me) {
  await me.hand.open("court.json", COURT);
  const before = await me.hand.saved();
  for (const [name, content, words] of [
    ["notes.txt", "walls", "notes.txt: expected a drawing (JSON, .excalidraw, SVG) or a picture (PNG, JPEG)."],
    ["cut.json", '{"canvas": [10, 10], ', "cut.json: expected a drawing in JSON"],
    ["odd.json", '{"canvas": [10, 10], "strokes": [{"points": [[0, 0], [1]]}]}', "odd.json: strokes[0].points[1]: expected a point within 100000 px, found [1]."],
    ["cut.excalidraw", '{"type": "excalidraw", "elements": [{"type": "line", "x": 0, "y": 0}]}', "cut.excalidraw: elements[0].points: expected a list, found nothing."],
    ["cut.svg", '<svg xmlns="http://www.w3.org/2000/svg"><g>', "cut.svg: expected an SVG: error on line 1"],
    ["page.svg", "<html><p>walls</p></html>", "page.svg: expected an SVG: found <html>."],
    ["empty.svg", '<svg xmlns="http://www.w3.org/2000/svg"/>', "empty.svg: expected walls, found no line and no shape."],
    ["ring.svg", '<svg xmlns="http://www.w3.org/2000/svg"><g id="a"><use href="#a"/><use href="#a"/></g></svg>', "ring.svg: expected at most 50000 elements, found more."],
    ["cut.png", "walls", "cut.png: expected a picture (PNG, JPEG), found something else."],
  ]) {
    await me.drop(me.file(name, content));
    await me.says(words);
    assert.equal(await me.page.getAttribute("#say", "data-bad"), "true", name);
  }
  assert.equal(await me.hand.saved(), before, "the drawing is as it was");
}

/** Copied items can be pasted on another page, and form a drawing as text. */
async function copiesToAnotherPage(me, context) {
  await me.hand.open("court.json", COURT);
  await me.page.focus("#sheet");
  await me.page.keyboard.press("Control+a");
  await me.page.keyboard.press("Control+c");
  const other = await visit(context);
  await other.blank();
  await other.paste();
  await other.says("A drawing was pasted.");
  const [drawing, court] = [await other.drawing(), JSON.parse(COURT)];
  assert.deepEqual(drawing.obstacles, court.obstacles);
  assert.equal(drawing.strokes.length, court.strokes.length);
  await other.page.close();
  await me.page.bringToFront();
}

// ---------------------------------------------------------------------------- out

async function exported(me, id) {
  const download = me.page.waitForEvent("download");
  await me.hand.menu(id);
  const done = await download;
  const path = join(out, `exported.${id.slice(5)}`);
  await done.saveAs(path);
  return { name: done.suggestedFilename(), bytes: readFileSync(path) };
}

async function savesPictures(me) {
  await me.hand.open("court.json", COURT);
  await me.hand.tool("goal");
  await me.hand.look();
  await me.hand.tap([1000, 1100]);
  await me.hand.tool("pen");
  writeFileSync(join(out, "exported.json"), await me.hand.saved());
  const { name, bytes } = await exported(me, "save-png");
  assert.match(name, /court\.png$/);
  const tones = await me.page.evaluate(async (data) => {
    const image = await createImageBitmap(new Blob([Uint8Array.from(atob(data), (c) => c.charCodeAt(0))]));
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const tone = (x, y) => [...context.getImageData(x, y, 1, 1).data.slice(0, 3)];
    return { size: [image.width, image.height], paper: tone(20, 20), goal: tone(1012, 1112) };
  }, bytes.toString("base64"));
  assert.deepEqual(tones.size, CANVAS);
  assert.deepEqual(tones.paper, [255, 255, 255]);
  assert.deepEqual(tones.goal, [13, 110, 168], "the goal is on it");

  const before = await me.hand.saved();
  const svg = await exported(me, "save-svg");
  await me.blank();
  await me.drop(join(out, "exported.svg"));
  await me.says("“exported.svg” is open.");
  assert.equal(await me.hand.saved(), before, "an SVG of this page is read as it was");
  assert.match(svg.name, /court\.svg$/);
}

/** With fingers on a phone. */
async function byFingers(me) {
  await me.page.setViewportSize({ width: 360, height: 740 });
  const chooser = me.page.waitForEvent("filechooser");
  await me.page.tap("#menu-button");
  await me.page.screenshot({ path: join(out, "menu-phone.png") });
  await me.page.tap("#open");
  await (await chooser).setFiles(me.file("phone.excalidraw", EXCALIDRAW));
  await me.says("“phone.excalidraw” is open.");
  assert.equal((await me.drawing()).strokes.length, 2);
}

async function main() {
  const context = await browser.newContext({ viewport: { width: 1500, height: 900 }, hasTouch: true, acceptDownloads: true, permissions: ["clipboard-read", "clipboard-write"] });
  const me = await visit(context);
  await inTurn([pictures, excalidraw, svgRunsNothing, badFilesSayWhatIsWrong, copiesToAnotherPage, savesPictures, byFingers], (step) => step(me, context), () => me.page, out);
  await context.close();
  // The page's policy blocks the styles and handlers of a parsed file, and the browser reports this.
  assertNoFaults(/WebSocket|ERR_CONNECTION|404|^(Applying inline style|Executing inline event handler)/);
}

try {
  await main();
} finally {
  await browser.close();
}
