// What a person has set on this device. Kept in the browser where it lets us.

const DEFAULTS = {
  width_px: 5, hold: true, snap: true, fingers: true, shows: { particles: true, scan: true, plan: true, trail: true, walls: false, learned: true },
};

/** The settings, with defaults for what is missing or of another kind. */
export function merged(kept) {
  const same = (a, b) => typeof a === typeof b;
  const pick = (base, over) => Object.fromEntries(Object.entries(base).map(([key, value]) => {
    const found = over?.[key];
    if (typeof value === "object") return [key, pick(value, found)];
    return [key, same(value, found) ? found : value];
  }));
  return pick(DEFAULTS, kept);
}

/** Reads them. */
export function load() {
  try {
    return merged(JSON.parse(localStorage.getItem("settings") ?? "{}"));
  } catch {
    return merged({});
  }
}

/** Writes them; a browser that keeps nothing forgets them with the page. */
export function keep(settings) {
  try {
    localStorage.setItem("settings", JSON.stringify(settings));
  } catch {
    // Private windows may refuse.
  }
}
