// The page: connects the desk, the link, the panel and the user's input. The server decides which steps the robot accepts; a button
// here is enabled only when the server allows its step.

import { bindBar, showBar } from "./bar.js";
import { doubts, withRoomNames } from "./checks.js";
import { Desk } from "./desk.js";
import { bindExchange } from "./exchange.js";
import { choose, dataUrl, flattened, nameOf, photo, png, save } from "./files.js";
import { itemOf, movedKey } from "./items.js";
import { Keeper, begun } from "./keeper.js";
import { Crosshair, shortcuts } from "./keyboard.js";
import { Lessons } from "./learned.js";
import { Library } from "./library.js";
import { Link, takeToken } from "./link.js";
import {
  LANDSCAPE, PORTRAIT, blank, fromFile, hasMap, hasPath, isBlank, isEditOf, pathBody, pointCount, sketchBody, toText, withLabel,
  withOtherText, withPath, withStart, withText,
} from "./model.js";
import { ACCEPTED, fromWords, leftOut, readFile } from "./outside.js";
import { People } from "./people.js";
import { onQuestion, say, show, showDoubts, showFigures } from "./panel.js";
import { Pointers, listen } from "./pointer.js";
import { keep, load } from "./settings.js";
import { Shelf } from "./shelf.js";
import { isAsked, meant, missing, tooMuch } from "./states.js";
import { Study } from "./study.js";
import { toSvg } from "./svg.js";
import { Together } from "./together.js";
import { onSheet } from "./view.js";
import { bindWheel, showWheel } from "./wheel.js";

const at = (id) => document.getElementById(id);
const settings = load();
/** A tap this close to a place that the robot asks about means that place, screen pixels. */
const NEAR_PX = 28;
/** Delay between a change and the check of the drawing, milliseconds. */
const CHECK_MS = 250;
/** Size of another program's drawing when it is pasted onto one, as a fraction of the sheet. */
const PASTED = 0.5;
const robot = { feed: null, hello: null, busy: false, fedAt: 0, walls: null, placed: readPlaced(), sent: null };
/** What text is being asked for: the text of the item `key` of the drawing `of`, or a new text `at` a place. */
let asking = null;

// ---------------------------------------------------------------------------- drawing

const host = {
  settings: () => (robot.hello?.mode === "watches" ? { ...settings, shows: { ...settings.shows, walls: true } } : settings),
  say, label: (key) => askText({ key, of: desk.drawing }), write: (at) => askText({ at }), changed: drawingChanged, selected: () => showBar(desk?.selecting),
  viewed: () => viewed(), drawn: (feed) => link.seen(feed.n),
  asked: () => isAsked(robot.feed), answer: (at, heading_deg) => answer(meant(robot.feed.question, at, desk.sheet.px(NEAR_PX)), heading_deg),
};
let [crosshair, together, people] = [null, null, null];
const shelf = new Shelf();
const keeper = new Keeper(shelf, {
  keeps, isShared: (drawing) => together.isInside && drawing.id === desk.drawing.id, beside: (drawing) => together.keptBeside(drawing),
  reread: (id) => together?.reread(id),
  named: (name) => { at("drawing-name").textContent = name ?? "Not in the library yet"; }, say,
});
const desk = new Desk(at("sheet"), keeper.reloaded() ?? begun(blank(matchMedia("(orientation: portrait)").matches ? PORTRAIT : LANDSCAPE)), host);
const library = new Library(shelf, {
  current: () => keeper.entryOf(desk.drawing), open: openKept, followed: (entry) => keeper.follow(entry),
});
const pointers = new Pointers(desk, () => (
  { hand: desk.tool === "hand" && !host.asked(), fingers: settings.fingers || host.asked(), picks: desk.tool === "select" }
));
listen(at("sheet"), pointers);
crosshair = new Crosshair(at("sheet"), at("crosshair"), desk.sheet, desk, () => desk.close(), () => desk.selecting);
bindBar(desk, at("sheet"));
window.addEventListener("blur", () => pointers.cancelAll());

function viewed() {
  crosshair?.place();
  people?.draw();
}

/** Tools that change existing items. */
const EDITS = ["select", "door"];

