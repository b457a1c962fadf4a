// The bar of what is selected: a button for each thing that can be done with it, shown while it can.

const at = (id) => document.getElementById(id);

/** When a button is shown, by `Selection.state`. */
const SHOWN = {
  adds: ({ editing }) => !editing,
  duplicate: ({ editing, copies }) => !editing && copies,
  points: ({ points }) => points,
  insert: ({ editing }) => editing,
  label: ({ editing, label }) => !editing && label,
  group: ({ units }) => units > 1,
  ungroup: ({ grouped, units }) => grouped && units === 1,
  arrange: ({ units }) => units > 1,
  gaps: ({ editing, strokes }) => !editing && strokes,
  simplify: ({ strokes, editing }) => strokes || editing,
  remove: () => true,
  spread: ({ units }) => units > 2,
};

/** What a button does, by its name, if that is not a method of Selection. */
const DOES = {
  adds: (selection) => selection.toggleAdding(),
  points: (selection) => selection.editPoints(),
  gaps: (selection) => selection.closeGaps(),
};

/** Binds the bar to `desk.selecting`. `sheet` gets the focus back after a click, so that keys go on with what is selected. */
export function bindBar(desk, sheet) {
  // The event comes after the choice is shown, so until then it is at the left edge, which is on every screen.
  at("arrange").addEventListener("toggle", (event) => (event.newState === "open" ? placeArrange() : at("arrange").style.left = "8px"));
  for (const button of at("selection").querySelectorAll("[data-does]")) {
    button.addEventListener("click", (event) => {
      const [name, value] = button.dataset.does.split(" ");
      const selection = desk.selecting;
      if (!selection) return;
      if (DOES[name]) DOES[name](selection);
      else selection[name](Number.isNaN(Number(value)) ? value : Number(value));
      if (button.closest("[popover]")) at("arrange").hidePopover();
      // A click by a key leaves the focus where it is.
      if (event.detail > 0 && name !== "label") sheet.focus({ preventScroll: true });
    });
  }
}

/** Puts the choice of sides above the bar, or below it if that is at the top, within the screen. */
function placeArrange() {
  const { top, bottom, left, width } = at("selection").getBoundingClientRect();
  const { width: own } = at("arrange").getBoundingClientRect();
  const x = Math.max(8, Math.min(left + (width - own) / 2, window.innerWidth - own - 8));
  const high = top < window.innerHeight / 2;
  Object.assign(at("arrange").style, {
    left: `${x}px`, top: high ? `${bottom + 6}px` : "auto", bottom: high ? "auto" : `${window.innerHeight - top + 6}px`,
  });
}

/** Shows the bar, or hides it while nothing is selected, and says what is. */
export function showBar(selection) {
  const bar = at("selection");
  const state = selection?.state;
  const words = state?.words ?? "";
  if (at("selected").textContent !== words) at("selected").textContent = words;
  const hidden = !state?.count;
  const had = bar.contains(document.activeElement) && document.activeElement;
  for (const element of bar.querySelectorAll("[data-shown]")) element.hidden = !hidden && !SHOWN[element.dataset.shown](state);
  bar.hidden = hidden;
  if (hidden && at("arrange").matches(":popover-open")) at("arrange").hidePopover();
  if (had && !had.checkVisibility()) at("sheet").focus({ preventScroll: true });
  if (hidden) return;
  bar.querySelector('[data-shown="adds"]').setAttribute("aria-pressed", String(state.adds));
  bar.querySelector('[data-shown="points"]').setAttribute("aria-pressed", String(state.editing));
}
