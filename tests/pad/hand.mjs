// A hand on a page that runs: a pen, fingers, keys, by the browser's own input events (CDP), so that the
// page gets what a real device gives it: pointer events, coalesced where they come fast.

import { fitted, onScreen } from "../../services/pad/page/view.js";

export class Hand {
  /** `page` of playwright, `cdp` a session with it, `canvas` the sheet's size. */
  constructor(page, cdp, canvas) {
    Object.assign(this, { page, cdp, canvas });
  }

  /** Where the sheet lies: it is shown whole, as the page fits it. */
  async look() {
    const { x, y, width, height } = await this.page.locator("#sheet").boundingBox();
    this.view = fitted(this.canvas, [width, height]);
    this.corner = [x, y];
  }

  /** A place of the sheet on the screen. */
  at(point) {
    const [x, y] = onScreen(this.view, point);
    return { x: x + this.corner[0], y: y + this.corner[1] };
  }

  #pen(type, point, more) {
    return this.cdp.send("Input.dispatchMouseEvent", { type, ...this.at(point), button: "left", pointerType: "pen", force: 0.5, ...more });
  }

  /** Draws a line with the pen: all movements at once, as fast as the browser takes them. */
  async draw(points) {
    const moves = [this.#pen("mousePressed", points[0], { buttons: 1, clickCount: 1 })];
    for (const point of points.slice(1)) moves.push(this.#pen("mouseMoved", point, { buttons: 1 }));
    moves.push(this.#pen("mouseReleased", points.at(-1), { buttons: 0, clickCount: 1 }));
    await Promise.all(moves);
  }

  /** Draws slowly: each movement waits for the one before. */
  async drag(points, pause = async () => {}) {
    await this.#pen("mousePressed", points[0], { buttons: 1, clickCount: 1 });
    for (const point of points.slice(1)) {
      await this.#pen("mouseMoved", point, { buttons: 1 });
      await pause();
    }
    await this.#pen("mouseReleased", points.at(-1), { buttons: 0, clickCount: 1 });
  }

  /** A tap of the pen. */
  tap(point) {
    return this.draw([point]);
  }

  /** A double click of the mouse, as quick as a hand's however busy the machine is. */
  async twice(point) {
    const began = Date.now() / 1000;
    for (const clickCount of [1, 2]) {
      for (const [type, buttons] of [["mousePressed", 1], ["mouseReleased", 0]]) {
        const timestamp = began + 0.1 * (clickCount - 1) + 0.05 * (1 - buttons);
        await this.cdp.send("Input.dispatchMouseEvent", { type, ...this.at(point), button: "left", buttons, clickCount, timestamp });
      }
    }
  }

  /**
   * Fingers: `type` is `touchStart`, `touchMove`, `touchEnd` or `touchCancel`. Events of one gesture come 20 ms apart by their own
   * time, so that a busy machine does not turn two fingers into one that has been down for long.
   */
  fingers(type, ...points) {
    this.touched = this.touched === undefined ? Date.now() / 1000 : this.touched + 0.02;
    const timestamp = this.touched;
    if (type === "touchEnd" || type === "touchCancel") this.touched = undefined;
    const touchPoints = points.map((point, id) => ({ ...this.at(point), id, force: 0.5 }));
    return this.cdp.send("Input.dispatchTouchEvent", { type, touchPoints, timestamp });
  }

  /** Takes a tool. */
  tool(name) {
    return this.page.click(`#tools [data-tool="${name}"]`);
  }

  /** Chooses something from the menu. */
  async menu(id) {
    await this.page.click("#menu-button");
    await this.page.click(`#${id}`);
  }

  /** The drawing as the page saves it. */
  async saved() {
    const download = this.page.waitForEvent("download");
    await this.menu("save");
    const stream = await (await download).createReadStream();
    let text = "";
    for await (const chunk of stream) text += chunk;
    return text;
  }

  /** Opens a drawing. */
  async open(name, text) {
    const chooser = this.page.waitForEvent("filechooser");
    await this.menu("open");
    this.opened = (this.opened ?? 0) + 1;
    const file = `${this.opened}-${name}`;
    await (await chooser).setFiles({ name: file, mimeType: "application/json", buffer: Buffer.from(text) });
    await this.page.getByText(`“${file}” is open.`).waitFor();
    await this.settled();
  }

  /** The figures that the page shows. */
  async figures() {
    await this.page.click("#menu-button");
    const figures = await this.page.evaluate(() => Object.fromEntries(
      [...document.querySelectorAll("#figures dt")].map((name) => [name.textContent, parseFloat(name.nextElementSibling.textContent)]),
    ));
    await this.page.click("#menu-button");
    return figures;
  }

  /** Waits until the page has drawn what is due. */
  settled() {
    return this.page.evaluate(() => new Promise((done) => { requestAnimationFrame(() => requestAnimationFrame(done)); }));
  }

  /** A fingerprint of a layer's pixels. */
  async pixels(layer = "ink") {
    await this.settled();
    return this.page.evaluate((name) => {
      const canvas = document.querySelector(`#sheet canvas.${name}`);
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      let hash = 2166136261;
      for (const value of data) hash = Math.imul(hash ^ value, 16777619);
      return `${canvas.width}×${canvas.height} ${(hash >>> 0).toString(16)}`;
    }, layer);
  }
}
