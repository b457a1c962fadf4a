// The keyboard: a key for each tool, and a crosshair that draws, so that everything a pen can do also works without one.

import { onScreen, onSheet } from "./view.js";

const TOOL_KEYS = {
  v: "select", 1: "select", p: "pen", l: "line", a: "arc", d: "door", b: "box", o: "ellipse", y: "polygon", e: "eraser", t: "text",
  r: "path", g: "goal", s: "start", m: "hand",
};
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
/** Actions on the selection by key: methods of Selection. With Ctrl or the command key, with Alt, and without. */
const WITH_CTRL = { a: ["selectAll"], d: ["duplicate"] };
const WITH_CTRL_SHIFT = {
  ArrowLeft: ["align", "left"], ArrowRight: ["align", "right"], ArrowUp: ["align", "top"], ArrowDown: ["align", "bottom"],
};
const WITH_ALT = { KeyH: ["distribute", 0], KeyV: ["distribute", 1] };
const PLAIN = {
  Delete: ["remove"], Backspace: ["remove"], Insert: ["insert"], i: ["insert"], n: ["step", 1], N: ["step", -1], f2: ["label"],
};
/** Degrees of a rotation by key, and with Shift; screen pixels of a move or resize, and with Shift. */
const [TURN_DEG, FINE_DEG] = [15, 1];
const [NUDGE_PX, FAR_PX] = [1, 5];
/** Steps of the crosshair, screen pixels; the fine one with Shift. */
const [STEP_PX, FINE_PX] = [16, 2];

/** Whether keys are meant for a text field. */
export const writes = (element) => element.matches("input, textarea, select");

/**
 * Binds the shortcuts. `does` has `tool(name)`, `undo()`, `redo()`, `zoom(factor)`, `fit()`, `help()`, `library()`, `save()`,
 * `abort()` (returns whether there was something to stop), `letGo()`, `selecting()` (the selection, while the select tool is
 * active).
 */
export function shortcuts(does) {
  document.addEventListener("keydown", (event) => {
    // Stopping the robot takes precedence over every other meaning of Escape.
    if (event.key === "Escape" && does.abort()) return;
    if (writes(event.target)) return;
    const key = event.key.toLowerCase();
    if (selects(event, key, does)) return;
    if (event.ctrlKey || event.metaKey) {
      if (key === "z") act(event, event.shiftKey ? does.redo : does.undo);
      else if (key === "y") act(event, does.redo);
      else if (key === "o") act(event, does.library);
      else if (key === "s") act(event, does.save);
    } else if (event.altKey) return;
    else if (TOOL_KEYS[key]) act(event, () => does.tool(TOOL_KEYS[key]));
    else if (key === "+" || key === "=") act(event, () => does.zoom(1.25));
    else if (key === "-") act(event, () => does.zoom(0.8));
    else if (key === "0") act(event, does.fit);
    else if (key === "?") act(event, does.help);
    else if (key === "escape") does.letGo();
  });
}

/** Handles a key of the selection; returns whether it was one. */
function selects(event, key, does) {
  const ctrl = event.ctrlKey || event.metaKey;
  // "Select all" switches to the select tool.
  if (ctrl && !event.shiftKey && !does.selecting() && key === "a") does.tool("select");
  const selection = does.selecting();
  if (!selection) return false;
  const called = meant(event, key, ctrl);
  if (called) act(event, () => selection[called[0]](...called.slice(1)));
  else if (!ctrl && (event.code === "Comma" || event.code === "Period")) {
    act(event, () => selection.turn((event.shiftKey ? FINE_DEG : TURN_DEG) * (event.code === "Comma" ? -1 : 1)));
  } else return false;
  return true;
}

function meant(event, key, ctrl) {
  if (ctrl && key === "g") return [event.shiftKey ? "ungroup" : "group"];
  if (ctrl) return event.shiftKey ? WITH_CTRL_SHIFT[event.key] : WITH_CTRL[key];
  if (event.altKey) return WITH_ALT[event.code];
  return PLAIN[event.key] ?? PLAIN[key];
}

function act(event, action) {
  event.preventDefault();
  action();
}

/** The crosshair on the sheet's element, which feeds the listener of the pointers. */
export class Crosshair {
  #at = null;
  #down = false;

  /** `selecting()`: the selection, while the select tool is active: arrow keys move it, or the crosshair if there is none. */
  constructor(element, mark, sheet, listener, close, selecting) {
    Object.assign(this, { element, mark, sheet, listener });
    element.addEventListener("keydown", (event) => {
      const arrow = event.ctrlKey || event.metaKey ? null : ARROWS[event.key];
      const far = event.shiftKey ? FAR_PX : NUDGE_PX;
      if (arrow && !this.#down && selecting()?.[event.altKey ? "stretch" : "nudge"](arrow, far)) event.preventDefault();
      else if (arrow) act(event, () => this.#step(arrow, event.shiftKey ? FINE_PX : STEP_PX));
      else if (event.key === " ") act(event, () => this.#toggle());
      else if (event.key === "Enter") act(event, close);
    });
    element.addEventListener("pointerdown", () => this.hide());
    element.addEventListener("blur", () => this.hide());
  }

  /** Hides it and drops what it was drawing. */
  hide() {
    if (this.#down) this.listener.cancel();
    this.#down = false;
    this.mark.hidden = true;
  }

  /** Updates its place on the screen after the view has changed. */
  place() {
    if (!this.#at) return;
    const [x, y] = onScreen(this.sheet.view, this.#at);
    this.mark.style.transform = `translate(${x}px, ${y}px)`;
    this.mark.dataset.down = String(this.#down);
  }

  #sample() {
    const at = onScreen(this.sheet.view, this.#at);
    return { at, pressure: null, shift: false, time: performance.now() };
  }

  #step([dx, dy], far) {
    const middle = onSheet(this.sheet.view, this.sheet.area.map((side) => side / 2));
    const step = this.sheet.px(far);
    this.#at = this.#at ? [this.#at[0] + dx * step, this.#at[1] + dy * step] : middle;
    this.mark.hidden = false;
    if (this.#down) this.listener.extend([this.#sample()]);
    this.place();
  }

  #toggle() {
    if (!this.#at) this.#step([0, 0], 0);
    this.mark.hidden = false;
    if (this.#down) this.listener.end();
    else this.listener.begin(this.#sample());
    this.#down = !this.#down;
    this.place();
  }
}
