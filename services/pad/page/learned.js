// What the robot has learned: the layer over the drawing, the corrected drawing, and the texts and buttons for both. Grows while the
// robot drives.

const at = (id) => document.getElementById(id);

/** What was learned and what can be done about it, in words; `null` if nothing was learned. */
export function learnedWords({ feed, learned, watches }) {
  if (!learned) return null;
  if (learned.growing) return "The robot corrects the drawing by what it sees.";
  if (watches) return "The drawing, corrected by what the robot saw.";
  if (feed?.allowed.includes("accept")) return "The robot has learned what it saw. Accept it, and it drives by that.";
  return learned.accepted ? "The robot drives by what it has learned, from anywhere." : null;
}

/** Shows what was learned, with the buttons of `enabled`. Pages that watch see it, too. */
export function showLearned(state, buttons) {
  const words = learnedWords(state);
  const mayDecide = state.drives && !state.watches && !state.learned?.growing;
  at("learned").hidden = words === null;
  at("accept").hidden = !buttons.accept;
  at("correct").hidden = at("reject").hidden = !mayDecide;
  at("correct").disabled = !buttons.sketch;
  if (at("learned-words").textContent !== (words ?? "")) at("learned-words").textContent = words ?? "";
  if (words === null) at("corrected").hidden = true;
}

/** The pictures of what was learned. */
export class Lessons {
  #number = null;
  #shown = null;

  /** `fetch(path)` returns a blob, `show(picture)` puts a picture, or `null`, over the drawing. */
  constructor(fetch, show) {
    Object.assign(this, { fetch, show });
    at("show-corrected").addEventListener("click", () => this.#open(at("corrected").hidden));
    at("close-corrected").addEventListener("click", () => this.#open(false));
  }

  /** The path of the picture over the drawing. */
  get path() {
    return `/api/learned.png?k=${this.#number}`;
  }

  /** Takes what the server says about it. A picture that cannot be fetched is not shown. */
  async take(view) {
    const number = view?.picture ?? null;
    if (number === this.#number) return;
    this.#number = number;
    const blob = number && await this.fetch(this.path).catch(() => null);
    const picture = blob ? await createImageBitmap(blob) : null;
    if (number !== this.#number) return;
    this.show(picture);
    await this.#draw();
  }

  #open(open) {
    at("corrected").hidden = !open;
    at("show-corrected").setAttribute("aria-expanded", open);
    this.#draw();
  }

  /** Draws the corrected drawing if it is open. An earlier one stays until the new one has arrived. */
  async #draw() {
    const number = this.#number;
    if (at("corrected").hidden || number === null || number === this.#shown) return;
    const blob = await this.fetch(`/api/corrected.svg?k=${number}`).catch(() => null);
    if (!blob || number !== this.#number) return;
    this.#shown = number;
    const before = at("corrected-picture").src;
    at("corrected-picture").src = URL.createObjectURL(blob);
    if (before) URL.revokeObjectURL(before);
  }
}
