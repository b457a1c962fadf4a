// The library of drawings in this browser's IndexedDB. A drawing is stored as the text of its file; beside it is a small entry with
// its name, the time of its last change, and a picture, so that a list does not need to read the texts.

const [DATABASE, VERSION] = ["sketchnav", 1];
const STORES = ["entries", "texts"];
const UNNAMED = /^Drawing (\d+)$/;
/** Number of past versions that an entry remembers. */
const PAST = 50;

/** The result of a request. */
const result = (request) => new Promise((resolve, reject) => {
  request.onsuccess = () => resolve(request.result);
  request.onerror = () => reject(request.error);
});

function opened() {
  const request = indexedDB.open(DATABASE, VERSION);
  request.onupgradeneeded = () => {
    request.result.createObjectStore("entries", { keyPath: "id" });
    request.result.createObjectStore("texts");
  };
  return result(request);
}

/** A hash of a text (FNV-1a). */
function digest(text) {
  let hash = 2166136261;
  for (let i = 0; i < text.length; i += 1) hash = Math.imul(hash ^ text.charCodeAt(i), 16777619);
  return `${text.length} ${hash >>> 0}`;
}

/** A default name that no entry has. */
const unnamed = (entries) => `Drawing ${1 + Math.max(0, ...entries.map(({ name }) => Number(UNNAMED.exec(name)?.[1] ?? 0)))}`;

/** A new id, unique across pages. */
export const newId = () => Array.from(crypto.getRandomValues(new Uint32Array(4)), (n) => n.toString(16).padStart(8, "0")).join("");

export class Shelf {
  #database = null;

  /** Runs `work({ entries, texts })` in one transaction, and returns its result once the transaction is complete. */
  async #does(mode, work) {
    this.#database ??= opened();
    let database;
    try {
      database = await this.#database;
    } catch (error) {
      this.#database = null;
      throw error;
    }
    database.onversionchange = () => database.close();
    database.onclose = () => { this.#database = null; };
    const transaction = database.transaction(STORES, mode, { durability: "strict" });
    const ended = new Promise((resolve, reject) => {
      transaction.oncomplete = resolve;
      transaction.onabort = () => reject(transaction.error ?? new Error("The browser has ended a transaction."));
    });
    ended.catch(() => {});
    const answer = await work({ entries: transaction.objectStore("entries"), texts: transaction.objectStore("texts") });
    await ended;
    return answer;
  }

  /** All entries, `{ id, name, changed, picture, gone, past }`, the most recently changed first. `changed`: ms since 1970. */
  async list() {
    const all = await this.#does("readonly", ({ entries }) => result(entries.getAll()));
    return all.sort((a, b) => b.changed - a.changed);
  }

  /** The entry of a drawing, with its `text`; `null` if there is none. */
  open(id) {
    return this.#does("readonly", async ({ entries, texts }) => {
      const [entry, text] = await Promise.all([result(entries.get(id)), result(texts.get(id))]);
      return entry && text !== undefined ? { ...entry, text } : null;
    });
  }

  /**
   * Saves a drawing and returns its entry. `stamp`: the time of its last change that this page has seen, `null` if it is new. If
   * another page has changed or deleted it since, this version is saved separately, under another id, unless `isShared`: then all pages
   * have the same one. `late`: left behind by a
   * closed page, so it may already have been saved.
   */
  save({ id, stamp, text, name = null, isShared = false }, late = false) {
    return this.#does("readwrite", async ({ entries, texts }) => {
      const all = await result(entries.getAll());
      const found = all.find((entry) => entry.id === id);
      const isOther = found && (found.gone || (found.changed !== stamp && !isShared));
      if (isOther && late && found.past.includes(digest(text))) return found;
      if (isOther && !found.gone && await result(texts.get(id)) === text) return found;
      const entry = {
        id: isOther ? newId() : id, name: isOther ? `${found.name}, another` : found?.name ?? name ?? unnamed(all),
        changed: Math.max(Date.now(), (found?.changed ?? 0) + 1), picture: isOther ? null : found?.picture ?? null, gone: false,
        past: [...(isOther ? [] : found?.past ?? []), digest(text)].slice(-PAST),
      };
      entries.put(entry);
      texts.put(text, entry.id);
      return entry;
    });
  }

  /** Changes the entry of a drawing by `change(entry)` and returns it. */
  #edit(id, change) {
    return this.#does("readwrite", async ({ entries }) => {
      const entry = await result(entries.get(id));
      if (!entry) throw new Error("This drawing is not in the library: another page has deleted it.");
      const next = { ...entry, ...change(entry) };
      entries.put(next);
      return next;
    });
  }

  rename(id, name) {
    return this.#edit(id, () => ({ name }));
  }

  /** A removed drawing can be restored until the next sweep. */
  remove(id) {
    return this.#edit(id, () => ({ gone: true }));
  }

  restore(id) {
    return this.#edit(id, () => ({ gone: false }));
  }

  /** Saves the picture of a drawing as of the time `changed`. */
  keepPicture(id, changed, url) {
    return this.#edit(id, () => ({ picture: { changed, url } }));
  }

  /** Copies a drawing and returns the entry of the copy. */
  duplicate(id) {
    return this.#does("readwrite", async ({ entries, texts }) => {
      const [entry, text] = await Promise.all([result(entries.get(id)), result(texts.get(id))]);
      if (!entry || text === undefined) throw new Error("This drawing is not in the library: another page has deleted it.");
      const changed = Date.now();
      const picture = entry.picture?.changed === entry.changed ? { ...entry.picture, changed } : null;
      const copy = { ...entry, id: newId(), name: `${entry.name}, copy`, changed, picture };
      entries.put(copy);
      texts.put(text, copy.id);
      return copy;
    });
  }

  /** Deletes removed drawings for good. */
  sweep() {
    return this.#does("readwrite", async ({ entries, texts }) => {
      for (const { id, gone } of await result(entries.getAll())) {
        if (!gone) continue;
        entries.delete(id);
        texts.delete(id);
      }
    });
  }
}
