// The steps of figure 4 in paper 004: draw the map, send it, draw the path, send it, execute, abort, restore or start again. Which
// buttons are enabled, and which texts are shown. Pure.

/** The state of the navigation in words. */
const STATE_WORDS = {
  "no-sketch": "No map yet",
  sketch: "Map sent",
  path: "Path sent",
  driving: "Driving",
  aborted: "Stopped",
  paused: "Paused",
  ended: "Finished",
};

/**
 * What has to be marked before the path or the goals of a drawing can be sent, in words; `null` if nothing is missing.
 *
 * `placing`: what the navigator needs besides goals (`anywhere`: nothing, `start`, `path`). `learned`: what the robot has learned.
 */
export function missing({ placing, drawing, feed, learned }) {
  if (drawing.route || !drawing.goals.length) return null;
  if (placing === "path") return "Draw a path from where the robot stands. This robot does not drive to goals.";
  // Whoever has driven in this drawing is somewhere in it.
  const isPlaced = !["no-sketch", "sketch"].includes(feed?.state);
  if (placing !== "start" || drawing.start || learned?.accepted || isPlaced) return null;
  return "Mark the start: where the robot stands, and its heading. With this method, the robot does not find out where it is.";
}

/**
 * Which buttons are enabled. Every page may stop the robot; everything else requires the wheel.
 *
 * `up`: the link is up. `drives`: this page has the wheel. `busy`: a request is in progress. `feed`: the last one, or `null`.
 * `map`, `path`: whether the sheet has one. `lacks`: what is missing before the path can be sent, in words, or `null`.
 */
export function enabled({ up, drives, busy, feed, map, path, lacks }) {
  const may = (step) => Boolean(up && drives && feed?.ready && feed.allowed.includes(step));
  return {
    sketch: may("sketch") && map && !busy,
    path: may("path") && path && !lacks && !busy,
    execute: may("execute") && !busy,
    abort: Boolean(up && feed?.allowed.includes("abort")),
    restore: may("restore") && !busy,
    again: may("again") && !busy,
    accept: may("accept") && !busy,
    reject: may("reject") && !busy,
    mission: Boolean(up && drives && feed?.ready && !["no-sketch", "sketch"].includes(feed.state) && !busy),
  };
}

/** Progress of map, path and drive: `done`, `now` or `later`. */
export function stages(feed) {
  const at = { "no-sketch": 0, sketch: 1, path: 2, driving: 2, aborted: 2, paused: 2, ended: 2 }[feed?.state] ?? 0;
  const ended = feed?.state === "ended";
  return ["map", "path", "drive"].map((name, i) => [name, i < at || (i === 2 && ended) ? "done" : i === at ? "now" : "later"]);
}

/** The state as a headline. */
export function headline({ up, feed }) {
  if (!up) return "Not connected";
  if (!feed) return "Waiting for the navigation";
  if (feed.question) return "Where is the robot?";
  return STATE_WORDS[feed.state] ?? feed.state;
}

/** Whether a tap on this page tells the robot where it is. */
export const isAsked = (feed) => Boolean(feed?.question && feed.drives && feed.allowed.includes("here"));

/** The place meant by a tap: a place of the question if one is close enough, otherwise the tap's own. */
export function meant(question, at, near) {
  const off = (place) => Math.hypot(place.at[0] - at[0], place.at[1] - at[1]);
  const [nearest] = [...(question?.places ?? [])].sort((a, b) => off(a) - off(b));
  return nearest && off(nearest) <= near ? nearest.at : at;
}

/** The role of this page, in two words. */
export const role = ({ up, drives, draws }) => (!up ? "Not connected" : drives ? "You drive" : draws ? "You draw" : "You watch");

/** What to mark in a drawing that was sent, by what the navigator needs. */
const MARKS = {
  anywhere: "Draw the path from where the robot stands, or tap goals and mark the start. Without a mark, the robot has to find out where it is.",
  start: "Draw the path from where the robot stands, or mark the start and tap goals.",
  path: "Draw the path from where the robot stands.",
};

/** What to do next, in one or two sentences. */
export function advice({ up, refusal, drives, watches, draws, practising, questions, feed, map, path, placing, lacks, learned, together }) {
  if (!up && refusal) return `The robot refuses this page: ${refusal}.`;
  if (!up) return "The page will reconnect by itself. The drawing is kept.";
  if (!feed || !feed.ready) return "The navigation is getting ready.";
  if (feed.question) return drives ? feed.question.text : `${feed.question.text} The page that drives answers.`;
  if (practising) return "Try the tools for as long as you like. Nothing counts until you start.";
  if (questions) return "When the drive is over, go to the questions.";
  if (watches && !feed.asks) return ["The tasks come from a mission file.", ...(feed.resolved ?? []).map((goal) => `${goal}.`)].join(" ");
  if (!drives && feed.wheel) return "No page drives. Take the wheel to drive from this one.";
  if (!drives && feed.asks) return "The page that drives has been asked for the wheel.";
  if (!drives && together) return "You draw with the others. Another page drives.";
  if (!drives) return draws ? "Another page drives." : "Another page drives; this one watches.";
  if (lacks && feed.allowed.includes("path")) return lacks;
  const words = {
    "no-sketch": map ? "Send the map." : "Draw the walls of the place, then send the map.",
    sketch: path ? "Send the path." : learned?.accepted ? "Tap goals. The robot finds out where it is." : MARKS[placing] ?? MARKS.start,
    path: "Press Execute, and the robot drives.",
    driving: "Abort stops the robot at once.",
    aborted: "Restore continues the task. Or draw another path.",
    paused: "Restore continues the task.",
    ended: "Draw and send another path, or start again.",
  };
  return words[feed.state] ?? "";
}

/** What became of this page's request for the wheel between two feeds, in words; `null` if nothing did. */
export function wheelNews(before, feed) {
  if (!before?.asks || !feed || feed.asks) return null;
  return feed.drives ? "You drive." : "The page that drives keeps the wheel.";
}

/** A task in words; `null` if there is none. */
export function taskWords(task) {
  if (!task) return null;
  if (task.state === "finished") return `${task.reached} of ${task.count} ${task.count === 1 ? "task" : "tasks"} reached`;
  const name = task.name ? ` “${task.name}”` : "";
  const parts = [`Task ${task.index + 1} of ${task.count}${name}: ${task.state}`];
  // While the robot drives or waits, the reason is in the advice and the warnings.
  if (task.reason && !["driving", "paused", "waiting"].includes(task.state)) parts.push(task.reason);
  return parts.join(", ");
}

/** Metres and seconds as texts. */
export const metres = (m) => (Number.isFinite(m) ? `${m.toFixed(m < 10 ? 1 : 0)} m` : "–");
export const seconds = (s) => (Number.isFinite(s) ? `${Math.floor(s / 60)}:${String(Math.floor(s % 60)).padStart(2, "0")}` : "–");
export const speed = (v) => (Number.isFinite(v) ? `${v.toFixed(2)} m/s` : "–");

/** The limit of the server that a drawing exceeds, in words; `null` if it exceeds none. */
export function tooMuch(limits, { strokes, points, bytes, route, goals }) {
  const over = [
    [strokes, limits?.strokes, "strokes"], [points, limits?.points, "points in the strokes"],
    [bytes, limits?.bytes, "bytes"], [route, limits?.path_points, "points in the path"], [goals, limits?.goals, "goals"],
  ].find(([found, most]) => found !== undefined && most !== undefined && found > most);
  return over ? `Too large: at most ${over[1]} ${over[2]}, found ${over[0]}.` : null;
}
