// The desk: the drawing with its history, the current tool, and the sheet that shows both. It decides what is redrawn after a
// change: a finished stroke is added to the ink, anything else redraws.

import { Sheet } from "./canvas.js";
import { drawFeed, trailed } from "./feed.js";
import { changed, extended, history, redone, undone } from "./history.js";
import { drawOverlay } from "./overlay.js";
import { replayed } from "./shared.js";
import { makeTools } from "./tools.js";
import { fitted, held, onSheet, panned, zoomed } from "./view.js";

/** Whether `after` is `before` with one stroke added. */
export function oneMore(before, after) {
  return after.strokes.length === before.strokes.length + 1
    && before.strokes.every((stroke, i) => stroke === after.strokes[i])
    && before.canvas === after.canvas && before.photo === after.photo && before.underlay === after.underlay;
}

/** Whether the ink layer is the same for both. */
/** States in which the robot has a task, so that what it has seen stays on the sheet even if it is not placed. */
const DRIVEN = new Set(["driving", "paused", "aborted", "ended"]);

const sameInk = (a, b) => a.strokes === b.strokes && a.canvas === b.canvas && a.photo === b.photo && a.underlay === b.underlay;

export class Desk {
  #history;
  #shown;
  #tools;
  #tool = "pen";
  #under = null;
  /** During a gesture, the drawing in which it began, and what the tool would make of it: others may change the drawing meanwhile. */
  #base = null;
  #preview = null;
  #draft = null;
  #guides = [];
  #overlaid = false;
  #tag = null;
  #doubts = [];
  #stale = {};
  #frame = 0;
  #host;
  #fits = true;
  /** What the robot sends: the last feed, its trail, its last particles, its map, what it has learned. */
  feed = null;
  trail = [];
  cloud = null;
  lasting = null;
  walls = null;
  learned = null;
  work = { inkMs: 0, inkWorstMs: 0, feedMs: 0, feedWorstMs: 0, feeds: 0, events: 0, points: 0 };

