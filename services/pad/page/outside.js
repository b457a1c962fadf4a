// Files of other programs: drawings of this page, of Excalidraw, SVGs, pictures.

import { fromExcalidraw, isExcalidraw } from "./excalidraw.js";
import { photo } from "./files.js";
import { blank, fromFile } from "./model.js";
import { counted } from "./placing.js";
import { fromSvg } from "./svgfile.js";

/** Maximum size of a file, bytes. */
const MAX_BYTES = 64 << 20;
/** File types offered in the dialog. */
export const ACCEPTED = ".json,.excalidraw,.svg,application/json,image/*";

/** What was left out, as a sentence. */
export const leftOut = (left) => (left.length ? ` Left out: ${counted(left)}.` : "");

/**
 * Reads a drawing in any text format: `{ drawing, left, own }`; `own`: in this page's own format, so in its own pixels. Throws an
 * `Error` with what was expected.
 */
export function fromWords(text) {
  const begin = text.replace(/^\uFEFF/, "").trimStart();
  if (begin.startsWith("<")) return { ...fromSvg(begin), own: false };
  if (!begin.startsWith("{")) throw new Error("expected a drawing (JSON, .excalidraw, SVG) or a picture (PNG, JPEG)");
  let file;
  try {
    file = JSON.parse(begin);
  } catch (error) {
    throw new Error(`expected a drawing in JSON: ${error.message}`);
  }
  return isExcalidraw(file) ? { ...fromExcalidraw(file), own: false } : { drawing: fromFile(file), left: [], own: true };
}

/** Reads a file: `{ drawing, picture, words }`, where `words` lists what was left out. Throws an `Error` with the file's name. */
export async function readFile(file) {
  if (file.size > MAX_BYTES) throw new Error(`${file.name}: expected at most ${MAX_BYTES >> 20} MiB, found ${Math.ceil(file.size / (1 << 20))}.`);
  if (file.type.startsWith("image/") && !/svg/.test(file.type)) {
    const { size, url } = await photo(file);
    return { drawing: { ...blank(size), photo: url }, picture: url, words: "" };
  }
  try {
    const { drawing, left } = fromWords(await file.text());
    return { drawing, picture: null, words: leftOut(left) };
  } catch (error) {
    throw new Error(`${file.name}: ${error.message}.`, { cause: error });
  }
}
