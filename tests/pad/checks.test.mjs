// The checks of a drawing before a robot drives by it: rooms and their names, walls in the way, unreachable places, places that
// look alike.

import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { test } from "node:test";

import { doubts, roomNameAt, withRoomNames } from "../../services/pad/page/checks.js";
import { cellOf, gridOf, reachable, roomsOf, sees } from "../../services/pad/page/grid.js";
import { LANDSCAPE, blank, fromText, isEditOf, withDoor, withGoal, withObstacle, withRoute, withStart, withStroke, withText } from "../../services/pad/page/model.js";

const wall = (drawing, ...points) => withStroke(drawing, points, 5);
const words = (drawing, from) => doubts(drawing, from).map(({ word }) => word);

/** A hall below two closed rooms of the same shape. */
let floor = wall(blank(LANDSCAPE), [200, 200], [1800, 200], [1800, 1000], [200, 1000], [200, 200]);
floor = wall(wall(floor, [200, 600], [1800, 600]), [1000, 200], [1000, 600]);
floor = withStart(withText(floor, "kitchen", [400, 300]), [400, 800], 0);
const open = withDoor(withDoor(floor, [550, 600], [650, 600], 8), [1350, 600], [1450, 600], 8);

test("rooms are closed but for doors, and what is outside is none", () => {
  for (const drawing of [floor, open]) {
    const grid = gridOf(drawing);
    const rooms = roomsOf(grid);
    const [kitchen, other, hall, outside] = [[600, 400], [1400, 400], [1000, 800], [100, 100]].map((p) => rooms[cellOf(grid, p)]);
    assert.equal(new Set([kitchen, other, hall]).size, 3);
    assert.ok(kitchen && other && hall && !outside);
    assert.equal(roomNameAt(drawing, [900, 500]), "kitchen");
    assert.equal(roomNameAt(drawing, [1400, 400]), null);
  }
  const twice = withText(open, "bath", [500, 500]);
  assert.equal(roomNameAt(twice, [900, 500]), null, "two texts are no name of the room");
});

test("small gaps of lines by hand are closed, doors are open", () => {
  const gap = wall(wall(blank(LANDSCAPE), [100, 600], [1000, 600]), [1006, 604], [2000, 600]);
  const grid = gridOf(wall(gap, [2000, 600], [2000, 1000], [100, 1000], [100, 600]));
  assert.equal(reachable(grid, cellOf(grid, [500, 800]))[cellOf(grid, [500, 100])], 0);
  const opened = gridOf(open);
  assert.equal(reachable(opened, cellOf(opened, [400, 800]))[cellOf(opened, [600, 400])], 1);
  assert.ok(sees(opened, [600, 900], [600, 300]) && !sees(opened, [400, 900], [400, 300]));
});

test("a goal without a way to it, in a wall, in an obstacle", () => {
  const goal = withGoal(floor, [600, 400]);
  assert.deepEqual(words(goal), ["no way"]);
  assert.deepEqual(words(withDoor(goal, [550, 600], [650, 600], 8)), []);
  assert.deepEqual(words(withGoal(open, [800, 600])), ["in a wall"]);
  const box = withObstacle(open, [[500, 300], [700, 300], [700, 500], [500, 500]]);
  assert.deepEqual(words(withGoal(box, [600, 400])), ["in a wall"]);
  assert.deepEqual(words(withStart(withGoal(open, [600, 400]), [200, 600], 0)), ["in a wall"]);
  assert.deepEqual(words({ ...goal, start: null }), [], "it is not known where the robot is");
  assert.deepEqual(words({ ...goal, start: null }, [1400, 800]), ["no way"], "it is");
  assert.match(doubts(goal)[0].why, /^Goal 1 cannot be reached/);
});

test("a route through a wall, once for each wall, and a room that is closed", () => {
  const route = withRoute(floor, [[400, 800], [600, 800], [600, 400]]);
  assert.deepEqual(doubts(route).map(({ at, word }) => [word, ...at.map(Math.round)]), [["through a wall", 600, 600], ["closed", 400, 300]]);
  assert.deepEqual(words(withRoute(open, [[400, 800], [600, 700], [600, 400]])), []);
  assert.deepEqual(words(withRoute(open, [[400, 800], [600, 700], [600, 400], [1400, 400]])), ["through a wall"]);
  assert.deepEqual(words({ ...route, photo: "data:" }), [], "nobody knows the walls of a photo");
});

test("places that look alike", () => {
  const goals = withGoal(withGoal(open, [600, 400]), [1400, 400]);
  assert.deepEqual(words(goals), ["like 2", "like 1"]);
  const table = withObstacle(goals, [[1500, 250], [1700, 250], [1700, 450], [1500, 450]]);
  assert.deepEqual(words(table), []);
  assert.deepEqual(words(withGoal(withGoal(open, [600, 400]), [620, 400])), [], "two goals in one room");
  assert.deepEqual(words(open), [], "no path, no doubts");
});

test("an edit leaves half of the map as it was", () => {
  const one = { ...open, id: "a" };
  assert.ok(isEditOf(one, { ...wall(one, [300, 300], [400, 300]), start: null }));
  assert.ok(isEditOf(one, { ...one, strokes: one.strokes.slice(1) }));
  assert.ok(!isEditOf(one, { ...one, strokes: one.strokes.slice(-1) }), "most of it is gone");
  assert.ok(!isEditOf(one, { ...one, id: "b" }), "another drawing");
  assert.ok(!isEditOf(one, { ...one, photo: "data:" }));
});

test("goals have the names of their rooms, each name once", () => {
  const names = (drawing) => withRoomNames(drawing).goals.map(({ name }) => name);
  const one = withGoal(withGoal(open, [600, 400]), [1400, 400]);
  assert.deepEqual(names(one), ["kitchen", undefined]);
  assert.deepEqual(names(withGoal(one, [700, 400])), [undefined, undefined, undefined]);
  assert.deepEqual(names({ ...one, goals: [{ name: "sink", at: [600, 400] }] }), ["sink"]);
});

test("drawings by people with their routes cause no doubts", () => {
  const folder = new URL("../../sim/missions/routes/", import.meta.url);
  const files = readdirSync(folder).filter((name) => name.endsWith(".json"));
  assert.ok(files.length >= 20);
  for (const name of files) {
    const route = /^route = (\[\[.*?\]\])/ms.exec(readFileSync(new URL(name.replace(".json", ".toml"), folder), "utf8"));
    const drawing = withRoute(fromText(readFileSync(new URL(name, folder), "utf8")), JSON.parse(route[1].replace(/,\s*\]/g, "]")));
    assert.deepEqual(doubts(drawing), [], name);
  }
});
