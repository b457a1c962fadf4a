// The costs of the page, measured in the browser of the test. Only the amount of work is asserted, since the machine's load does
// not affect it. Times are reported without a limit.

import assert from "node:assert/strict";
import { gzipSync } from "node:zlib";

/** Runs in the page before its own scripts: counts what is drawn on each canvas, and slow inputs. */
export function inkWork() {
  const counts = {};
  const prototype = CanvasRenderingContext2D.prototype;
  for (const name of ["stroke", "fill", "fillRect", "clearRect", "drawImage"]) {
    const drawn = prototype[name];
    prototype[name] = function counted(...parameters) {
      const layer = this.canvas.className || "other";
      counts[`${layer}.${name}`] = (counts[`${layer}.${name}`] ?? 0) + 1;
      return drawn.apply(this, parameters);
    };
  }
  const slow = [];
  new PerformanceObserver((list) => {
    const pens = list.getEntries().filter((entry) => entry.name === "pointerdown" && entry.target?.id === "sheet");
    slow.push(...pens.map((entry) => entry.duration));
  }).observe({ type: "event", durationThreshold: 16 });
  // Only the test reads this; the page does not use it.
  window.inkCounts = { counts, slow };
}

const counts = (page) => page.evaluate(() => ({ ...window.inkCounts.counts }));

/** A sheet with 500 strokes of twenty points each. */
function crowded([width, height]) {
  const strokes = Array.from({ length: 500 }, (_, i) => {
    const [x, y] = [((i % 25) + 0.2) * (width / 25), (Math.floor(i / 25) + 0.2) * (height / 20)];
    return { points: Array.from({ length: 20 }, (__, k) => [x + k * 2, y + ((k * 7 + i) % 11)]), width_px: 5 };
  });
  return JSON.stringify({ canvas: [width, height], strokes });
}

/** With 500 strokes on the sheet, a movement of the pen draws only its own segments. */
export async function manyStrokes({ page, hand }, canvas) {
  const kept = await hand.saved();
  await hand.open("crowded.json", crowded(canvas));
  await hand.tool("pen");
  await hand.settled();
  const lines = 20;
  const [before, shown] = [await counts(page), await hand.figures()];
  await page.evaluate(() => { window.inkCounts.slow.length = 0; });
  const times = [];
  for (let i = 0; i < lines; i += 1) {
    const y = (canvas[1] * (i + 0.5)) / lines;
    await hand.drag([[10, y], [200, y + 5], [400, y], [600, y + 9]], () => hand.settled());
    times.push((await hand.figures())["Pen to ink, last"]);
  }
  const [after, now] = [await counts(page), await hand.figures()];
  const done = (key) => (after[key] ?? 0) - (before[key] ?? 0);
  assert.equal(done("live.stroke"), 3 * lines, "a segment for each movement");
  assert.equal(done("live.fill"), lines, "a dot for each pen that comes down");
  assert.equal(done("ink.stroke"), lines, "a stroke for each pen that leaves: those that lie there are not drawn again");
  assert.equal(now["Whole redraws"], shown["Whole redraws"], "no whole redraw");
  assert.equal(now.Strokes, 500 + lines);
  // From the pen's event to the next frame on the screen; the browser reports it in steps of 8 ms, from 16 ms on.
  const slow = await page.evaluate(() => window.inkCounts.slow.slice().sort((a, b) => a - b));
  await hand.open("kept.json", kept);
  times.sort((a, b) => a - b);
  return {
    strokes_on_the_sheet: 500, pen_to_ink_median_ms: times[lines >> 1], pen_to_ink_worst_ms: times.at(-1),
    pen_downs_shown_after_16_ms_or_more: slow.length, their_median_ms: slow[slow.length >> 1] ?? 0,
  };
}

/** The size of the page: of all its files, and of each compressed by itself. */
export async function pageSize(url) {
  const fetched = async (path) => Buffer.from(await (await fetch(new URL(path, url))).arrayBuffer());
  const paths = JSON.parse(await fetched("/files.json"));
  const files = await Promise.all(paths.filter((path) => path !== "/").map(fetched));
  const total = (sizes) => sizes.reduce((sum, size) => sum + size, 0);
  return {
    page_files: files.length, page_bytes: total(files.map((file) => file.length)),
    page_gzip_bytes: total(files.map((file) => gzipSync(file).length)),
  };
}

/** Processor time of the page's processes while the feed runs, as fractions of a core. */
export async function feedCost(browser, { page }, seconds) {
  const cdp = await browser.newBrowserCDPSession();
  const own = await page.context().newCDPSession(page);
  await own.send("Performance.enable");
  const read = async () => {
    const { processInfo } = await cdp.send("SystemInfo.getProcessInfo");
    const { metrics } = await own.send("Performance.getMetrics");
    const main = metrics.find((metric) => metric.name === "TaskDuration").value;
    const feeds = await page.evaluate(() => window.inkCounts.counts["feed.clearRect"] ?? 0);
    return { main, feeds, at: performance.now() / 1000, cpu: processInfo };
  };
  const before = await read();
  await new Promise((done) => { setTimeout(done, seconds * 1000); });
  const after = await read();
  await cdp.detach();
  const span = after.at - before.at;
  const spent = (type) => after.cpu.filter((p) => p.type === type)
    .reduce((sum, p) => sum + p.cpuTime - (before.cpu.find((q) => q.id === p.id)?.cpuTime ?? 0), 0) / span;
  return {
    feed_hz: (after.feeds - before.feeds) / span, feed_main_thread_cores: (after.main - before.main) / span,
    feed_renderers_cores: spent("renderer"), feed_gpu_process_cores: spent("GPU"),
  };
}
