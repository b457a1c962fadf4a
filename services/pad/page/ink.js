// A stroke as lines of ink: more pressure gives a wider line. The robot is sent the centre line and one width per stroke, so
// pressure is only visual.

/** Number of widths in a stroke: adjacent segments of equal width are drawn as one line. */
const WIDTHS = 8;
const runs = new WeakMap();

/** Width at a pressure of 0 to 1; at half pressure, or without a pressure, it is the pen's own width. */
export function widthAt(width_px, pressure) {
  return pressure === null || pressure === undefined ? width_px : width_px * (0.5 + pressure);
}

/** The width of the segment before point `i`, in steps. */
function segmentWidth(stroke, i) {
  if (!stroke.pressure) return stroke.width_px;
  const pressure = (stroke.pressure[i - 1] + stroke.pressure[i]) / 2;
  return widthAt(stroke.width_px, Math.round(pressure * WIDTHS) / WIDTHS);
}

/** The lines of a stroke: `{ width, path }`, cached. */
export function inkRuns(stroke) {
  if (!runs.has(stroke)) runs.set(stroke, makeRuns(stroke));
  return runs.get(stroke);
}

function makeRuns(stroke) {
  const { points } = stroke;
  if (points.length === 1) return [dot(points[0], widthAt(stroke.width_px, stroke.pressure?.[0]))];
  const lines = [];
  let line = null;
  for (let i = 1; i < points.length; i += 1) {
    const width = segmentWidth(stroke, i);
    if (!line || line.width !== width) {
      line = { width, path: new Path2D() };
      line.path.moveTo(...points[i - 1]);
      lines.push(line);
    }
    line.path.lineTo(...points[i]);
  }
  return lines;
}

/** A tap of the pen: a line of length zero has no caps, so it gets a tiny length. */
function dot([x, y], width) {
  const path = new Path2D();
  path.moveTo(x, y);
  path.lineTo(x + 0.1, y);
  return { width, path };
}
