// The texts and buttons around the sheet. Only shows a state: a text is written only if it has changed, so that a screen reader
// does not repeat it.

import { showLearned } from "./learned.js";
import { advice, enabled, headline, isAsked, metres, role, seconds, speed, stages, taskWords } from "./states.js";

const at = (id) => document.getElementById(id);
const BUTTONS = {
  sketch: "send-sketch", path: "send-path", execute: "execute", abort: "abort", restore: "restore", again: "again", accept: "accept", reject: "reject",
  mission: "save-mission",
};

function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Shows `state`: `{ up, drives, watches, draws, busy, feed, map, path, placing, lacks, learned, latencyMs, silentS }`. */
export function show(state) {
  const { feed } = state;
  document.body.classList.toggle("robot", Boolean(feed?.pose));
  document.body.classList.toggle("tasked", Boolean(feed?.task) && feed.task.state !== "waiting");
  document.body.classList.toggle("watches", Boolean(state.watches));
  document.body.classList.toggle("passenger", state.up && !state.drives);
  const buttons = enabled(state);
  for (const [step, id] of Object.entries(BUTTONS)) at(id).disabled = !buttons[step];
  at(BUTTONS.path).title = state.lacks ?? "";
  const next = ["sketch", "path", "execute", "restore"].findLast((step) => buttons[step]);
  for (const step of ["sketch", "path", "execute", "restore"]) at(BUTTONS[step]).classList.toggle("next", step === next);
  at("wheel").hidden = !state.up || state.drives || !feed?.wheel;
  for (const [stage, is] of stages(feed)) document.querySelector(`[data-stage="${stage}"]`).dataset.is = is;
  write(at("headline"), headline(state));
  write(at("advice"), advice(state));
  showLink(state);
  showTask(feed?.task, feed);
  showWarnings(state);
  showQuestion(feed);
  showLearned(state, buttons);
}

let answered = () => {};

/** Sets the handler `answer(place)` for a chosen place of the robot's question. */
export function onQuestion(answer) {
  answered = answer;
}

/** Shows a button for each place that the robot asks about. */
function showQuestion(feed) {
  const row = at("question");
  const places = isAsked(feed) ? feed.question.places : [];
  const key = JSON.stringify(places);
  if (row.dataset.places === key) return;
  row.dataset.places = key;
  row.hidden = places.length === 0;
  row.replaceChildren(...places.map((place) => {
    const button = Object.assign(document.createElement("button"), { textContent: place.name, title: `The robot is at ${place.name}` });
    button.addEventListener("click", () => answered(place));
    return button;
  }));
}

function showLink({ up, drives, draws, latencyMs }) {
  at("link").dataset.up = String(up);
  at("link").dataset.drives = String(drives);
  write(at("link-role"), role({ up, drives, draws }));
  write(at("link-latency"), latencyMs === null ? "" : `${latencyMs < 10 ? latencyMs.toFixed(1) : Math.round(latencyMs)} ms`);
}

function showTask(task, feed) {
  const words = ["waiting", "driving"].includes(task?.state) ? feed.words ?? [] : [];
  write(at("task"), [taskWords(task), ...words].filter(Boolean).join(" · "));
  write(at("n-speed"), speed(feed?.speed_mps));
  write(at("n-path"), metres(task?.path_m));
  write(at("n-left"), metres(task?.remaining_m));
  write(at("n-time"), seconds(task?.time_s));
}

/** The server's warnings and the page's own: a link that is down or silent. */
export function warnings({ up, feed, silentS, seen }) {
  const own = [];
  if (!up && seen) own.push("Not connected to the robot.");
  else if (up && silentS >= 2) own.push(`No word from the robot for ${Math.floor(silentS)} s.`);
  return [...own, ...(feed?.warnings ?? []).map((warning) => warning.text)];
}

function showWarnings(state) {
  const list = at("warnings");
  const texts = warnings(state);
  const shown = [...list.children].map((item) => item.textContent);
  if (texts.length === shown.length && texts.every((text, i) => text === shown[i])) return;
  list.replaceChildren(...texts.map((text) => Object.assign(document.createElement("p"), { textContent: text })));
}

/** Lists what looks wrong with the drawing, each reason once. */
export function showDoubts(doubts) {
  const reasons = [...new Set(doubts.map(({ why }) => why))];
  const list = at("doubts");
  if (list.dataset.shown === reasons.join("\n")) return;
  list.dataset.shown = reasons.join("\n");
  list.replaceChildren(...reasons.map((why) => Object.assign(document.createElement("li"), { textContent: why })));
}

let saying = 0;

/** Shows a message. An error stays until the next message. */
export function say(words, bad = false) {
  const line = at("say");
  line.dataset.bad = String(bad);
  line.textContent = words;
  clearTimeout(saying);
  if (!bad) saying = setTimeout(() => { line.textContent = ""; }, 8000);
}

/** Shows figures with their names. */
export function showFigures(figures) {
  const items = Object.entries(figures).flatMap(([name, value]) => [
    Object.assign(document.createElement("dt"), { textContent: name }),
    Object.assign(document.createElement("dd"), { textContent: value }),
  ]);
  at("figures").replaceChildren(...items);
}
