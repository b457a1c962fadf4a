// Turns input of pens, fingers and mice into strokes and movements of the sheet.
//
// `Pointers` is a pure state machine: it takes events and calls its listener. `listen` connects it to an element. The rules:
// - A pen or the mouse's first button draws; the other buttons move the sheet.
// - Until a pen has been used, one finger draws. From then on fingers only move and zoom, since a touch beside a pen is usually the
//   palm. Fingers can still select.
// - A second finger never starts a stroke. If it follows right after the first, both are a pinch, and the stroke of the first is
//   dropped.
// - A stroke that the browser cancels is dropped.

/** How soon a second finger must follow to start a pinch, and how little the first may have drawn. */
const PINCH_MS = 300;
const PINCH_PX = 24;
/** The value of `buttons` for a pen's eraser end. */
const ERASER = 32;

/**
 * What pointers do to the sheet. A pointer is `{ id, type, x, y, pressure, buttons, shift, time }`, in CSS pixels of the sheet's
 * element and milliseconds. The listener has `begin(sample)`, `extend(samples)`, `end()`, `cancel()`, `hover(sample)`, `pan(dx,
 * dy)`, `zoom(at, factor)`; `options()` returns `{ hand, fingers, picks }`: whether the tool moves the sheet, whether fingers may
 * draw, and whether the tool selects, which fingers may always do.
 */
export class Pointers {
  #listener;
  #options;
  #penSeen = false;
  /** Pressed pointers: id → { x, y, type, role }, role "draw", "move" or "rest". */
  #down = new Map();
  #stroke = null;

  constructor(listener, options) {
    this.#listener = listener;
    this.#options = options;
  }

  /** Whether a pen has touched the sheet. */
  get penSeen() {
    return this.#penSeen;
  }

  /** Whether a stroke is in progress. */
  get drawing() {
    return this.#stroke !== null;
  }

  down(p) {
    if (p.type === "pen") this.#penDown();
    const role = this.#role(p);
    this.#down.set(p.id, { x: p.x, y: p.y, type: p.type, role });
    if (role !== "draw") return;
    this.#stroke = { id: p.id, x: p.x, y: p.y, time: p.time, drawn: 0 };
    this.#listener.begin({ ...sample(p), eraser: p.type === "pen" && (p.buttons & ERASER) !== 0 });
  }

