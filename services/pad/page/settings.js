// The user's settings on this device, stored in the browser if it allows that.

const DEFAULTS = {
  width_px: 5, hold: true, snap: true, fingers: true, shows: { particles: true, scan: true, plan: true, trail: true, walls: false, learned: true },
};

/** The settings, with defaults for missing values and values of another type. */
export function merged(kept) {
  const same = (a, b) => typeof a === typeof b;
  const pick = (base, over) => Object.fromEntries(Object.entries(base).map(([key, value]) => {
    const found = over?.[key];
    if (typeof value === "object") return [key, pick(value, found)];
    return [key, same(value, found) ? found : value];
  }));
  return pick(DEFAULTS, kept);
}

/** Loads the settings. */
export function load() {
  try {
    return merged(JSON.parse(localStorage.getItem("settings") ?? "{}"));
  } catch {
    return merged({});
  }
}

/** Saves the settings; if the browser does not store them, they are lost with the page. */
export function keep(settings) {
  try {
    localStorage.setItem("settings", JSON.stringify(settings));
  } catch {
    // Private windows may refuse to store anything.
  }
}
