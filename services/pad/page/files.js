// Drawings and pictures from and to the device.

import { toSvg } from "./svg.js";

/** Longest side of an imported picture, pixels: that of the sheet. */
const LONGEST_PX = 2540;

/** Downloads a text, or the bytes of a blob, as a file. */
export function save(name, content, type = "application/json") {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([content], { type }));
  link.download = name;
  link.click();
  // Once the click is handled, the download has its own reference to the data.
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

/** Opens the file dialog; `null` if it was cancelled. */
export function choose(accept) {
  const input = document.createElement("input");
  Object.assign(input, { type: "file", accept });
  return new Promise((resolve) => {
    input.addEventListener("change", () => resolve(input.files[0] ?? null));
    input.addEventListener("cancel", () => resolve(null));
    input.click();
  });
}

/** A file's name without its extension. */
export const nameOf = (file) => file.name.replace(/\.[^.]*$/, "").slice(0, 60);

/**
 * A photo for the sheet: upright, no larger than the sheet, as a data URL with its size. It is encoded again, so the camera's
 * metadata (place, time) is removed.
 */
export async function photo(file) {
  const image = await createImageBitmap(file, { imageOrientation: "from-image" }).catch(() => {
    throw new Error(`${file.name}: expected a picture (PNG, JPEG), found something else.`);
  });
  const scale = Math.min(1, LONGEST_PX / Math.max(image.width, image.height));
  const size = [image.width, image.height].map((side) => Math.max(1, Math.round(side * scale)));
  const canvas = picture(size);
  canvas.getContext("2d").drawImage(image, 0, 0, ...size);
  return { size, url: canvas.toDataURL("image/jpeg", 0.9) };
}

/** A file as a data URL. */
export function dataUrl(blob) {
  return new Promise((resolve, reject) => {
    const reader = new FileReader();
    reader.addEventListener("load", () => resolve(reader.result));
    reader.addEventListener("error", () => reject(reader.error));
    reader.readAsDataURL(blob);
  });
}

/** A white canvas of this size, pixels. */
function picture([width, height]) {
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  const context = canvas.getContext("2d");
  context.fillStyle = "#fff";
  context.fillRect(0, 0, width, height);
  return canvas;
}

/** Longest side of a thumbnail, and of a picture for a file, pixels. */
const [SMALL_PX, LARGE_PX] = [320, 8192];

/** A thumbnail of a drawing, with thin lines made wide enough to be seen: a data URL. */
export async function small(drawing) {
  const scale = SMALL_PX / Math.max(...drawing.canvas);
  return (await painted(drawing, scale, 1.5 / scale)).toDataURL("image/png");
}

/** A drawing with path, goals and start, as a PNG. */
export async function png(drawing) {
  const canvas = await painted(drawing, Math.min(1, LARGE_PX / Math.max(...drawing.canvas)), 0);
  return new Promise((resolve) => { canvas.toBlob(resolve, "image/png"); });
}

async function painted(drawing, scale, least) {
  const url = URL.createObjectURL(new Blob([toSvg(drawing, { shown: true, least })], { type: "image/svg+xml" }));
  try {
    const image = await decoded(url);
    const canvas = picture(drawing.canvas.map((side) => Math.max(1, Math.round(side * scale))));
    canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
    return canvas;
  } finally {
    URL.revokeObjectURL(url);
  }
}

async function decoded(url) {
  const image = new Image();
  image.src = url;
  await image.decode();
  return image;
}

/** The map as one picture for the robot, a photo with what was drawn on it: black ink, JPEG. */
export async function flattened(drawing) {
  const canvas = picture(drawing.canvas);
  const context = canvas.getContext("2d");
  context.drawImage(await decoded(drawing.photo), 0, 0, ...drawing.canvas);
  context.lineCap = context.lineJoin = "round";
  for (const { points, width_px } of drawing.strokes) {
    context.lineWidth = width_px;
    context.stroke(outline(points.length === 1 ? [points[0], [points[0][0] + 0.1, points[0][1]]] : points));
  }
  for (const { polygon } of drawing.obstacles) context.fill(outline(polygon), "evenodd");
  return new Promise((resolve) => { canvas.toBlob(resolve, "image/jpeg", 0.92); });
}

function outline(points) {
  const path = new Path2D();
  points.forEach(([x, y], i) => (i ? path.lineTo(x, y) : path.moveTo(x, y)));
  return path;
}