function drawingChanged() {
  together?.changed(desk.drawing);
  keeper.changed(desk.drawing);
  checking ||= setTimeout(check, CHECK_MS);
  at("undo").disabled = !desk.canUndo;
  at("redo").disabled = !desk.canRedo;
  for (const button of document.querySelectorAll("#tools [data-tool]")) {
    button.setAttribute("aria-pressed", String(button.dataset.tool === desk.tool));
  }
  study.saw(desk.drawing, EDITS.includes(desk.tool));
  showBar(desk.selecting);
  refresh();
}

let [checking, checked] = [0, null];

/** Marks what looks wrong with the drawing, once the user pauses and if the robot could be sent along it. */
function check() {
  checking = desk.isBusy ? setTimeout(check, CHECK_MS) : 0;
  const { pose } = robot.feed ?? {};
  const isOff = study.takesPart || robot.hello?.mode === "watches";
  if (checking || (checked === desk.drawing && !pose)) return;
  checked = desk.drawing;
  const found = isOff ? [] : doubts(desk.drawing, pose ? [pose.x, pose.y] : null);
  desk.doubt(found);
  showDoubts(found);
}

/** Whether the current drawing belongs in the library. Drawings of a study do not, and a page that watches a mission has none. */
function keeps() {
  const { hello } = robot;
  return hello ? !hello.study && hello.mode !== "watches" : link.failed;
}

/** Whether the page may still show the last drawing. Later, a blank sheet is one that somebody has begun. */
let isNewlyOpened = true;

/** A newly opened page shows the last drawing that was on a sheet, unless the robot has another. */
async function resume() {
  if (robot.hello?.study || robot.hello?.mode === "watches") return;
  const kept = await keeper.resumed(desk.drawing);
  if (isNewlyOpened && kept && isBlank(desk.drawing) && !robot.hello?.drawing) desk.renew(kept);
  if (!isBlank(desk.drawing)) isNewlyOpened = false;
  keeper.changed(desk.drawing);
}

async function openKept(id) {
  if (id !== keeper.entryOf(desk.drawing)) desk.change(await keeper.open(id));
}

/** The pose at which the robot was placed: this start is not sent again, not even after a reload. */
function setPlaced(start) {
  robot.placed = start;
  sessionStorage.setItem("placed", JSON.stringify(start));
}

function readPlaced() {
  try {
    return JSON.parse(sessionStorage.getItem("placed"));
  } catch {
    return null;
  }
}

function askText(what) {
  asking = what;
  const item = what.key && itemOf(desk.drawing, what.key);
  const isObstacle = what.key?.startsWith("obstacles") ?? false;
  at("label").hidden = false;
  at("label-question").textContent = isObstacle ? "What is it?" : "Which place is it?";
  at("label-text").placeholder = isObstacle ? "table" : "kitchen";
  at("label-text").value = item?.label ?? item?.text ?? "";
  at("label-text").focus();
}

/** The drawing with the entered text. */
function answered(drawing, { key: asked, of, at: place }, words) {
  if (place) return words ? withText(drawing, words, place) : drawing;
  const key = of === drawing ? asked : movedKey(asked, of, drawing);
  if (!key || !itemOf(drawing, key)) return drawing;
  const index = Number(key.split(":")[1]);
  return key.startsWith("labels") ? withOtherText(drawing, index, words) : withLabel(drawing, index, words);
}

at("label").addEventListener("submit", (event) => {
  event.preventDefault();
  at("label").hidden = true;
  at("sheet").focus();
  desk.change(answered(desk.drawing, asking, at("label-text").value.trim()));
});
at("label").addEventListener("focusout", (event) => {
  if (!at("label").contains(event.relatedTarget) && !at("label").hidden) at("label").requestSubmit();
});

// ---------------------------------------------------------------------------- link

