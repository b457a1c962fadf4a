// Pens, fingers and mice into strokes and movements of the sheet.
//
// `Pointers` is a pure state machine: it takes what happened and calls its listener. `listen` binds it to
// an element. The rules of the hand:
// - A pen or the mouse's first button draws; the other buttons move the sheet.
// - Until a pen has been seen, one finger draws. From then on fingers only move and zoom: what rests on
//   the sheet beside a pen is a palm. What is drawn can be selected by a finger all the same.
// - A second finger never begins a stroke. Where it comes right after the first, both mean a pinch, and
//   the stroke of the first is dropped.
// - A stroke that the browser cancels is dropped.

/** How soon a second finger must come to mean a pinch, and how little the first may have drawn. */
const PINCH_MS = 300;
const PINCH_PX = 24;
/** What `buttons` says of a pen's eraser end. */
const ERASER = 32;

/**
 * What pointers do to the sheet. A pointer is `{ id, type, x, y, pressure, buttons, shift, time }`, in
 * CSS pixels of the sheet's element and milliseconds. The listener has `begin(sample)`,
 * `extend(samples)`, `end()`, `cancel()`, `hover(sample)`, `pan(dx, dy)`, `zoom(at, factor)`; `options()` answers
 * `{ hand, fingers, picks }`: whether the tool moves the sheet, whether fingers may draw, and whether the tool selects, which
 * fingers may always do.
 */
export class Pointers {
  #listener;
  #options;
  #penSeen = false;
  /** Pointers that are down: id → { x, y, type, role }, role "draw", "move" or "rest". */
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

  /** Whether a stroke is under way. */
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

  /** `points`: everything since the last move, coalesced events among it. */
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

  /** The wheel zooms about the place under it. */
  wheel(at, delta) {
    this.#listener.zoom(at, Math.exp(-delta / 400));
  }

  /** Everything is let go: the window has lost the focus, the page was hidden. */
  cancelAll() {
    if (this.#stroke) this.#drop();
    this.#down.clear();
  }

  #drop() {
    this.#stroke = null;
    this.#listener.cancel();
  }

  /** A pen comes: whatever fingers were doing was a palm's doing. */
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
      // The first finger and this one mean a pinch.
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
    // Two fingers: their middle moves the sheet, their distance zooms it.
    const other = others[0][1];
    this.#listener.pan((p.x - before.x) / 2, (p.y - before.y) / 2);
    const [was, is] = [before, p].map((q) => Math.hypot(q.x - other.x, q.y - other.y));
    if (was > 8 && is > 8) this.#listener.zoom([(p.x + other.x) / 2, (p.y + other.y) / 2], is / was);
  }
}

/** A pen's pressure; a mouse and most fingers have none to tell. */
const sample = ({ x, y, pressure, type, shift, alt, ctrl, time }) => (
  { at: [x, y], pressure: type === "pen" ? pressure : null, touch: type === "touch", shift: Boolean(shift), alt: Boolean(alt), ctrl: Boolean(ctrl), time }
);

/** Everything since the last event: where a browser hides it (no secure context), the event itself. */
function coalesced(event) {
  const events = event.getCoalescedEvents?.() ?? [];
  return events.length ? events : [event];
}

/** Binds pointers to an element that fills its place on the screen. */
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
    // The last place before the pen leaves counts, too.
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
