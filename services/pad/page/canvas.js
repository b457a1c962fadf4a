// The sheet on the screen: four stacked canvases, each redrawn for its own reason.
//
// - `ink`: paper, pictures, strokes. A finished stroke is added; only a changed view, an undo or the eraser redraws it.
// - `marks`: obstacles, texts, route, goals, start.
// - `feed`: the robot's data; drawn once per message (feed.js).
// - `live`: the stroke under the pen. A movement draws only its new segments, in the event handler itself, on a canvas that need
//   not wait for the others (`desynchronized`). While nothing is drawn by hand, it shows the selection (overlay.js).

import { middle, roomAt } from "./geometry.js";
import { inkRuns, widthAt } from "./ink.js";
import { MARK_PX, tipOf } from "./items.js";

/** Higher pixel ratios cost more than they improve the picture. */
const MAX_RATIO = 2;

/** The mark of a doubt: radius of its ring, height of its text, padding; screen pixels. */
const DOUBT_PX = { ring: 20, text: 13, pad: 4 };

/** Colours by name, as the style sheet defines them for the sheet's element. */
export function palette(element) {
  const style = getComputedStyle(element);
  const names = ["paper", "ink", "edge", "obstacle", "obstacle-text", "place", "route", "goal", "goal-text", "start", "robot", "particle", "scan", "plan", "seen", "hidden", "trail", "rubber", "walls", "learned", "select", "guide", "doubt", "doubt-text"];
  return Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

export class Sheet {
  #layers = {};
  #element;
  #pictures = new Map();
  #live = null;
  view = { scale: 1, x: 0, y: 0 };
  area = [1, 1];
  ratio = 1;
  colors = {};
  /** Work done since the page was loaded, for the figures on the page. */
  work = { redraws: 0, strokesAdded: 0, liveSegments: 0, liveMoves: 0 };

  constructor(element) {
    this.#element = element;
    this.colors = palette(element);
    for (const name of ["ink", "marks", "feed", "live"]) {
      const canvas = element.querySelector(`canvas.${name}`);
      this.#layers[name] = canvas.getContext("2d", { desynchronized: name === "live" });
    }
  }

  /** Reads the theme's colours, or those of white paper if there is a picture. Returns whether they have changed. */
  recolor({ photo, underlay }) {
    this.#element.classList.toggle("lit", Boolean(photo || underlay));
    const before = this.colors;
    this.colors = palette(this.#element);
    return before.paper !== this.colors.paper;
  }

  /** The canvas of a layer. */
  layer(name) {
    return this.#layers[name];
  }

  /** Reads the element's size; returns whether it has changed. */
  measure() {
    const area = [this.#element.clientWidth, this.#element.clientHeight];
    const ratio = Math.min(MAX_RATIO, window.devicePixelRatio || 1);
    if (area[0] === this.area[0] && area[1] === this.area[1] && ratio === this.ratio) return false;
    [this.area, this.ratio] = [area, ratio];
    for (const { canvas } of Object.values(this.#layers)) {
      [canvas.width, canvas.height] = area.map((side) => Math.max(1, Math.round(side * ratio)));
    }
    return true;
  }

  /** Clears a layer and sets it to sheet coordinates. */
  wipe(name) {
    const context = this.#layers[name];
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, context.canvas.width, context.canvas.height);
    this.onSheet(context);
    return context;
  }

  /** Sets a context to sheet coordinates. */
  onSheet(context) {
    const { scale, x, y } = this.view;
    context.setTransform(scale * this.ratio, 0, 0, scale * this.ratio, x * this.ratio, y * this.ratio);
  }

  /** Redraws paper, pictures and strokes. */
  drawInk(drawing) {
    this.work.redraws += 1;
    const context = this.wipe("ink");
    const [w, h] = drawing.canvas;
    context.fillStyle = this.colors.paper;
    context.fillRect(0, 0, w, h);
    this.#drawPicture(context, drawing.underlay, drawing.canvas, 0.45);
    this.#drawPicture(context, drawing.photo, drawing.canvas, 1);
    context.strokeStyle = this.colors.edge;
    context.lineWidth = 1 / this.view.scale;
    // Nothing of the previous drawing may remain: the same drawing must give the same pixels.
    context.lineJoin = "miter";
    context.strokeRect(0, 0, w, h);
    drawing.strokes.forEach((stroke) => this.#drawStroke(context, stroke));
  }

  /** Adds a finished stroke to the ink. */
  addStroke(stroke) {
    this.work.strokesAdded += 1;
    this.#drawStroke(this.#layers.ink, stroke);
  }

  #drawStroke(context, stroke) {
    context.lineCap = "round";
    context.lineJoin = "round";
    context.strokeStyle = this.colors.ink;
    for (const { width, path } of inkRuns(stroke)) {
      context.lineWidth = width;
      context.stroke(path);
    }
  }

  #drawPicture(context, url, [w, h], alpha) {
    const picture = url && this.#pictures.get(url);
    if (!picture) return;
    context.globalAlpha = alpha;
    const scale = Math.min(w / picture.width, h / picture.height);
    const size = [picture.width * scale, picture.height * scale];
    context.drawImage(picture, (w - size[0]) / 2, (h - size[1]) / 2, ...size);
    context.globalAlpha = 1;
  }

  /** Loads the pictures of a drawing; returns whether there were new ones. */
  async load({ photo, underlay }) {
    const fresh = [photo, underlay].filter((url) => url && !this.#pictures.has(url));
    for (const url of fresh) {
      const image = new Image();
      image.src = url;
      await image.decode();
      this.#pictures.set(url, image);
    }
    return fresh.length > 0;
  }

  /** Redraws obstacles and marks. `draft` is the shape being drawn, `doubts` are what looks wrong. */
  drawMarks({ obstacles, labels, route, goals, start }, draft = null, doubts = []) {
    const context = this.wipe("marks");
    obstacles.forEach((obstacle) => this.#drawObstacle(context, obstacle));
    labels.forEach(({ text, at }) => this.#write(context, text, at, this.colors.place, MARK_PX.text));
    if (route) this.#drawRoute(context, route);
    goals.forEach((goal, i) => this.#drawGoal(context, goal.at, i));
    if (start) this.#drawStart(context, start);
    doubts.forEach((doubt) => this.#drawDoubt(context, doubt));
    if (draft) this.#drawDraft(context, draft);
  }

  /** Converts screen pixels to sheet pixels. */
  px(n) {
    return n / this.view.scale;
  }

  #trace(context, points) {
    context.beginPath();
    points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
  }

  #drawObstacle(context, { polygon, label }) {
    this.#trace(context, polygon);
    context.closePath();
    context.fillStyle = this.colors.obstacle;
    context.fill();
    if (label) this.#drawLabel(context, label, polygon);
  }

  /** A label no wider than its obstacle: smaller or cut off, and omitted if it would be unreadable. */
  #drawLabel(context, label, polygon) {
    const room = roomAt(middle(polygon), polygon, this.px(9)) * this.view.scale * 0.94;
    context.font = "600 12px system-ui, sans-serif";
    const width = (text) => context.measureText(text).width / 12;
    let text = label;
    while (text.length > 3 && width(text) * 7 > room) text = `${text.slice(0, -2).trimEnd()}…`;
    const size = Math.min(12, room / width(text));
    if (size >= 7) this.#write(context, text, middle(polygon), this.colors["obstacle-text"], size);
  }

  #write(context, text, [x, y], color, size) {
    context.font = `600 ${this.px(size)}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillStyle = color;
    context.fillText(text, x, y);
  }

  #drawRoute(context, route) {
    context.lineCap = context.lineJoin = "round";
    context.strokeStyle = context.fillStyle = this.colors.route;
    context.lineWidth = this.px(MARK_PX.route);
    this.#trace(context, route);
    context.stroke();
    const last = route.at(-1);
    const before = route.findLast((p) => Math.hypot(p[0] - last[0], p[1] - last[1]) > this.px(10)) ?? route[0];
    context.fillStyle = this.colors.goal;
    this.#arrowHead(context, last, Math.atan2(last[1] - before[1], last[0] - before[0]), 15);
    this.#disc(context, route[0], 6);
  }

  #arrowHead(context, at, angle, size) {
    const s = this.px(size);
    const corner = (turn, far) => [at[0] + far * Math.cos(angle + turn), at[1] + far * Math.sin(angle + turn)];
    this.#trace(context, [corner(0, s * 0.5), corner(2.6, s), corner(-2.6, s)]);
    context.fill();
  }

  #disc(context, [x, y], radius) {
    context.beginPath();
    context.arc(x, y, this.px(radius), 0, 2 * Math.PI);
    context.fill();
  }

  #drawGoal(context, at, index) {
    context.fillStyle = this.colors.goal;
    this.#disc(context, at, MARK_PX.goal);
    this.#write(context, String(index + 1), at, this.colors["goal-text"], 13);
  }

  /** A ring with a text below it that stays on the sheet. */
  #drawDoubt(context, { at: [x, y], word }) {
    const [radius, high, pad] = [DOUBT_PX.ring, DOUBT_PX.text, DOUBT_PX.pad].map((n) => this.px(n));
    context.strokeStyle = context.fillStyle = this.colors.doubt;
    context.lineWidth = this.px(3);
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.stroke();
    context.font = `600 ${high}px system-ui, sans-serif`;
    const half = context.measureText(word).width / 2 + pad;
    context.beginPath();
    context.roundRect(x - half, y + radius + pad, 2 * half, high + 2 * pad, pad);
    context.fill();
    this.#write(context, word, [x, y + radius + 2 * pad + high / 2], this.colors["doubt-text"], DOUBT_PX.text);
  }

  #drawStart(context, start) {
    const { at } = start;
    const tip = tipOf(start, this.px(1));
    context.strokeStyle = context.fillStyle = this.colors.start;
    context.lineWidth = this.px(3.5);
    this.#trace(context, [at, tip]);
    context.stroke();
    this.#arrowHead(context, tip, (-start.heading_deg * Math.PI) / 180, 12);
    context.beginPath();
    context.arc(...at, this.px(MARK_PX.start), 0, 2 * Math.PI);
    context.stroke();
  }

  /** A shape in progress: `{ kind: "polygon" | "line" | "start" | "rubber", … }`. */
  #drawDraft(context, draft) {
    if (draft.kind === "start") {
      this.#drawStart(context, draft.start);
      return;
    }
    if (draft.kind === "rubber") {
      context.strokeStyle = this.colors.rubber;
      context.lineWidth = this.px(1.5);
      context.beginPath();
      context.arc(...draft.at, draft.radius, 0, 2 * Math.PI);
      context.stroke();
      return;
    }
    context.lineCap = context.lineJoin = "round";
    context.strokeStyle = draft.kind === "line" ? this.colors.ink : this.colors.obstacle;
    context.fillStyle = this.colors.obstacle;
    context.lineWidth = draft.width_px ?? this.px(2.5);
    this.#trace(context, draft.points);
    if (draft.closed) context.closePath();
    context.stroke();
    if (draft.corners) draft.points.forEach((corner, i) => this.#disc(context, corner, i === 0 ? 8 : 4));
  }

  /** Begins the line under the pen, with a colour and a width in sheet pixels. */
  liveBegin(at, pressure, width_px, color) {
    const context = this.wipe("live");
    context.lineCap = context.lineJoin = "round";
    context.strokeStyle = context.fillStyle = color;
    this.#live = { last: at, lastPressure: pressure, width_px };
    context.beginPath();
    context.arc(at[0], at[1], widthAt(width_px, pressure) / 2, 0, 2 * Math.PI);
    context.fill();
    this.work.liveSegments += 1;
    this.work.liveMoves += 1;
  }

  /** Continues the line: draws the new points only. */
  liveExtend(points, pressures) {
    const context = this.#layers.live;
    const live = this.#live;
    points.forEach((at, i) => {
      const pressure = pressures[i];
      context.lineWidth = widthAt(live.width_px, pressure === null ? null : (pressure + (live.lastPressure ?? pressure)) / 2);
      context.beginPath();
      context.moveTo(...live.last);
      context.lineTo(...at);
      context.stroke();
      [live.last, live.lastPressure] = [at, pressure];
    });
    this.work.liveSegments += points.length;
    this.work.liveMoves += 1;
  }

  /** Removes the line under the pen. */
  liveEnd() {
    this.#live = null;
    this.wipe("live");
  }
}
