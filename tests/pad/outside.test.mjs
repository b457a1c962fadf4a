// Drawings of other programs: the conversion of their lines, shapes and texts, and the errors for bad files.

import assert from "node:assert/strict";
import { test } from "node:test";

import { fromExcalidraw, isExcalidraw } from "../../services/pad/page/excalidraw.js";
import { LANDSCAPE, blank, fromText, toText, withObstacle, withRoute, withStroke, withText } from "../../services/pad/page/model.js";
import { outlines } from "../../services/pad/page/outline.js";
import { counted, placed } from "../../services/pad/page/placing.js";
import { toSvg } from "../../services/pad/page/svg.js";
import { transformOf } from "../../services/pad/page/svgfile.js";

const near = (a, b, off = 0.01) => assert.ok(a.length === b.length && a.every((v, i) => Math.abs(v - b[i]) <= off), `${a}, expected ${b}`);

test("the outline of a path: lines, relative and absolute, closed, several", () => {
  assert.deepEqual(outlines("M0 0 10 0v5H0z"), [{ points: [[0, 0], [10, 0], [10, 5], [0, 5]], closed: true }]);
  assert.deepEqual(outlines("m1,1l2-3m5 5 1.5.5").map(({ points }) => points), [[[1, 1], [3, -2]], [[8, 3], [9.5, 3.5]]]);
  assert.deepEqual(outlines("M0 0L1 1zL5 0")[1].points, [[0, 0], [5, 0]], "after closing, the pen is where the line began");
  assert.deepEqual(outlines(""), []);
  assert.deepEqual(outlines("L5 5"), [], "data begins with a move");
  assert.equal(outlines("M0 0L5 5L6 x9 9L1 1")[0].points.length, 2, "what comes after an error is left out");
});

test("curves of a path keep their ends and their middle", () => {
  const [{ points: curve }] = outlines("M0 0C0 10 10 10 10 0S20-10 20 0");
  near(curve.at(-1), [20, 0]);
  near(curve[8], [5, 7.5]);
  near(curve[24], [15, -7.5]);
  const [{ points: parabola }] = outlines("M0 0Q5 10 10 0T20 0");
  near(parabola[8], [5, 5]);
  near(parabola[24], [15, -5]);
  // Half a circle, with flags that are not followed by a space.
  const [{ points: half }] = outlines("M0 0a5 5 0 0110 0");
  assert.ok(half.every((p) => Math.abs(Math.hypot(p[0] - 5, p[1]) - 5) < 1e-9));
  near(half[8], [5, -5]);
  const [{ points: small }] = outlines("M0 0A1 1 0 0 0 10 0");
  near(small[8], [5, 5], 1e-6);
});

test("transforms of SVG are joined from the left", () => {
  near(transformOf("translate(10,20) scale(2)"), [2, 0, 0, 2, 10, 20]);
  near(transformOf("rotate(90 10 10)"), [0, 1, -1, 0, 20, 0]);
  near(transformOf(null), [1, 0, 0, 1, 0, 0]);
  near(transformOf("skewX(45) nonsense(3) scale(x)"), [1, 0, 1, 1, 0, 0]);
});

const element = (type, more) => ({ id: type, type, x: 0, y: 0, width: 100, height: 50, angle: 0, strokeWidth: 2, isDeleted: false, groupIds: [], ...more });

