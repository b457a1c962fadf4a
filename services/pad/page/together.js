// Drawing together: keeps the drawing on the sheet and the shared one (shared.js) the same, by way of the server. A page whose sheet
// shows another drawing is outside, until a person joins the others or shares theirs. Without a link, changes wait here.

import { isBlank } from "./model.js";
import { Shared, unwired, wired } from "./shared.js";
import { newId } from "./shelf.js";

/** Minimum time between two requests with changes, and before one is repeated; milliseconds. */
const [SEND_MS, AGAIN_MS] = [50, 500];
/** Statuses of refusals that depend on the moment: the page is not known yet, the request was slow, there were too many. */
const PASSING = [403, 408, 429];

const pause = (ms) => new Promise((done) => { setTimeout(done, ms); });

export class Together {
  #host;
  #by = newId().slice(0, 6);
  /** The drawings that this page knows, by their ids, and which one is shared. */
  #known = new Map();
  #room = null;
  /** Ids of the items of the room that the server does not know yet. */
  #unsent = new Set();
  /** The id of the drawing that the shared one is to replace; `null` once the server has answered. */
  #instead = null;
  #may = false;
  /** Whether the first message about the shared drawing is still to come, and whether there was one about the people. */
  #isFirst = false;
  #hasMet = false;
  /** Whether another drawing was shared while this page waited for an answer. */
  #missed = false;
  #inside = false;
  #sending = false;
  /** Number of changes of this page, and what it was when the server refused a request for what it contained. */
  #changes = 0;
  #refused = -1;
  #news = Promise.resolve();
  people = [];
  me = 0;

  /**
   * The host has `desk`, `link`, `kept(id)` (a drawing of the library with what shared.js keeps beside it, `null` if there is none),
   * `found(id)` (opens a drawing of the library; `null` if there is none), `begun()` (puts a drawing on the sheet, as nobody shares
   * one), `changed()`, `say(words, bad)`.
   */
  constructor(host) {
    this.#host = host;
  }

