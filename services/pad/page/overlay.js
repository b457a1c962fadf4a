// What is drawn over everything else on the sheet: the frame of the selection, its handles and points, the marquee, and the
// snapping guides.

/** Sizes, screen pixels. */
const [HANDLE_PX, POINT_PX, BETWEEN_PX, RING_PX, CROSS_PX] = [10, 5, 3.5, 18, 6];

/** Draws an overlay returned by `Select.overlay`. */
export function drawOverlay(sheet, { lines = [], marks = [], frame, handles = {}, points, marquee, guides = [] }) {
  const context = sheet.wipe("live");
  const px = (n) => sheet.px(n);
  context.lineJoin = context.lineCap = "round";
  context.strokeStyle = context.fillStyle = sheet.colors.select;
  context.lineWidth = px(1.5);
  for (const { points: line, closed } of lines) trace(context, line, closed);
  for (const at of marks) ring(context, at, px(RING_PX));
  if (marquee) drawMarquee(context, marquee);
  if (frame) {
    context.setLineDash([px(5), px(4)]);
    trace(context, frame, true);
    context.setLineDash([]);
  }
  for (const [name, at] of Object.entries(handles)) drawHandle(context, sheet, name, at);
  if (points) drawPoints(context, sheet, points);
  for (const guide of guides) drawGuide(context, sheet, guide);
}

function trace(context, points, closed) {
  context.beginPath();
  points.forEach(([x, y]) => context.lineTo(x, y));
  if (closed) context.closePath();
  context.stroke();
}

function ring(context, [x, y], radius) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.stroke();
}

function disc(context, [x, y], radius, fill) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fillStyle = fill;
  context.fill();
  context.stroke();
}

function drawMarquee(context, [left, top, right, bottom]) {
  context.globalAlpha = 0.12;
  context.fillRect(left, top, right - left, bottom - top);
  context.globalAlpha = 1;
  context.strokeRect(left, top, right - left, bottom - top);
}

/** A square for scaling, or a disc for turning. */
function drawHandle(context, sheet, name, [x, y]) {
  const side = sheet.px(HANDLE_PX);
  if (name === "turn") {
    disc(context, [x, y], side / 2, sheet.colors.paper);
    return;
  }
  context.fillStyle = sheet.colors.paper;
  context.fillRect(x - side / 2, y - side / 2, side, side);
  context.strokeRect(x - side / 2, y - side / 2, side, side);
}

function drawPoints(context, sheet, { all, chosen, between }) {
  for (const at of between) disc(context, at, sheet.px(BETWEEN_PX), sheet.colors.select);
  for (const at of all) disc(context, at, sheet.px(POINT_PX), at === chosen ? sheet.colors.select : sheet.colors.paper);
  if (chosen) ring(context, chosen, sheet.px(POINT_PX + 4));
}

/** A cross at a snapping target, or a dashed line along one. */
function drawGuide(context, sheet, { point, line }) {
  const arm = sheet.px(CROSS_PX);
  context.strokeStyle = sheet.colors.guide;
  if (line) {
    context.setLineDash([sheet.px(3), sheet.px(4)]);
    trace(context, line, false);
    context.setLineDash([]);
  } else {
    trace(context, [[point[0] - arm, point[1] - arm], [point[0] + arm, point[1] + arm]], false);
    trace(context, [[point[0] - arm, point[1] + arm], [point[0] + arm, point[1] - arm]], false);
  }
}
