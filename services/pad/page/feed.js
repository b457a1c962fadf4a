// The robot's data, drawn over the sheet: its estimated pose and uncertainty, its particles, its trail, and the shapes of its
// navigator. Drawn once per message, never in between.

/** Maximum length of the trail, and minimum distance between its points, canvas pixels. */
const MAX_TRAIL = 4000;
const TRAIL_STEP_PX = 3;

/** A trail with one more point; a trail that is too long loses every second point. */
export function trailed(trail, at) {
  if (!at) return trail;
  const last = trail.at(-1);
  if (last && Math.hypot(at[0] - last[0], at[1] - last[1]) < TRAIL_STEP_PX) return trail;
  const longer = [...trail, at];
  return longer.length > MAX_TRAIL ? longer.filter((_, i) => i % 2 === 0 || i === longer.length - 1) : longer;
}

/**
 * Particles moved along with the robot: they arrive once a second, `cloud` has the last ones with the pose at that time, and until
 * the next ones they move with the robot.
 */
export function carried(cloud, pose) {
  if (!cloud || !pose) return null;
  // A heading is counter-clockwise, and y points down.
  const turn = cloud.pose.heading_rad - pose.heading_rad;
  const [cos, sin] = [Math.cos(turn), Math.sin(turn)];
  return cloud.points.map(([x, y]) => {
    const [dx, dy] = [x - cloud.pose.x, y - cloud.pose.y];
    return [pose.x + cos * dx - sin * dy, pose.y + sin * dx + cos * dy];
  });
}

/** The setting that shows shapes of a colour; other colours are always shown. */
const PARTS = { scan: "scan", plan: "plan", seen: "plan", hidden: "plan" };
/** Widths of lines and sides of dots, screen pixels. */
const LINE_PX = { plain: 2.5, dashed: 2, bold: 4 };
const DOT_PX = { seen: 5, hidden: 5 };

/**
 * Draws a feed with the trail and the last particles. `shows` selects the parts; `lasting` are the shapes that stay until the next
 * ones; `walls` is the picture of the walls as the robot understood them, and `learned` that of what it saw, or `null`.
 */
export function drawFeed(sheet, { feed, trail, cloud, lasting, walls, learned }, shows, canvas) {
  const context = sheet.wipe("feed");
  // Half transparent, so that the drawing stays visible.
  context.globalAlpha = 0.7;
  if (walls && shows.walls) context.drawImage(tinted(walls, sheet.colors.walls), 0, 0, ...canvas);
  if (learned && shows.learned) context.drawImage(tinted(learned, sheet.colors.learned), 0, 0, ...canvas);
  context.globalAlpha = 1;
  if (!feed) return;
  context.lineCap = context.lineJoin = "round";
  if (shows.trail) line(context, trail, sheet.colors.trail, sheet.px(2.5));
  const shapes = [...(lasting ?? []), ...feed.scene];
  for (const shape of shapes.filter(({ color }) => shows[PARTS[color]] ?? true)) drawShape(context, sheet, shape);
  if (feed.pose) drawRobot(context, sheet, feed.pose);
  const particles = shows.particles && carried(cloud, feed.pose);
  if (particles) dots(context, particles, sheet.colors.particle, sheet.px(2.5));
  for (const place of feed.question?.places ?? []) drawPossible(context, sheet, place);
}

/** A place where the robot may be, with its letter. */
function drawPossible(context, sheet, { name, at }) {
  context.beginPath();
  context.arc(...at, sheet.px(17), 0, 2 * Math.PI);
  context.fillStyle = sheet.colors.paper;
  context.fill();
  context.strokeStyle = sheet.colors.robot;
  context.lineWidth = sheet.px(4);
  context.stroke();
  write(context, name, at, sheet.colors.robot, sheet.px(20));
}

