// The library of drawings in this browser's IndexedDB. A drawing is kept as the text of its file; beside it stands a small entry with
// its name, the time of its last change, and a picture, so that a list needs no texts.

const [DATABASE, VERSION] = ["sketchnav", 1];
const STORES = ["entries", "texts"];
const UNNAMED = /^Drawing (\d+)$/;
/** How many of its last states an entry remembers. */
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

/** A short name of a text (FNV-1a). */
function digest(text) {
  let hash = 2166136261;
  for (let i = 0; i < text.length; i += 1) hash = Math.imul(hash ^ text.charCodeAt(i), 16777619);
  return `${text.length} ${hash >>> 0}`;
}

/** A new name for a drawing among the entries. */
const unnamed = (entries) => `Drawing ${1 + Math.max(0, ...entries.map(({ name }) => Number(UNNAMED.exec(name)?.[1] ?? 0)))}`;

/** The key of a drawing that is new, here and in any other page. */
export const newId = () => Array.from(crypto.getRandomValues(new Uint32Array(4)), (n) => n.toString(16).padStart(8, "0")).join("");

export class Shelf {
  #database = null;

  /** Does `work({ entries, texts })` in one transaction, and answers what it answers once that is on the disk. */
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

  /** All entries, `{ id, name, changed, picture, gone, past }`; the one that was changed last comes first. `changed`: ms since 1970. */
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
   * Keeps a drawing, and answers its entry. `stamp`: when it was changed last as far as this page knows, `null` if it is new. If
   * another page has changed it otherwise or deleted it since, this one is kept beside it, under another id. `late`: from a page
   * that is gone, so that it may have been kept already.
   */
  save({ id, stamp, text, name = null }, late = false) {
    return this.#does("readwrite", async ({ entries, texts }) => {
      const all = await result(entries.getAll());
      const found = all.find((entry) => entry.id === id);
      const isOther = found && (found.gone || found.changed !== stamp);
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

  /** Changes the entry of a drawing by `change(entry)`; answers it. */
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

  /** A drawing that is removed can be restored until the next sweep. */
  remove(id) {
    return this.#edit(id, () => ({ gone: true }));
  }

  restore(id) {
    return this.#edit(id, () => ({ gone: false }));
  }

  /** The picture of a drawing as it was at the time `changed`. */
  keepPicture(id, changed, url) {
    return this.#edit(id, () => ({ picture: { changed, url } }));
  }

  /** A copy of a drawing; answers its entry. */
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

  /** Deletes what was removed. */
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
