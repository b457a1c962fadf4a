// The page of a study: the participant, the measurements during drawing, the questions. The server keeps track of the participant's
// progress; only the end of the practice is decided by this page.

import { NOTHING, measured, report } from "./measure.js";
import { begun } from "./keeper.js";
import { LANDSCAPE, PORTRAIT, blank } from "./model.js";

const at = (id) => document.getElementById(id);
const now = () => performance.timeOrigin + performance.now();
/** What a page keeps across a reload, and what it deletes after a participant. */
const [STORE, OF_PARTICIPANT] = ["study", ["study", "placed"]];
const NOBODY = { code: null, practising: true, measure: NOTHING };

function load() {
  try {
    return { ...NOBODY, ...JSON.parse(sessionStorage.getItem(STORE) ?? "{}") };
  } catch {
    return NOBODY;
  }
}

export class Study {
  #view = null;
  #drives = false;
  #kept = load();
  #seen;
  #began = null;
  #how = "draw";
  #asks = false;
  #place = false;

  /** The host has `desk`, `post(body)`, `picture(path)` (a blob), `changed()`, `forget()` (the drawing). */
  constructor(host) {
    this.host = host;
    this.#seen = host.desk.drawing;
    at("sheet").addEventListener("pointerdown", () => {
      if (host.desk.tool !== "hand") this.#began ??= now();
    }, true);
    at("study-begin").addEventListener("submit", (event) => this.#submit(event, () => ({
      begin: { code: at("study-code").value, age: at("study-age").valueAsNumber || null },
    })));
    at("study-answers").addEventListener("submit", (event) => this.#submit(event, () => ({ answers: this.#answers() })));
    at("study-start").addEventListener("click", () => this.#start());
    at("study-questions").addEventListener("click", () => {
      this.#asks = true;
      this.#show();
    });
    at("study").addEventListener("cancel", (event) => event.preventDefault());
    // The sheet's shortcuts are off while the dialog is open.
    at("study").addEventListener("keydown", (event) => event.key !== "Escape" && event.stopPropagation());
  }

  /** Whether the sheet is for practice and cannot be sent. */
  get practising() {
    return this.takesPart && this.#view.stage === "draw" && this.#kept.practising;
  }

  /** Whether a participant of a study uses this page. */
  get takesPart() {
    return this.#view !== null && this.#drives;
  }

  /** Handles the server's view of the study, `null` if there is none, and whether this page drives. */
  told(view, drives) {
    [this.#view, this.#drives] = [view, drives];
    document.body.classList.toggle("study", view !== null);
    if (!this.takesPart) {
      this.#show();
      return;
    }
    if (view.stage === "welcome" && this.#kept.code !== null) {
      OF_PARTICIPANT.forEach((key) => sessionStorage.removeItem(key));
      this.host.forget();
      location.reload();
      return;
    }
    if (view.code !== null && view.code !== this.#kept.code) this.#keep({ ...NOBODY, code: view.code });
    if (view.stage !== "driven") this.#asks = false;
    this.#show();
  }

  /** Whether the robot has driven and stands still, so that the questions follow. */
  hasQuestions(feed) {
    const stands = Boolean(feed) && !["driving", "paused"].includes(feed.state);
    return this.takesPart && this.#view.stage === "driven" && stands;
  }

  /** Shows what the participant can do in this state of the robot. */
  refresh(feed) {
    at("study-start").hidden = !this.practising;
    at("study-questions").hidden = !this.hasQuestions(feed);
    this.#show();
  }

  /** Runs `work` as an `undo` or `redo`, not as drawing. */
  step(how, work) {
    this.#how = how;
    work();
    this.#how = "draw";
  }

  /** Handles a change of the drawing or of something else; `edits`: with a tool that changes existing items. */
  saw(drawing, edits = false) {
    const before = this.#seen;
    this.#seen = drawing;
    if (drawing === before || !this.takesPart || this.#view.stage !== "draw" || this.practising) return;
    const ended = now();
    const screen = matchMedia("(orientation: portrait)").matches ? "portrait" : "landscape";
    const how = edits && this.#how === "draw" ? "edit" : this.#how;
    const step = { how, began: this.#began ?? ended, ended, screen };
    this.#began = null;
    this.#keep({ ...this.#kept, measure: measured(this.#kept.measure, before, drawing, step) });
  }

  /** Sends the measurements to the server before the robot drives. */
  async beforeDrive() {
    if (!this.takesPart || this.#view.stage !== "draw") return;
    const measures = report(this.#kept.measure);
    if (!measures) throw new Error("Draw the place on this page first: the time that takes is part of the study.");
    await this.host.post({ measures });
  }

  #keep(kept) {
    this.#kept = kept;
    sessionStorage.setItem(STORE, JSON.stringify(kept));
  }

  /** Ends the practice: an empty sheet, with no undo. */
  #start() {
    const drawing = begun(blank(this.#view.sheet === "portrait" ? PORTRAIT : LANDSCAPE));
    this.host.desk.renew(drawing);
    this.#began = null;
    this.#keep({ ...this.#kept, practising: false, measure: NOTHING });
    this.host.changed();
  }

  async #submit(event, told) {
    event.preventDefault();
    at("study-error").textContent = "";
    try {
      await this.host.post(told());
    } catch (error) {
      at("study-error").textContent = error.message;
    }
  }

  #answers() {
    const ratings = this.#view.statements.map(({ key }) => [key, Number(new FormData(at("study-answers")).get(key))]);
    return { ratings: Object.fromEntries(ratings), suggestions: at("study-suggestions").value };
  }

  /** The visible part of the dialog; `null` if there is none. */
  get #part() {
    if (!this.takesPart) return null;
    if (this.#asks) return "study-answers";
    return { welcome: "study-begin", done: "study-thanks" }[this.#view.stage] ?? null;
  }

  #show() {
    const [dialog, part] = [at("study"), this.#part];
    if (part === null) {
      if (dialog.open) dialog.close();
      return;
    }
    for (const id of ["study-begin", "study-answers", "study-thanks"]) at(id).hidden = id !== part;
    if (part === "study-answers") this.#ask();
    if (part === "study-begin") this.#showPlace();
    if (!dialog.open) dialog.showModal();
  }

  /** A row of choices for each statement. */
  #ask() {
    const list = at("study-statements");
    if (list.childElementCount > 0) return;
    const { statements, scale, suggestions } = this.#view;
    at("study-suggestions").maxLength = suggestions;
    list.append(...statements.map(({ key, text }) => {
      const row = document.createElement("fieldset");
      row.append(Object.assign(document.createElement("legend"), { textContent: text }));
      scale.forEach((word, i) => {
        const choice = document.createElement("label");
        const input = Object.assign(document.createElement("input"), { type: "radio", name: key, value: i + 1, required: true });
        choice.append(input, word);
        row.append(choice);
      });
      return row;
    }));
  }

  async #showPlace() {
    if (this.#place || !this.#view.place) return;
    this.#place = true;
    try {
      at("study-place").src = URL.createObjectURL(await this.host.picture("/api/place.svg"));
      at("study-place").hidden = false;
    } catch {
      this.#place = false;
    }
  }
}