  /**
   * The host has `settings()`, `say(words)`, `label(key)`, `write(at)`, `changed()`, `selected()`, `viewed()`, `drawn(feed)`, `asked()`
   * (whether a tap tells the robot where it is), `answer(at, heading_deg)`.
   */
  constructor(element, drawing, host) {
    this.element = element;
    this.#host = host;
    this.sheet = new Sheet(element);
    this.#history = history(drawing);
    this.#shown = drawing;
    this.#tools = makeTools({
      sheet: this.sheet,
      drawing: () => this.#base ?? this.#history.now,
      shown: () => this.#preview ?? this.#base ?? this.#history.now,
      change: (next, tag) => this.#made(next, tag),
      preview: (next) => this.#previewed(next),
      draft: (shape) => this.#drafted(shape),
      guides: (guides) => this.#guided(guides),
      over: () => this.#redraw("over"),
      selected: host.selected,
      settings: host.settings,
      say: host.say,
      label: host.label,
      write: host.write,
      answer: host.answer,
    });
    new ResizeObserver(() => this.#resized()).observe(element);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.#recolored());
    this.#recolored();
    this.#resized();
    this.#load(drawing);
  }

  get drawing() {
    return this.#history.now;
  }

  get canUndo() {
    return this.#history.past.length > 0;
  }

  get canRedo() {
    return this.#history.future.length > 0;
  }

  get tool() {
    return this.#tool;
  }

  /** Selects another tool; anything the last one has begun is dropped. */
  take(name) {
    this.letGo();
    if (name !== this.#tool) this.#tools[this.#tool]?.leave?.();
    this.#tool = name;
    this.element.dataset.tool = name;
    this.element.dataset.over = "";
    this.#redraw("over");
    this.#host.changed();
  }

  /** Drops what is in progress. */
  letGo() {
    const tool = this.#under ?? this.#tools[this.#tool];
    tool?.cancel();
    this.#ended();
  }

  /** The selection, while the select tool is active; `null` otherwise. */
  get selecting() {
    return this.#tool === "select" ? this.#tools.select.selection : null;
  }

  /** Drops what is in progress, or else the selection. */
  escape() {
    const tool = this.#tools[this.#tool];
    if (tool?.escape && !this.#under) tool.escape();
    else this.letGo();
  }

  /** Closes a shape that waits for its last corner. */
  close() {
    this.#tools[this.#tool]?.close?.();
  }

  /** What a gesture makes of the drawing in which it began, with what others have changed meanwhile. */
  #rebased(next) {
    return this.#base ? replayed(this.#history.now, this.#base, next) : next;
  }

  #previewed(next) {
    if (this.#base) this.#preview = next;
    this.#show(this.#rebased(next));
  }

  #made(next, tag) {
    this.change(this.#rebased(next), tag);
    if (this.#base) [this.#base, this.#preview] = [this.#history.now, null];
  }

  /** Takes over what others have changed, which is no step of the history. */
  merge(next) {
    const before = this.#history.now;
    this.#history = { ...this.#history, now: next };
    this.#tag = null;
    if (!this.#base) this.#tools.select.selection.keep(before, next);
    this.#show(this.#rebased(this.#preview ?? this.#base ?? next));
    this.#host.changed();
  }

  /** Replaces the drawing in one step, merged with the previous step if both have the same `tag`. */
  change(next, tag = null) {
    const before = this.#history;
    this.#history = tag !== null && tag === this.#tag ? extended(before, next) : changed(before, next);
    this.#tag = tag;
    this.#tools.select.selection.follow(before.now, next);
    this.#show(next);
    this.#host.changed();
  }

  /** Replaces the drawing and its history. */
  renew(drawing) {
    this.#leap(history(drawing));
  }

  undo() {
    this.#leap(undone(this.#history));
  }

  redo() {
    this.#leap(redone(this.#history));
  }

  #leap(next) {
    this.letGo();
    this.#tag = null;
    this.#tools.select.selection.follow(this.#history.now, next.now);
    this.#history = next;
    this.#show(next.now);
    this.#host.changed();
  }

  #show(next) {
    const before = this.#shown;
    this.#shown = next;
    if (next.canvas !== before.canvas) this.fit();
    if (next.photo !== before.photo || next.underlay !== before.underlay) this.#load(next);
    if (Boolean(next.photo || next.underlay) !== Boolean(before.photo || before.underlay)) this.#recolored();
    if (oneMore(before, next) && !this.#stale.ink) this.sheet.addStroke(next.strokes.at(-1));
    else if (!sameInk(before, next)) this.#redraw("ink");
    this.#redraw("marks", "over");
  }

  #load(drawing) {
    this.sheet.load(drawing).then(
      (fresh) => fresh && this.#redraw("ink"),
      () => this.#host.say("The picture in this drawing cannot be read.", true),
    );
  }

  #drafted(shape) {
    this.#draft = shape;
    this.#redraw("marks");
  }

  #guided(guides) {
    this.#guides = guides;
    this.#redraw("over");
  }

  /** Whether a gesture is in progress. */
  get isBusy() {
    return this.#under !== null;
  }

  /** What looks wrong with the drawing: a list of `{ at, word }`. */
  doubt(doubts) {
    this.#doubts = doubts;
    this.#redraw("marks");
  }

  /** Handles a message from the robot. */
  told(feed) {
    this.feed = feed;
    this.trail = trailed(this.trail, feed.trail);
    if (feed.particles && feed.pose) this.cloud = { points: feed.particles, pose: feed.pose };
    else if (!feed.pose) this.cloud = null;
    if (feed.lasting) this.lasting = feed.lasting;
    else if (!feed.pose && !DRIVEN.has(feed.state)) this.lasting = null;
    this.#redraw("feed");
  }

  /** Redraws a layer with the next frame. */
  #redraw(...layers) {
    layers.forEach((layer) => { this.#stale[layer] = true; });
    this.#frame ||= requestAnimationFrame(() => this.#draw());
  }

  redrawFeed() {
    this.#redraw("feed");
  }

  #draw() {
    this.#frame = 0;
    const stale = this.#stale;
    this.#stale = {};
    if (stale.ink) this.sheet.drawInk(this.#shown);
    if (stale.marks) this.sheet.drawMarks(this.#shown, this.#draft, this.#doubts);
    if (stale.feed) this.#drawFeed();
    if (stale.over) this.#drawOver();
  }

  /** The selection, or what the tool has snapped to. A stroke under the pen has the layer to itself. */
  #drawOver() {
    const overlay = this.#tools[this.#tool]?.overlay?.() ?? (this.#guides.length ? { guides: this.#guides } : null);
    if (overlay) drawOverlay(this.sheet, overlay);
    else if (this.#overlaid && !this.#under) this.sheet.wipe("live");
    this.#overlaid = overlay !== null;
  }

  #drawFeed() {
    const before = performance.now();
    drawFeed(this.sheet, this, this.#host.settings().shows, this.#shown.canvas);
    this.work.feedMs = performance.now() - before;
    this.work.feedWorstMs = Math.max(this.work.feedWorstMs, this.work.feedMs);
    this.work.feeds += 1;
    if (this.feed) this.#host.drawn(this.feed);
  }

  #viewed(view) {
    this.sheet.view = held(view, this.#shown.canvas, this.sheet.area);
    this.#redraw("ink", "marks", "feed", "over");
    this.#host.viewed();
  }

  /** Shows the whole sheet. */
  fit() {
    this.#fits = true;
    this.#viewed(fitted(this.#shown.canvas, this.sheet.area));
  }

  zoom(factor, at = this.sheet.area.map((side) => side / 2)) {
    this.#fits = false;
    this.#viewed(zoomed(this.sheet.view, at, factor));
  }

  pan(dx, dy) {
    this.#fits = false;
    this.#viewed(panned(this.sheet.view, dx, dy));
  }

  #resized() {
    // Not during a stroke, which would jump.
    if (this.#under || !this.sheet.measure()) return;
    if (this.#fits) this.fit();
    else this.#viewed(this.sheet.view);
  }

  #recolored() {
    if (this.sheet.recolor(this.#shown)) this.#redraw("ink", "marks", "feed", "over");
  }

  // ------------------------------------------------------------------ pointers and keys

  begin(sample) {
    this.#base = this.#history.now;
    if (this.#host.asked()) this.#under = this.#tools.here;
    else this.#under = sample.eraser ? this.#tools.eraser : this.#tools[this.#tool];
    this.#under?.begin(this.#placed(sample));
    this.#inked(sample);
  }

  extend(samples) {
    this.work.events += 1;
    this.work.points += samples.length;
    this.#under?.extend(samples.map((sample) => this.#placed(sample)));
    this.#inked(samples.at(-1));
  }

  end() {
    const seen = this.#preview ?? this.#base;
    this.#under?.end();
    this.#ended(seen);
    this.#resized();
  }

  cancel() {
    this.#under?.cancel();
    this.#ended();
    this.#resized();
  }

  /** The gesture is over. The selection refers to `seen`, which lacks what others have changed meanwhile. */
  #ended(seen = this.#base) {
    const { now } = this.#history;
    const isOld = this.#base && seen !== now;
    [this.#under, this.#base, this.#preview] = [null, null, null];
    if (!isOld) return;
    this.#tools.select.selection.keep(seen, now);
    this.#show(now);
  }

  /** A mouse or pen over the sheet without a pressed button. */
  hover(sample) {
    const tool = this.#tools[this.#tool];
    tool?.hover?.(this.#placed(sample));
    const over = tool?.over?.(this.#placed(sample)) ?? "";
    if (this.element.dataset.over !== over) this.element.dataset.over = over;
  }

  #placed(sample) {
    return { ...sample, at: onSheet(this.sheet.view, sample.at) };
  }

  /** Measures the time from the pen's event to its ink on the canvas. */
  #inked({ time }) {
    this.work.inkMs = performance.now() - time;
    this.work.inkWorstMs = Math.max(this.work.inkWorstMs, this.work.inkMs);
  }
}
