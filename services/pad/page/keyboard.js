// The keyboard: a key for each tool, and a crosshair that draws, so that a hand that holds no pen can do
// what a pen can.

import { onScreen, onSheet } from "./view.js";

const TOOL_KEYS = { p: "pen", l: "line", b: "box", y: "polygon", e: "eraser", r: "path", g: "goal", s: "start", m: "hand" };
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
/** Steps of the crosshair, screen pixels; with Shift the fine one. */
const [STEP_PX, FINE_PX] = [16, 2];

/** Whether keys belong to somebody who writes. */
const writes = (element) => element.matches("input, textarea, select");

/**
 * Binds the shortcuts. `does` has `tool(name)`, `undo()`, `redo()`, `zoom(factor)`, `fit()`, `abort()`
 * (answers whether there was something to stop), `letGo()`, `close()`.
 */
export function shortcuts(does) {
  document.addEventListener("keydown", (event) => {
    // Stopping the robot comes before whatever else Escape may mean.
    if (event.key === "Escape" && does.abort()) return;
    if (writes(event.target)) return;
    const key = event.key.toLowerCase();
    if (event.ctrlKey || event.metaKey) {
      if (key === "z") act(event, event.shiftKey ? does.redo : does.undo);
      else if (key === "y") act(event, does.redo);
    } else if (event.altKey) return;
    else if (TOOL_KEYS[key]) act(event, () => does.tool(TOOL_KEYS[key]));
    else if (key === "+" || key === "=") act(event, () => does.zoom(1.25));
    else if (key === "-") act(event, () => does.zoom(0.8));
    else if (key === "0") act(event, does.fit);
    else if (key === "escape") does.letGo();
  });
}

function act(event, action) {
  event.preventDefault();
  action();
}

/** The crosshair on the sheet's element. The listener is that of the pointers. */
export class Crosshair {
  #at = null;
  #down = false;

  constructor(element, mark, sheet, listener, close) {
    Object.assign(this, { element, mark, sheet, listener });
    element.addEventListener("keydown", (event) => {
      if (ARROWS[event.key]) act(event, () => this.#step(ARROWS[event.key], event.shiftKey ? FINE_PX : STEP_PX));
      else if (event.key === " ") act(event, () => this.#toggle());
      else if (event.key === "Enter") act(event, close);
    });
    element.addEventListener("pointerdown", () => this.hide());
    element.addEventListener("blur", () => this.hide());
  }

  /** Away, and what it was drawing is dropped. */
  hide() {
    if (this.#down) this.listener.cancel();
    this.#down = false;
    this.mark.hidden = true;
  }

  /** Where it is on the screen after the view has changed. */
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
