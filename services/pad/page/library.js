// The library of drawings on the page: a card for each drawing, to open, rename, duplicate and delete it.

import { small } from "./files.js";
import { fromText } from "./model.js";

const at = (id) => document.getElementById(id);
const [DAY, MOMENT] = [{ day: "numeric", month: "short" }, { hour: "2-digit", minute: "2-digit" }];

/** A time in its shortest form: the time for today, the day for this year, or the date. */
export function when(ms, now = Date.now()) {
  const [then, today] = [new Date(ms), new Date(now)];
  const said = (options) => new Intl.DateTimeFormat("en-GB", options).format(then);
  if (then.toDateString() === today.toDateString()) return said(MOMENT);
  return said(then.getFullYear() === today.getFullYear() ? DAY : { ...DAY, year: "numeric" });
}

function made(tag, members = {}, ...children) {
  const element = Object.assign(document.createElement(tag), members);
  element.append(...children);
  return element;
}

function iconButton(icon, words, work) {
  const button = made("button", { className: "icon", type: "button", title: words, ariaLabel: words });
  button.innerHTML = `<svg><use href="#i-${icon}"/></svg>`;
  button.addEventListener("click", work);
  return button;
}

export class Library {
  #shelf;
  #host;
  #cards = new Map();

  /** The host has `current()` (the id of the entry on the sheet), `open(id)`, `followed(entry)`, `say(words, bad)`. */
  constructor(shelf, host) {
    [this.#shelf, this.#host] = [shelf, host];
    const dialog = at("library");
    dialog.addEventListener("close", () => this.#does(() => this.#shelf.sweep()));
    // The sheet's shortcuts are off while the dialog is open.
    dialog.addEventListener("keydown", (event) => event.key !== "Escape" && event.stopPropagation());
    // A tap outside the dialog closes it.
    dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
    at("library-close").addEventListener("click", () => dialog.close());
  }

  async show() {
    at("library-error").textContent = "";
    at("library").showModal();
    await this.#does(() => this.#list());
    navigator.storage?.persist?.().catch(() => {});
  }

  async #list() {
    const entries = await this.#shelf.list();
    this.#cards.clear();
    at("shelf").replaceChildren(...entries.map((entry) => this.#card(entry)));
    at("library-empty").hidden = entries.length > 0;
    (this.#cards.get(this.#host.current()) ?? at("shelf").firstChild)?.querySelector(".drawing").focus();
    for (const entry of entries) await this.#picture(entry);
  }

  /** Runs an action on the library and reports an error. */
  async #does(work) {
    try {
      at("library-error").textContent = "";
      await work();
    } catch (error) {
      at("library-error").textContent = error.message;
    }
  }

  #card(entry) {
    const { id, name, changed, picture } = entry;
    const image = made("img", { alt: "" });
    if (picture) image.src = picture.url;
    const open = made("button", { className: "drawing", type: "button", title: "Open" }, image);
    open.addEventListener("click", () => this.#does(async () => {
      await this.#host.open(id);
      at("library").close();
    }));
    const field = made("input", { value: name, maxLength: 60, ariaLabel: "Name of the drawing", autocomplete: "off" });
    field.addEventListener("change", () => this.#rename(entry, field));
    field.addEventListener("keydown", ({ key }) => key === "Enter" && field.blur());
    const time = made("time", { dateTime: new Date(changed).toISOString(), textContent: when(changed) });
    const copy = iconButton("duplicate", "Duplicate", () => this.#does(async () => {
      const twin = await this.#shelf.duplicate(id);
      this.#cards.get(id).before(this.#card(twin));
      this.#cards.get(twin.id).querySelector(".drawing").focus();
    }));
    const remove = iconButton("remove", "Delete", () => this.#bin(id, true));
    const restore = made("button", { className: "restore", type: "button", textContent: "Restore" });
    restore.addEventListener("click", () => this.#bin(id, false));
    const card = made("li", {}, open, field, made("div", {}, time, copy, remove, restore));
    if (id === this.#host.current()) card.setAttribute("aria-current", "true");
    this.#cards.set(id, card);
    this.#mark(card, entry);
    return card;
  }

  /** Updates a card's name and whether it is deleted. */
  #mark(card, { name, gone }) {
    card.classList.toggle("gone", gone);
    card.querySelector(".drawing").ariaLabel = `Open “${name}”`;
    card.querySelectorAll(".drawing, input").forEach((element) => { element.disabled = gone; });
  }

  #bin(id, gone) {
    return this.#does(async () => {
      const entry = await (gone ? this.#shelf.remove(id) : this.#shelf.restore(id));
      const card = this.#cards.get(id);
      this.#mark(card, entry);
      card.querySelector(gone ? ".restore" : ".drawing").focus();
    });
  }

  #rename(entry, field) {
    return this.#does(async () => {
      const name = field.value.trim();
      field.value = name || entry.name;
      if (!name) return;
      const renamed = await this.#shelf.rename(entry.id, name);
      this.#mark(this.#cards.get(entry.id), renamed);
      this.#host.followed(renamed);
    });
  }

  /** Draws a new picture of a drawing that has changed since the last one. */
  async #picture({ id, changed, picture }) {
    if (picture?.changed === changed) return;
    const kept = await this.#shelf.open(id);
    if (!kept) return;
    const url = await small(fromText(kept.text)).catch(() => null);
    const image = this.#cards.get(id)?.querySelector("img");
    if (!url || !image) return;
    image.src = url;
    await this.#shelf.keepPicture(id, changed, url);
  }
}