const link = new Link(takeToken(), {
  changed() {
    if (link.failed) resume();
    refresh();
  },
  hello(hello, isNew) {
    const before = robot.hello;
    robot.hello = hello;
    at("mission").textContent = hello.mission ? `· ${hello.mission}` : "";
    document.title = hello.mission ? `${hello.mission} · sketchnav pad` : "sketchnav pad";
    if (hello.limits?.link_limit_s && document.activeElement !== at("limit")) at("limit").value = hello.limits.link_limit_s;
    if (hello.trail) desk.trail = hello.trail;
    study.told(hello.study ?? null, hello.drives);
    const draws = hello.mode === "draws" && !hello.study;
    if (isNew) together.linked(draws);
    if (isNew && draws) people.tell();
    if (draws) takeSent(hello, before);
    else takeDrawing(hello, before).then(resume);
    takeWalls(hello.walls);
    lessons.take(learned());
    refresh();
  },
  feed(feed) {
    robot.feed = feed;
    robot.fedAt = performance.now();
    desk.told(feed);
    takeWalls(feed.walls);
    lessons.take(feed.learned);
    refresh();
  },
  drawn: (news) => together.told(news),
  people: (all) => together.met(all),
});

together = new Together({
  desk, link, changed: () => refresh(), say, kept: (id) => keeper.kept(id), begun: begin,
  found: async (id) => {
    await keeper.rescue().catch(() => {});
    return keeper.open(id).catch(() => null);
  },
});
people = new People({
  desk, together, tell: (presence) => link.show(presence), named: (name) => { at("plea-name").value = name; },
});

/** Nobody shares a drawing: the sheet shows the robot's, or the last one of the library. */
async function begin() {
  if (isBlank(desk.drawing)) await takeDrawing(robot.hello, null);
  await resume();
}

/** A page that does not drive knows what the robot was sent last, in case it will drive. */
function takeSent({ drives, drawing, path }, before) {
  const isNews = JSON.stringify([drawing, path]) !== JSON.stringify([before?.drawing, before?.path]);
  if (drives || !isNews) return;
  setPlaced(path?.start ?? null);
  try {
    robot.sent = drawing && !drawing.image ? fromFile(drawing) : null;
  } catch {
    robot.sent = null;
  }
}

const study = new Study({
  desk, changed: () => refresh(), picture: (path) => link.fetch(path), forget: () => keeper.forget(),
  post: (told) => link.post("/api/study", JSON.stringify(told)),
});

/** A page with a blank sheet, or that takes no part in drawing, shows what the robot was sent. */
async function takeDrawing(hello, before) {
  if (hello.mode === "watches") {
    if (desk.tool !== "hand") desk.take("hand");
    if (hello.canvas && hello.canvas.join() !== desk.drawing.canvas.join()) desk.change(begun(blank(hello.canvas)));
    return;
  }
  const news = JSON.stringify([hello.drawing, hello.path]) !== JSON.stringify([before?.drawing, before?.path]);
  if (!hello.drawing || !news || (hello.drives && !isBlank(desk.drawing))) return;
  try {
    const drawing = await sentDrawing(hello.drawing);
    desk.change(await keeper.taken(hello.path ? withPath(drawing, hello.path) : drawing));
    setPlaced(hello.path?.start ?? null);
  } catch (error) {
    say(`The drawing on the server cannot be shown: ${error.message}`, true);
  }
}

/** A drawing in the server's format: strokes, or the address of a photo. */
async function sentDrawing(sent) {
  if (!sent.image) return fromFile(sent);
  return { ...blank(sent.canvas), photo: await dataUrl(await link.fetch(sent.image)) };
}

async function takeWalls(number) {
  if (!number || number === robot.walls) return;
  robot.walls = number;
  try {
    desk.walls = await createImageBitmap(await link.fetch(`/api/walls.png?k=${number}`));
    desk.redrawFeed();
  } catch {
    robot.walls = null;
  }
}

const lessons = new Lessons((path) => link.fetch(path), (picture) => {
  desk.learned = picture;
  desk.redrawFeed();
});

/** What the robot has learned; `null` if nothing. The feed has it during a drive, before the first feed the greeting does. */
const learned = () => (robot.feed ? robot.feed.learned : robot.hello?.learned) ?? null;

