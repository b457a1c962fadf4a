// The people who draw: their pointers and the lines that they are drawing, over the sheet; a list with their names; and the choice of
// whoever draws in another drawing.

import { onScreen, onSheet } from "./view.js";

const at = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";
/** Where the browser keeps a person's name. */
const NAME = "wheel-name";
/** Minimum time between two messages about the pointer, milliseconds. */
const SHOW_MS = 50;
/** Number of colours for people, and of points of a line that is being drawn. */
const [COLOURS, MOST_POINTS] = [6, 40];
/** Tools whose lines the others see while they are drawn, freely or from end to end. */
const [FREE, STRAIGHT] = [["pen", "path"], ["line"]];
/** Number of people who are shown on the button. */
const MOST_SHOWN = 3;

/** The name of a person; a page without one has a number. */
export const nameOf = ({ page, name }) => name || `guest ${page}`;
const colourOf = ({ page }) => `who-${page % COLOURS}`;

/** At most `MOST_POINTS` of a line's points, with its ends. */
export function thinned(points) {
  const every = Math.ceil((points.length - 1) / (MOST_POINTS - 1));
  return points.length <= MOST_POINTS ? points : [...points.slice(0, -1).filter((_, i) => i % every === 0), points.at(-1)];
}

/** The names of several people in one phrase. */
const phrase = (names) => (names.length < 2 ? names.join("") : `${names.slice(0, -1).join(", ")} and ${names.at(-1)}`);

export class People {
  #host;
  #at = null;
  #line = [];
  #timer = 0;
  /** The id of the drawing that the others know to be on this sheet. */
  #sheet = null;
  #shown = "";

  /** The host has `desk`, `together`, `tell(presence)`, `named(name)` (the person has another name). */
  constructor(host) {
    this.#host = host;
    const sheet = host.desk.element;
    for (const type of ["pointerdown", "pointermove"]) sheet.addEventListener(type, (event) => this.#points(event));
    for (const type of ["pointerup", "pointercancel", "pointerleave"]) sheet.addEventListener(type, (event) => this.#lifts(event));
    at("own-name").value = this.name;
    at("own-name").addEventListener("change", () => this.rename(at("own-name").value.trim()));
    at("people").addEventListener("submit", (event) => {
      event.preventDefault();
      at("people").hidePopover();
    });
    at("join").addEventListener("click", () => host.together.join());
    at("share").addEventListener("click", () => host.together.share());
  }

  get name() {
    return localStorage.getItem(NAME) ?? "";
  }

  rename(name) {
    localStorage.setItem(NAME, name);
    at("own-name").value = name;
    this.#host.named(name);
    this.tell();
  }

  // ------------------------------------------------------------------ this page's pointer

  #points({ type, offsetX, offsetY }) {
    const { desk } = this.#host;
    this.#at = onSheet(desk.sheet.view, [offsetX, offsetY]).map(Math.round);
    const [isFree, isStraight] = [FREE, STRAIGHT].map((tools) => tools.includes(desk.tool));
    if (type === "pointerdown") this.#line = isFree || isStraight ? [this.#at] : [];
    else if (desk.isBusy && isFree) this.#line.push(this.#at);
    else if (desk.isBusy && isStraight) this.#line = [this.#line[0] ?? this.#at, this.#at];
    this.#tellSoon();
  }

  #lifts({ type, pointerType }) {
    this.#line = [];
    if (type !== "pointerup" || pointerType === "touch") this.#at = null;
    this.#tellSoon();
  }

  #tellSoon() {
    if (this.#host.together.people.length > 1) this.#timer ||= setTimeout(() => this.tell(), SHOW_MS);
  }

  /** Tells the others where this page draws. */
  tell() {
    clearTimeout(this.#timer);
    this.#timer = 0;
    const { desk } = this.#host;
    const draft = desk.isBusy ? thinned(this.#line) : [];
    if (!desk.isBusy) this.#line = [];
    this.#sheet = desk.drawing.id;
    this.#host.tell({ name: this.name, sheet: desk.drawing.id, at: this.#at, draft });
  }

  // ------------------------------------------------------------------ the others

  /** Shows who draws, and what can be chosen. */
  show() {
    const { together: room } = this.#host;
    const { people, me, isOutside, others } = room;
    if (people.length && this.#sheet !== this.#host.desk.drawing.id) this.tell();
    this.draw();
    const key = JSON.stringify([people.map(({ page, name, drives, sheet }) => [page, name, drives, sheet]), me, isOutside, room.isInside]);
    if (this.#shown === key) return;
    this.#shown = key;
    const elsewhere = people.filter(({ page }) => page !== me);
    at("people-button").hidden = elsewhere.length === 0 || !(room.isInside || isOutside);
    at("people-button").replaceChildren(...elsewhere.slice(0, MOST_SHOWN).map((person) => disc(person)), ...more(elsewhere.length - MOST_SHOWN));
    at("people-button").ariaLabel = `People: ${phrase(elsewhere.map(nameOf))}`;
    at("people-list").replaceChildren(...people.map((person) => this.#row(person)));
    at("together").hidden = !isOutside;
    const [names, draw] = [phrase(others.map(nameOf)), others.length > 1 ? "draw" : "draws"];
    at("together-words").textContent = isOutside ? `${names} ${draw} in another drawing. Join, and yours stays in the library.` : "";
  }

  #row(person) {
    const { together: room } = this.#host;
    const words = [person.page === room.me ? "you" : null, person.drives ? "drives" : null];
    if (person.page !== room.me && !room.others.includes(person)) words.push("in another drawing");
    const said = words.filter(Boolean).join(", ");
    const row = document.createElement("li");
    row.append(disc(person), Object.assign(document.createElement("span"), { textContent: said ? `${nameOf(person)} (${said})` : nameOf(person) }));
    return row;
  }

  /** Draws the pointers and lines of those who draw in the same drawing. */
  draw() {
    const { desk, together: room } = this.#host;
    const shown = room.isInside ? room.others : [];
    const layer = at("others");
    const marks = shown.filter((person) => person.at || person.draft.length).map((person) => mark(person, desk.sheet.view));
    if (marks.length || layer.firstChild) layer.replaceChildren(...marks);
  }
}

function disc(person) {
  return Object.assign(document.createElement("span"), { className: `who ${colourOf(person)}`, textContent: [...nameOf(person)][0].toUpperCase(), ariaHidden: "true" });
}

const more = (count) => (count > 0 ? [Object.assign(document.createElement("span"), { textContent: `+${count}` })] : []);

function drawn(tag, attributes, text = "") {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.textContent = text;
  return element;
}

/** A pointer with a name, and the line that it draws. */
function mark(person, view) {
  const group = drawn("g", { class: colourOf(person) });
  const [points, name] = [person.draft.map((point) => onScreen(view, point)), nameOf(person)];
  if (points.length) group.append(drawn("polyline", { points: points.map((point) => point.join()).join(" ") }));
  const [x, y] = person.at ? onScreen(view, person.at) : points.at(-1);
  group.append(
    drawn("path", { d: `M${x},${y} l0,17 l4.5,-4.5 l6.5,0 z` }),
    drawn("text", { x: x + 13, y: y + 25 }, name),
  );
  return group;
}