  /** `points`: all positions since the last move, including coalesced events. */
  move(p, points = [p]) {
    const known = this.#down.get(p.id);
    if (!known) {
      if (p.type !== "touch" && this.#down.size === 0) this.#listener.hover(sample(p));
      return;
    }
    if (known.role === "draw") {
      this.#stroke.drawn = Math.max(this.#stroke.drawn, Math.hypot(p.x - this.#stroke.x, p.y - this.#stroke.y));
      this.#listener.extend(points.map(sample));
    } else if (known.role === "move") this.#moved(p);
    Object.assign(known, { x: p.x, y: p.y });
  }

  up(p) {
    const known = this.#down.get(p.id);
    this.#down.delete(p.id);
    if (known?.role !== "draw") return;
    this.#stroke = null;
    this.#listener.end();
  }

  cancel(p) {
    const known = this.#down.get(p.id);
    this.#down.delete(p.id);
    if (known?.role === "draw") this.#drop();
  }

  /** The wheel zooms about the pointer. */
  wheel(at, delta) {
    this.#listener.zoom(at, Math.exp(-delta / 400));
  }

  /** Cancels everything: the window has lost the focus, or the page was hidden. */
  cancelAll() {
    if (this.#stroke) this.#drop();
    this.#down.clear();
  }

  #drop() {
    this.#stroke = null;
    this.#listener.cancel();
  }

  /** A pen has touched the sheet: any touches so far were the palm. */
  #penDown() {
    this.#penSeen = true;
    for (const pointer of this.#down.values()) pointer.role = "rest";
    if (this.#stroke) this.#drop();
  }

  #role(p) {
    if (p.type === "touch") return this.#touchRole(p);
    if (this.#stroke) return "rest";
    const first = p.type === "pen" ? (p.buttons & 2) === 0 : p.buttons === 1;
    return first && !this.#options().hand ? "draw" : "move";
  }

  #touchRole(p) {
    const penDown = [...this.#down.values()].some((pointer) => pointer.type === "pen");
    if (penDown || (this.#stroke && !this.#isYoung(p))) return "rest";
    if (this.#stroke) {
      // This is the second finger of a pinch.
      this.#down.get(this.#stroke.id).role = "move";
      this.#drop();
      return "move";
    }
    const alone = this.#down.size === 0;
    const { hand, fingers, picks } = this.#options();
    return alone && !hand && (picks || (fingers && !this.#penSeen)) ? "draw" : "move";
  }

  #isYoung(p) {
    const first = this.#down.get(this.#stroke.id);
    return first.type === "touch" && p.time - this.#stroke.time < PINCH_MS && this.#stroke.drawn < PINCH_PX;
  }

  #moved(p) {
    const before = this.#down.get(p.id);
    const others = [...this.#down.entries()].filter(([id, pointer]) => id !== p.id && pointer.role === "move");
    if (others.length === 0) {
      this.#listener.pan(p.x - before.x, p.y - before.y);
      return;
    }
    // Two fingers: their midpoint moves the sheet, their distance zooms it.
    const other = others[0][1];
    this.#listener.pan((p.x - before.x) / 2, (p.y - before.y) / 2);
    const [was, is] = [before, p].map((q) => Math.hypot(q.x - other.x, q.y - other.y));
    if (was > 8 && is > 8) this.#listener.zoom([(p.x + other.x) / 2, (p.y + other.y) / 2], is / was);
  }
}

/** The pressure is a pen's; a mouse and most fingers report none. */
const sample = ({ x, y, pressure, type, shift, alt, ctrl, time }) => (
  { at: [x, y], pressure: type === "pen" ? pressure : null, touch: type === "touch", shift: Boolean(shift), alt: Boolean(alt), ctrl: Boolean(ctrl), time }
);

/** All events since the last one; in browsers that hide them (no secure context), the event itself. */
function coalesced(event) {
  const events = event.getCoalescedEvents?.() ?? [];
  return events.length ? events : [event];
}

/** Connects pointers to an element, with coordinates relative to it. */
export function listen(element, pointers) {
  let frame = element.getBoundingClientRect();
  new ResizeObserver(() => { frame = element.getBoundingClientRect(); }).observe(element);
  const pointer = (event) => ({
    id: event.pointerId, type: event.pointerType, x: event.clientX - frame.left, y: event.clientY - frame.top,
    pressure: event.pressure, buttons: event.buttons, shift: event.shiftKey, alt: event.altKey, ctrl: event.ctrlKey || event.metaKey,
    time: event.timeStamp,
  });
  element.addEventListener("pointerdown", (event) => {
    frame = element.getBoundingClientRect();
    element.setPointerCapture(event.pointerId);
    pointers.down(pointer(event));
    event.preventDefault();
    element.focus({ preventScroll: true });
  });
  element.addEventListener("pointermove", (event) => pointers.move(pointer(event), coalesced(event).map(pointer)));
  element.addEventListener("pointerup", (event) => {
    // The last position before the pen is lifted counts, too.
    pointers.move(pointer(event), coalesced(event).map((e) => ({ ...pointer(e), pressure: e.pressure || null })));
    pointers.up(pointer(event));
  });
  element.addEventListener("pointercancel", (event) => pointers.cancel(pointer(event)));
  element.addEventListener("lostpointercapture", (event) => pointers.cancel(pointer(event)));
  element.addEventListener("contextmenu", (event) => event.preventDefault());
  element.addEventListener("wheel", (event) => {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : 1;
    pointers.wheel([event.clientX - frame.left, event.clientY - frame.top], event.deltaY * lines);
  }, { passive: false });
}