function refresh() {
  const { drawing } = desk;
  const { practising } = study;
  study.refresh(robot.feed);
  people.show();
  const drives = robot.feed?.drives ?? robot.hello?.drives ?? false;
  const placing = robot.hello?.placing;
  showWheel({ up: link.up, drives, study: Boolean(robot.hello?.study), feed: robot.feed }, say);
  show({
    up: link.up, refusal: link.refusal, latencyMs: link.latencyMs, drives,
    watches: robot.hello?.mode === "watches", draws: robot.hello?.mode === "draws" && !robot.hello.study, busy: robot.busy, feed: robot.feed, seen: robot.hello !== null,
    practising, questions: study.hasQuestions(robot.feed),
    learned: learned(),
    together: together.isInside,
    placing, lacks: missing({ placing, drawing, feed: robot.feed, learned: learned() }),
    map: hasMap(drawing) && !practising, path: hasPath(drawing) && !practising,
    silentS: robot.fedAt ? (performance.now() - robot.fedAt) / 1000 : 0,
  });
}
setInterval(refresh, 1000);

// ---------------------------------------------------------------------------- steps

/** Runs one request at a time and reports the outcome. */
async function request(work) {
  robot.busy = true;
  refresh();
  try {
    say(await work());
  } catch (error) {
    say(error.message, true);
  } finally {
    robot.busy = false;
    refresh();
  }
}

async function sendSketch() {
  const { drawing } = desk;
  const picture = drawing.photo !== null;
  const body = picture ? await flattened(drawing) : sketchBody(drawing);
  const bytes = picture ? body.size : new TextEncoder().encode(body).length;
  refuse(tooMuch(robot.hello?.limits, { strokes: drawing.strokes.length, points: pointCount(drawing), bytes }));
  const stands = standing(drawing);
  const answer = await link.send("/api/sketch", body, picture ? "image/jpeg" : "application/json", broken);
  if (stands) desk.change(withStart(desk.drawing, stands.at, stands.heading_deg));
  robot.sent = drawing;
  setPlaced(null);
  desk.trail = [];
  // A sketch of objects has no walls.
  const degrees = answer.wall_direction_rad === null ? NaN : (answer.wall_direction_rad * 180) / Math.PI;
  if (stands) return doubted(answer, "The map has arrived. The start is now where the robot stands.");
  // Avoids "-0.0°".
  return doubted(answer, Number.isFinite(degrees) ? `The map has arrived. Its walls run at ${(Math.round(degrees * 10) / 10 + 0).toFixed(1)}°.` : "The map has arrived.");
}

/**
 * The robot's pose as a start, if `drawing` is an edit of the map that the robot has and the robot is localized. `null` otherwise,
 * and if the user has marked another start or drawn a path, which begins at its own first point.
 */
function standing(drawing) {
  const { pose } = robot.feed ?? {};
  const isMarked = drawing.start && JSON.stringify(drawing.start) !== JSON.stringify(robot.placed);
  const sent = robot.sent && { id: drawing.id, ...robot.sent };
  if (pose?.tracking !== "tracking" || isMarked || drawing.route || !sent || !isEditOf(sent, drawing)) return null;
  return { at: [pose.x, pose.y], heading_deg: (pose.heading_rad * 180) / Math.PI };
}

/** The reply to the user, with the robot's doubts. */
function doubted(answer, words) {
  return answer.doubts ? `${words} But: ${answer.doubts}.` : words;
}

async function sendPath() {
  const { drawing } = desk;
  refuse(tooMuch(robot.hello?.limits, { route: drawing.route?.length, goals: drawing.goals.length }));
  const answer = await link.send("/api/path", pathBody(withRoomNames(drawing), robot.placed), "application/json", broken);
  setPlaced(drawing.start);
  desk.trail = [];
  return doubted(answer, drawing.route ? "The path has arrived." : `${drawing.goals.length === 1 ? "The goal has" : "The goals have"} arrived.`);
}

const broken = () => say("The link broke while this was being sent. It will be sent again when the link is back.", true);

function refuse(words) {
  if (words) throw new Error(words);
}

const ORDERS = { execute: "The robot drives.", restore: "The robot continues.", again: "The robot starts again." };

