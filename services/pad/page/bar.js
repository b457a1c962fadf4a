// The bar for the selection: a button for each available action, shown only while it applies.

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

/** The method of Selection behind a button, if the names differ. */
const DOES = {
  adds: (selection) => selection.toggleAdding(),
  points: (selection) => selection.editPoints(),
  gaps: (selection) => selection.closeGaps(),
};

/**
 * Connects the bar to `desk.selecting`. `sheet` gets the focus back after a click, so that keys continue to act on the selection.
 */
export function bindBar(desk, sheet) {
  // The event fires after the menu is shown; until then the menu is at the left edge, which is always on the screen.
  at("arrange").addEventListener("toggle", (event) => (event.newState === "open" ? placeArrange() : at("arrange").style.left = "8px"));
  for (const button of at("selection").querySelectorAll("[data-does]")) {
    button.addEventListener("click", (event) => {
      const [name, value] = button.dataset.does.split(" ");
      const selection = desk.selecting;
      if (!selection) return;
      if (DOES[name]) DOES[name](selection);
      else selection[name](Number.isNaN(Number(value)) ? value : Number(value));
      if (button.closest("[popover]")) at("arrange").hidePopover();
      // A click from the keyboard leaves the focus where it is.
      if (event.detail > 0 && name !== "label") sheet.focus({ preventScroll: true });
    });
  }
}

/** Places the menu of sides above the bar, or below it if the bar is at the top, within the screen. */
function placeArrange() {
  const { top, bottom, left, width } = at("selection").getBoundingClientRect();
  const { width: own } = at("arrange").getBoundingClientRect();
  const x = Math.max(8, Math.min(left + (width - own) / 2, window.innerWidth - own - 8));
  const high = top < window.innerHeight / 2;
  Object.assign(at("arrange").style, {
    left: `${x}px`, top: high ? `${bottom + 6}px` : "auto", bottom: high ? "auto" : `${window.innerHeight - top + 6}px`,
  });
}

/** Shows the bar with a description of the selection, or hides it while nothing is selected. */
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
