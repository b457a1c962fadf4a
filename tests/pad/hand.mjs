// A hand on the running page: a pen, fingers and keys, as input events of the browser (CDP). The page receives the same events as
// from a real device: pointer events, coalesced if they arrive quickly.

import { fitted, onScreen } from "../../services/pad/page/view.js";

export class Hand {
  /** `page`: the page in Playwright; `cdp`: a session with it; `canvas`: the size of the sheet. */
  constructor(page, cdp, canvas) {
    Object.assign(this, { page, cdp, canvas });
  }

  /** Computes the sheet's position on the screen, where the page shows all of it. */
  async look() {
    const { x, y, width, height } = await this.page.locator("#sheet").boundingBox();
    this.view = fitted(this.canvas, [width, height]);
    this.corner = [x, y];
  }

  /** Converts a place on the sheet to the screen. */
  at(point) {
    const [x, y] = onScreen(this.view, point);
    return { x: x + this.corner[0], y: y + this.corner[1] };
  }

  #pen(type, point, more) {
    return this.cdp.send("Input.dispatchMouseEvent", { type, ...this.at(point), button: "left", pointerType: "pen", force: 0.5, ...more });
  }

  /** Draws a line with the pen, with all movements at once, as fast as the browser accepts them. */
  async draw(points) {
    const moves = [this.#pen("mousePressed", points[0], { buttons: 1, clickCount: 1 })];
    for (const point of points.slice(1)) moves.push(this.#pen("mouseMoved", point, { buttons: 1 }));
    moves.push(this.#pen("mouseReleased", points.at(-1), { buttons: 0, clickCount: 1 }));
    await Promise.all(moves);
  }

  /** Draws slowly: each movement waits for the previous one. */
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

  /** A double click of the mouse, as quick as by hand even on a busy machine. */
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
   * Fingers: `type` is `touchStart`, `touchMove`, `touchEnd` or `touchCancel`. The timestamps of a gesture's events are 20 ms
   * apart, so that two fingers on a busy machine do not look like one that was held down for long.
   */
  fingers(type, ...points) {
    this.touched = this.touched === undefined ? Date.now() / 1000 : this.touched + 0.02;
    const timestamp = this.touched;
    if (type === "touchEnd" || type === "touchCancel") this.touched = undefined;
    const touchPoints = points.map((point, id) => ({ ...this.at(point), id, force: 0.5 }));
    return this.cdp.send("Input.dispatchTouchEvent", { type, touchPoints, timestamp });
  }

  /** Selects a tool. */
  tool(name) {
    return this.page.click(`#tools [data-tool="${name}"]`);
  }

  /** Chooses an entry of the menu. */
  async menu(id) {
    await this.page.click("#menu-button");
    await this.page.click(`#${id}`);
  }

  /** The drawing in the form in which the page saves it. */
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

  /** Waits until the page has finished drawing. */
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