for (const [order, words] of Object.entries(ORDERS)) {
  at(order).addEventListener("click", () => request(async () => {
    if (order === "execute") await study.beforeDrive();
    await link.post("/api/order", JSON.stringify({ order }));
    return words;
  }));
}
/** Accepts or rejects what was learned. */
function answerLesson(order, words) {
  request(async () => {
    await link.post("/api/order", JSON.stringify({ order }));
    setPlaced(null);
    return words;
  });
}
at("accept").addEventListener("click", () => answerLesson("accept", "The robot drives by what it has learned. Send the path again."));
at("reject").addEventListener("click", () => answerLesson("reject", "What the robot has learned is forgotten."));
// What the robot saw is placed under the drawing for tracing; the drawing is then sent like any other.
at("correct").addEventListener("click", () => request(async () => {
  const picture = await dataUrl(await link.fetch(lessons.path));
  desk.change({ ...desk.drawing, underlay: picture });
  desk.take("select");
  return "What the robot saw lies under the drawing. Correct the walls, then send the map.";
}));
/** Tells the robot where it is. */
function answer(place, heading_deg) {
  request(async () => {
    await link.post("/api/here", JSON.stringify(heading_deg === null ? { at: place } : { at: place, heading_deg }));
    return "The place has been sent to the robot.";
  });
}
onQuestion((place) => answer(place.at, null));
at("send-sketch").addEventListener("click", () => request(sendSketch));
at("send-path").addEventListener("click", () => request(sendPath));
/** Asks for what a person wants with the wheel. */
const wish = (what, words) => request(async () => {
  await link.post("/api/wheel", JSON.stringify(what));
  return words;
});
at("wheel").addEventListener("click", () => wish("take", "You drive."));
bindWheel(wish, people);

/** Does not wait for other requests: stopping must be immediate. */
function abort() {
  if (at("abort").disabled) return false;
  link.abort().catch((error) => say(error.message, true));
  say("Stop has been sent.");
  return true;
}
// A touch stops the robot on contact, not on release; a click without a pointer comes from the keyboard.
at("abort").addEventListener("pointerdown", abort);
at("abort").addEventListener("click", (event) => event.detail === 0 && abort());

// ---------------------------------------------------------------------------- tools, files, settings

for (const button of document.querySelectorAll("#tools [data-tool]")) {
  button.addEventListener("click", () => desk.take(button.dataset.tool));
}
const does = {
  // A watching page has no tools.
  tool: (name) => robot.hello?.mode === "watches" || desk.take(name),
  undo: () => study.step("undo", () => desk.undo()), redo: () => study.step("redo", () => desk.redo()),
  zoom: (factor) => desk.zoom(factor), fit: () => desk.fit(), help: showKeys, letGo: () => desk.escape(),
  selecting: () => desk.selecting, abort, library: showLibrary,
  save: () => save(`${keeper.nameOf(desk.drawing)}.json`, toText(desk.drawing)),
};
shortcuts(does);

async function showLibrary() {
  if (!keeps()) return;
  await keeper.keep();
  await library.show();
}

function showKeys() {
  at("menu").togglePopover(true);
  at("keys").open = true;
  at("keys").scrollIntoView();
}

at("undo").addEventListener("click", does.undo);
at("redo").addEventListener("click", does.redo);
at("zoom-in").addEventListener("click", () => does.zoom(1.25));
at("zoom-out").addEventListener("click", () => does.zoom(0.8));
at("fit").addEventListener("click", does.fit);

/** Opens a file as a new drawing; a picture is placed under the current one. */
async function takeIn(file) {
  const { drawing, picture, words } = await readFile(file);
  const lies = picture !== null && !isBlank(desk.drawing);
  desk.change(lies ? { ...desk.drawing, underlay: picture } : keeper.imported(drawing, nameOf(file)));
  say(lies ? `“${file.name}” lies under the sheet, to be traced.` : `“${file.name}” is open.${words}`);
}

/** Opens the text of a drawing: as a new one, or in the middle of the current one. */
function takeWords(text) {
  const { drawing, left, own } = fromWords(text);
  if (isBlank(desk.drawing)) desk.change(keeper.imported(drawing, null));
  else {
    desk.take("select");
    desk.selecting.takeIn(drawing, onSheet(desk.sheet.view, desk.sheet.area.map((side) => side / 2)), own ? 1 : PASTED);
  }
  say(`A drawing was pasted.${leftOut(left)}`);
}

/** Runs `work` and reports an error to the user. */
async function tried(work) {
  try {
    await work();
  } catch (error) {
    say(error.message, true);
  }
}

bindExchange({
  desk, takes: keeps, select: () => does.tool("select"),
  files: (files) => tried(async () => {
    for (const file of files) await takeIn(file);
  }),
  words: (text) => tried(() => takeWords(text)),
});

