// Drop and paste onto the sheet, copy and cut from it.

import { copied, withCopies } from "./items.js";
import { writes } from "./keyboard.js";
import { blank, toText } from "./model.js";

/** Text that may be a drawing. */
const DRAWING = /^\s*[{<]/;

/** The selection as a drawing: the contents of the clipboard, also for other pages. */
const asText = (drawing, keys) => toText(withCopies(blank(drawing.canvas), copied(drawing, keys), [0, 0]).drawing);

/**
 * Handles the clipboard and dropped files. The host has `takes()` (whether anything is accepted), `files(files)`, `words(text)`,
 * `desk`, `select()` (activates the select tool).
 */
export function bindExchange(host) {
  let own = null;

  function copy(event, takesAway) {
    const selection = writes(event.target) ? null : host.desk.selecting;
    if (!selection?.keys.length || !document.getSelection().isCollapsed) return;
    event.preventDefault();
    own = asText(host.desk.drawing, selection.keys);
    event.clipboardData.setData("text/plain", own);
    if (takesAway) selection.cut();
    else selection.copy();
  }

  document.addEventListener("copy", (event) => copy(event, false));
  document.addEventListener("cut", (event) => copy(event, true));
  document.addEventListener("paste", (event) => {
    if (writes(event.target) || document.querySelector("dialog[open]") || !host.takes()) return;
    const { files } = event.clipboardData;
    const text = event.clipboardData.getData("text/plain");
    event.preventDefault();
    if (files.length) host.files([...files]);
    else if (text === own) {
      host.select();
      host.desk.selecting?.paste();
    } else if (DRAWING.test(text)) host.words(text);
  });

  const hasFiles = (event) => event.dataTransfer?.types.includes("Files");
  for (const type of ["dragenter", "dragover"]) {
    document.addEventListener(type, (event) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      event.dataTransfer.dropEffect = host.takes() ? "copy" : "none";
    });
  }
  document.addEventListener("drop", (event) => {
    if (!hasFiles(event)) return;
    // Also if nothing is accepted: otherwise the browser would leave the page for the file.
    event.preventDefault();
    if (host.takes()) host.files([...event.dataTransfer.files]);
  });
}