/** A shape of a navigator. */
function drawShape(context, sheet, { shape, points, at, text, color, stroke }) {
  const paint = sheet.colors[color];
  const dash = stroke === "dashed" ? [sheet.px(7), sheet.px(6)] : [];
  if (shape === "line") line(context, points, paint, sheet.px(LINE_PX[stroke]), dash);
  else if (shape === "dots") dots(context, points, paint, sheet.px(DOT_PX[color] ?? 3));
  else if (shape === "area") area(context, points, paint);
  else if (shape === "rings") circles(context, points, paint, sheet.px(6), sheet.px(2));
  else if (shape === "discs") circles(context, points, paint, sheet.px(8));
  else if (shape === "text") write(context, text, at, paint, sheet.px(14));
}

function area(context, points, color) {
  context.beginPath();
  for (const [x, y] of points) context.lineTo(x, y);
  context.closePath();
  context.globalAlpha = 0.25;
  context.fillStyle = color;
  context.fill();
  context.globalAlpha = 1;
}

function write(context, text, [x, y], color, size) {
  context.font = `600 ${size}px system-ui, sans-serif`;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = color;
  context.fillText(text, x, y);
}

const tints = new WeakMap();

/** A picture of black on transparent in another colour, cached. */
function tinted(picture, color) {
  const known = tints.get(picture);
  if (known?.color === color) return known.canvas;
  const canvas = new OffscreenCanvas(picture.width, picture.height);
  const context = canvas.getContext("2d");
  context.drawImage(picture, 0, 0);
  context.globalCompositeOperation = "source-in";
  context.fillStyle = color;
  context.fillRect(0, 0, picture.width, picture.height);
  tints.set(picture, { color, canvas });
  return canvas;
}

function line(context, points, color, width, dash = []) {
  if (!points || points.length < 2) return;
  context.beginPath();
  points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
  context.strokeStyle = color;
  context.lineWidth = width;
  context.setLineDash(dash);
  context.stroke();
  context.setLineDash([]);
}

/** Circles: filled if they have no width. */
function circles(context, points, color, radius, width = 0) {
  context.strokeStyle = context.fillStyle = color;
  context.lineWidth = width;
  for (const [x, y] of points) {
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    if (width) context.stroke();
    else context.fill();
  }
}

/** Small squares in one path: cheaper than as many discs, and indistinguishable at this size. */
function dots(context, points, color, size) {
  context.beginPath();
  for (const [x, y] of points) context.rect(x - size / 2, y - size / 2, size, size);
  context.fillStyle = color;
  context.fill();
}

/** The page's y axis points down, so headings are mirrored: the direction is (cos h, −sin h). */
function drawRobot(context, sheet, { x, y, heading_rad, ellipse, radius_px }) {
  const color = sheet.colors.robot;
  context.strokeStyle = context.fillStyle = color;
  if (ellipse) {
    context.beginPath();
    context.ellipse(x, y, Math.max(ellipse[0], 0.1), Math.max(ellipse[1], 0.1), -ellipse[2], 0, 2 * Math.PI);
    context.globalAlpha = 0.18;
    context.fill();
    context.globalAlpha = 0.9;
    context.lineWidth = sheet.px(1.5);
    context.stroke();
    context.globalAlpha = 1;
  }
  // Never too small to find on a phone.
  const radius = Math.max(radius_px || 0, sheet.px(8));
  const towards = (turn, far) => [x + far * radius * Math.cos(heading_rad + turn), y - far * radius * Math.sin(heading_rad + turn)];
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.globalAlpha = 0.3;
  context.fill();
  context.globalAlpha = 1;
  context.lineWidth = sheet.px(2.5);
  context.stroke();
  context.beginPath();
  context.moveTo(...towards(0, 0.85));
  context.lineTo(...towards(2.5, 0.7));
  context.lineTo(...towards(Math.PI, 0.25));
  context.lineTo(...towards(-2.5, 0.7));
  context.closePath();
  context.fill();
}