  get #drawing() {
    return this.#host.desk.drawing;
  }

  /** A link to the server. `may`: whether people draw freely there. */
  linked(may) {
    this.#may = may;
    this.#changes += 1;
    [this.#isFirst, this.#hasMet, this.#missed] = [true, false, false];
  }

  /** Whether the server has refused what is still to be sent. It is sent again with the next change. */
  get #isRefused() {
    return this.#refused === this.#changes;
  }

  /** Whether the sheet shows the shared drawing, and the others can see it. */
  get isInside() {
    const isShared = this.#instead === null || !this.#isRefused;
    return this.#may && this.#inside && isShared && this.#host.link.up;
  }

  /** Whether others draw in a drawing that is not on this sheet. */
  get isOutside() {
    return this.#may && !this.#inside && this.#host.link.up && this.others.length > 0;
  }

  /** The other pages whose sheet shows the shared drawing. */
  get others() {
    return this.people.filter(({ page, sheet }) => page !== this.me && sheet !== null && sheet === this.#room?.sheet.id);
  }

  /** What shared.js keeps beside a drawing; `null` if it was never shared. */
  keptBeside(drawing) {
    return this.#remembered(drawing.id)?.kept(drawing) ?? null;
  }

  /** A drawing was read again from the library: what is kept beside it there counts. */
  reread(id) {
    if (id !== this.#room?.sheet.id) this.#known.delete(id);
  }

  /** What is known of a drawing that was shared before; `null` if it was not. */
  #remembered(id) {
    const found = this.#known.has(id) ? null : this.#host.kept(id);
    if (found) this.#known.set(id, Shared.restored(found.drawing, found.shared, this.#by));
    return this.#known.get(id) ?? null;
  }

  #know(sheet) {
    if (!this.#remembered(sheet.id)) this.#known.set(sheet.id, new Shared(sheet, this.#by));
    return this.#known.get(sheet.id);
  }

  // ------------------------------------------------------------------ from the server

  met({ me, all }) {
    [this.me, this.people, this.#hasMet] = [me, all, true];
    this.#alone();
    this.#host.changed();
  }

  /** What others have drawn. One after the other, since a drawing of the library may have to be opened first. */
  told(news) {
    this.#news = this.#news.then(() => this.#told(news)).catch((error) => this.#host.say(error.message, true));
  }

  async #told({ sheet, entries }) {
    if (!this.#may) return;
    const isFirst = this.#isFirst;
    if (!sheet) {
      await this.#host.begun();
      [this.#isFirst, this.#instead] = [false, ""];
      this.share();
      return;
    }
    const isOther = sheet.id !== this.#room?.sheet.id;
    if (isOther && !isFirst && this.#instead !== null) {
      this.#missed ||= sheet.id !== this.#instead;
      if (this.#isRefused) this.#host.link.restart();
      return;
    }
    if (isFirst && sheet.id !== this.#drawing.id && isBlank(this.#drawing)) await this.#open(sheet);
    const wasInside = this.#inside && isOther;
    this.#isFirst = false;
    this.#room = this.#know(sheet);
    const theirs = entries.map(unwired);
    theirs.forEach((entry) => this.#room.take(entry));
    if (isFirst || isOther) this.#owe(new Map(theirs.map((entry) => [entry.id, entry])));
    this.#inside = sheet.id === this.#drawing.id;
    if (this.#inside) this.#merge();
    else if (isBlank(this.#drawing) || (wasInside && !isFirst)) {
      if (!isBlank(this.#drawing)) this.#host.say("Another drawing is shared now. The last one is in the library.");
      this.join();
    }
    this.#alone();
    this.#send();
    this.#host.changed();
  }

  /** Opens this browser's copy of a drawing, which may have changes that the server does not know. */
  async #open(sheet) {
    const drawing = await this.#host.found(sheet.id);
    if (drawing && isBlank(this.#drawing)) this.#host.desk.renew(drawing);
  }

  /** After a break, the server is sent what it lacks. */
  #owe(theirs) {
    this.#instead = null;
    this.#unsent = new Set(this.#room.all().filter(({ id, time, by }) => {
      const known = theirs.get(id);
      return known?.time !== time || known.by !== by;
    }).map(({ id }) => id));
  }

  #merge() {
    const next = this.#room.drawing(this.#drawing);
    if (Object.keys(next).some((key) => next[key] !== this.#drawing[key])) this.#host.desk.merge(next);
  }

  // ------------------------------------------------------------------ from this page

  /** The sheet shows another drawing than before. */
  changed(drawing) {
    if (drawing.id !== this.#room?.sheet.id) {
      this.#inside = false;
      this.#remembered(drawing.id)?.follow(drawing);
      this.#alone();
      return;
    }
    const changes = this.#inside ? this.#room.follow(drawing) : [];
    if (changes.length) this.#changes += 1;
    changes.forEach((id) => this.#unsent.add(id));
    this.#inside = true;
    this.#merge();
    this.#send();
  }

  /** If nobody draws in the shared drawing, the one on this sheet is shared. */
  #alone() {
    const isKnown = this.#may && this.#room && this.#hasMet && !this.#isFirst && this.#host.link.up;
    if (isKnown && !this.#inside && !this.others.length) this.share();
  }

  /** Shows the shared drawing on this sheet. The last one stays in the library, and undo leads back to it. */
  join() {
    if (!this.#room) return;
    this.#inside = true;
    const { desk } = this.#host;
    const next = this.#room.drawing();
    if (isBlank(this.#drawing)) desk.renew(next);
    else desk.change(next);
  }

  /** Shares the drawing of this sheet in place of the one that is shared. */
  share() {
    const drawing = this.#drawing;
    this.#changes += 1;
    this.#instead ??= this.#room?.sheet.id ?? "";
    this.#room = this.#know(drawing);
    this.#room.follow(drawing);
    this.#unsent = new Set(this.#room.all().map(({ id }) => id));
    this.#inside = true;
    this.#merge();
    this.#send();
    this.#host.changed();
  }

  /** Sends changes, in one request at a time, until there are none or the server refuses them. */
  async #send() {
    if (this.#sending) return;
    this.#sending = true;
    while (this.#host.link.up && !this.#isFirst && !this.#isRefused && (this.#unsent.size || this.#instead !== null)) {
      const changes = this.#changes;
      try {
        await this.#post();
        await pause(SEND_MS);
      } catch (error) {
        if (error.unheard || PASSING.includes(error.status)) await pause(AGAIN_MS);
        else this.#onRefused(error, changes);
      }
    }
    this.#sending = false;
  }

  async #post() {
    const [room, instead] = [this.#room, this.#instead];
    const entries = [...this.#unsent].map((id) => room.get(id));
    const body = { sheet: room.sheet, entries: entries.map(wired), ...instead === null ? {} : { instead } };
    await this.#host.link.post("/api/draw", JSON.stringify(body));
    if (this.#room !== room) {
      // Meanwhile, the sheet has changed again.
      if (instead !== null) this.#instead = room.sheet.id;
      return;
    }
    this.#instead = null;
    if (this.#missed) this.#host.link.restart();
    for (const entry of entries) if (room.get(entry.id) === entry) this.#unsent.delete(entry.id);
  }

  /** A request was refused that was sent after so many changes. A page whose drawing is not shared learns again which one is. */
  #onRefused({ status, message }, changes) {
    this.#refused = changes;
    // Another page was faster, and its drawing is shared.
    const isLate = status === 409;
    if (isLate) this.#unsent.clear();
    else this.#host.say(`The others do not see your last change: ${message}`, true);
    const isElsewhere = ({ page, sheet }) => page !== this.me && sheet === this.#instead;
    const isLeftOut = this.#isRefused && (this.#missed || (this.#instead !== null && this.people.some(isElsewhere)));
    if (isLate || isLeftOut) this.#host.link.restart();
    this.#host.changed();
  }
}
