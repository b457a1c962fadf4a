// Draws the newest messages in frame `sketch` like a 3D panel: an SVG made only from standard messages.

const yaw = ({ z, w }) => 2 * Math.atan2(z, w);

function runs(grid) {
  const { width, height } = grid.info;
  const rects = [];
  for (let row = 0; row < height; row++) {
    for (let column = 0; column < width; ) {
      const is = (at) => grid.data[row * width + at] > 50;
      let stop = column + 1;
      if (is(column)) {
        while (stop < width && is(stop)) stop++;
        rects.push(`<rect x="${column}" y="${height - 1 - row}" width="${stop - column}" height="1"/>`);
      }
      column = stop;
    }
  }
  return rects.join("");
}

export function picture(newest) {
  const grid = newest["/sketch/grid"];
  if (!grid) return "<svg xmlns='http://www.w3.org/2000/svg'/>";
  const { width, height } = grid.info;
  const y = (up) => height - up;
  const line = (path, color, thickness) => {
    const points = (path?.poses ?? []).map(({ pose }) => `${pose.position.x},${y(pose.position.y)}`);
    return `<polyline points="${points.join(" ")}" fill="none" stroke="${color}" stroke-width="${thickness}"/>`;
  };
  const arrow = ({ position, orientation }, length, color, thickness) => {
    const angle = yaw(orientation);
    const [x, up] = [position.x + length * Math.cos(angle), position.y + length * Math.sin(angle)];
    return `<line x1="${position.x}" y1="${y(position.y)}" x2="${x}" y2="${y(up)}" stroke="${color}" stroke-width="${thickness}"/>`;
  };
  const shape = ({ type, pose, scale, color, text }) => {
    const { x } = pose.position;
    const fill = `rgb(${[color.r, color.g, color.b].map((share) => Math.round(255 * share)).join(" ")})`;
    if (type === 3) return `<circle cx="${x}" cy="${y(pose.position.y)}" r="${scale.x / 2}" fill="${fill}"/>`;
    if (type !== 9) return "";
    return `<text x="${x}" y="${y(pose.position.y)}" font-size="${scale.z}" text-anchor="middle" font-family="sans-serif">${text.replace(/[<&]/g, "")}</text>`;
  };
  const particles = (newest["/particles/poses"]?.poses ?? []).map((pose) => arrow(pose, 8, "#2563eb", 0.8));
  const estimate = newest["/estimate/pose"]?.pose;
  return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${width} ${height}" width="${width}" height="${height}">
<rect width="100%" height="100%" fill="#ffffff"/>
<g fill="#1f2937">${runs(grid)}</g>
${(newest["/route/markers"]?.markers ?? []).map(shape).join("")}
${line(newest["/plan/global"], "#059669", 2.5)}${line(newest["/plan/local"], "#dc2626", 2.5)}
<g opacity="0.6">${particles.join("")}</g>
${estimate ? arrow(estimate, 22, "#111827", 5) : ""}
</svg>
`;
}