test("lines of Excalidraw are walls, what is filled is an obstacle, an arrow the path, texts names", () => {
  const { drawing, left } = fromExcalidraw({ type: "excalidraw", elements: [
    element("rectangle", { width: 400, height: 200, backgroundColor: "transparent" }),
    element("text", { id: "t", x: 100, y: 80, width: 40, height: 20, text: "living\nroom" }),
    element("ellipse", { id: "e", x: 300, y: 20, width: 60, height: 60, backgroundColor: "#ffc9c9", groupIds: ["inner", "outer"] }),
    element("text", { id: "u", containerId: "e", text: "table" }),
    element("freedraw", { x: 10, y: 10, points: [[0, 0], [10, 5]], pressures: [0.2, 0.7], simulatePressure: false, groupIds: ["outer"] }),
    element("arrow", { x: 20, y: 100, points: [[0, 0], [100, 0], [200, 40]] }),
    element("arrow", { points: [[0, 0], [1, 1]] }),
    element("line", { points: [[0, 0], [1, 1]], isDeleted: true, x: "?" }),
    element("image", { fileId: "f" }), element("image", { fileId: "g" }),
  ] });
  assert.deepEqual(drawing.canvas, [2540, 1370]);
  assert.equal(drawing.strokes.length, 2);
  near(drawing.strokes[0].points.flat(), [100, 100, 2440, 100, 2440, 1270, 100, 1270, 100, 100]);
  assert.deepEqual(drawing.strokes[1].pressure, [0.2, 0.7]);
  assert.equal(drawing.strokes[1].group, drawing.obstacles[0].group);
  assert.equal(drawing.obstacles[0].label, "table");
  assert.deepEqual(drawing.labels, [{ text: "living room", at: [802, 626.5] }]);
  assert.equal(drawing.route.length, 3);
  assert.equal(counted(left), "arrow, 2 × picture");
  assert.equal(toText(fromText(toText(drawing))), toText(drawing), "it is a drawing like any other");
});

test("a turned shape of Excalidraw is turned about its middle", () => {
  const wall = element("line", { x: 0, y: 0, width: 100, height: 0, points: [[0, 0], [100, 0]], angle: Math.PI / 2 });
  const { drawing } = fromExcalidraw({ type: "excalidraw", elements: [wall] });
  const [[ax, ay], [bx, by]] = drawing.strokes[0].points;
  assert.ok(Math.abs(ax - bx) < 0.02 && by - ay > 2000, `${drawing.strokes[0].points}`);
});

test("a text of Excalidraw that is too long is cut, with a remark", () => {
  const text = element("text", { x: 0, y: 0, width: 100, height: 20, text: "ab ".repeat(200) });
  const { drawing, left } = fromExcalidraw({ type: "excalidraw", elements: [text] });
  assert.deepEqual([drawing.labels[0].text.length, left], [400, ["end of a long text"]]);
  assert.equal(toText(fromText(toText(drawing))), toText(drawing));
});

test("what is wrong with a file of Excalidraw is said with its place", () => {
  const wrong = (elements, words) => assert.throws(() => fromExcalidraw({ type: "excalidraw", elements }), words);
  wrong({}, /elements: expected a list/);
  wrong([null], /elements\[0\]: expected an element/);
  wrong([element("line", { points: [[0, 0], [1]] })], /elements\[0\]\.points: expected points, found \[1\]/);
  wrong([element("rectangle", { x: 1e99 })], /elements\[0\]\.x: expected a number/);
  wrong([element("image")], /expected walls/);
  assert.ok(isExcalidraw({ type: "excalidraw/clipboard" }) && !isExcalidraw({ type: "excalidrawlib" }) && !isExcalidraw(null));
});

test("an SVG says what words are, whatever is in them", () => {
  let drawing = withStroke(blank(LANDSCAPE), [[0, 0], [5, 5]], 5);
  drawing = withText(withObstacle(drawing, [[0, 0], [9, 0], [9, 9]], 'a "<b>" & c'), "</text><script>alert(1)</script>", [5, 5]);
  const svg = toSvg(withRoute(drawing, [[0, 0], [9, 9]]), { shown: true, own: true });
  assert.ok(!svg.includes("<script") && svg.includes("&lt;script&gt;") && svg.includes("<title>a &quot;&lt;b&gt;&quot; &amp; c</title>"));
});

test("a page of its own places what is on it", () => {
  const read = { strokes: [{ points: [[1, 1], [2, 1]], width_px: 0.1 }], obstacles: [], labels: [], route: null };
  const drawing = placed(read, [0, 0, 4, 2]);
  assert.deepEqual([drawing.canvas, drawing.strokes[0].points, drawing.strokes[0].width_px], [[2540, 1270], [[635, 635], [1270, 635]], 63.5]);
});