/** A menu button: does its work, closes the menu, and reports an error. */
function item(id, work) {
  at(id).addEventListener("click", () => {
    at("menu").hidePopover();
    tried(work);
  });
}

item("library-open", does.library);
item("new-landscape", () => desk.change(begun(blank(LANDSCAPE))));
item("new-portrait", () => desk.change(begun(blank(PORTRAIT))));
item("save", does.save);
item("save-png", async () => save(`${keeper.nameOf(desk.drawing)}.png`, await png(desk.drawing), "image/png"));
item("save-svg", () => save(`${keeper.nameOf(desk.drawing)}.svg`, toSvg(desk.drawing, { own: true }), "image/svg+xml"));
item("open", async () => {
  const file = await choose(ACCEPTED);
  if (file) await takeIn(file);
});
item("photo", async () => {
  const file = await choose("image/*");
  if (!file) return;
  const { size, url } = await photo(file);
  desk.change(keeper.imported({ ...blank(size), photo: url }, nameOf(file)));
});
item("underlay", async () => {
  const file = await choose("image/*");
  if (file) desk.change({ ...desk.drawing, underlay: (await photo(file)).url });
});
item("remove-underlay", () => desk.change({ ...desk.drawing, photo: null, underlay: null }));
item("clear-path", () => desk.change({ ...desk.drawing, route: null, goals: [], start: null }));

at("mission-form").addEventListener("submit", (event) => {
  event.preventDefault();
  const name = at("mission-name").value;
  at("menu").hidePopover();
  request(async () => {
    const answer = await link.post("/api/mission", JSON.stringify({ name }));
    // The server stores it in its folder; a photo has no text to include.
    for (const file of answer.files.filter((f) => f.text !== null)) save(file.name, file.text, "text/plain");
    return `The mission is saved: ${answer.files.map((file) => file.name).join(", ")}.`;
  });
});
at("limit").addEventListener("change", () => request(async () => {
  const link_limit_s = at("limit").valueAsNumber;
  await link.post("/api/limit", JSON.stringify({ link_limit_s }));
  return `The robot pauses after ${link_limit_s} s without this page.`;
}));

function set(change) {
  Object.assign(settings, change);
  keep(settings);
}

at("width").value = settings.width_px;
at("width-shown").textContent = settings.width_px;
at("width").addEventListener("input", () => {
  set({ width_px: at("width").valueAsNumber });
  at("width-shown").textContent = settings.width_px;
});
for (const key of ["hold", "snap", "fingers"]) {
  at(key).checked = settings[key];
  at(key).addEventListener("change", () => set({ [key]: at(key).checked }));
}

function showChecks() {
  for (const box of document.querySelectorAll("[data-show]")) box.checked = settings.shows[box.dataset.show];
}
for (const box of document.querySelectorAll("[data-show]")) {
  box.addEventListener("change", () => {
    set({ shows: { ...settings.shows, [box.dataset.show]: box.checked } });
    desk.redrawFeed();
  });
}
showChecks();
// Only large screens have space for the legend on the sheet.
at("shows").open = matchMedia("(min-width: 900px) and (min-height: 600px)").matches;

const ms = (value) => `${value.toFixed(2)} ms`;
at("menu").addEventListener("beforetoggle", (event) => {
  if (event.newState !== "open") return;
  const { work, sheet } = desk;
  showFigures({
    "Pen to ink, last": ms(work.inkMs), "Pen to ink, worst": ms(work.inkWorstMs),
    "Pen movements": String(work.events), "Points in them": String(work.points),
    "Segments drawn": String(sheet.work.liveSegments), "Whole redraws": String(sheet.work.redraws),
    "Feeds drawn": String(work.feeds), "Feed, last": ms(work.feedMs), "Feed, worst": ms(work.feedWorstMs),
    "Link": link.latencyMs === null ? "–" : ms(link.latencyMs),
    "Strokes": String(desk.drawing.strokes.length),
  });
});
desk.take("pen");
// Only in a secure context, which localhost is.
navigator.serviceWorker?.register("sw.js").catch((error) => console.warn(`The page cannot be kept for use without a server: ${error.message}`));
