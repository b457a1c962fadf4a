// The link to the server: a WebSocket that connects again by itself, and requests with words for what
// went wrong. Knows nothing of drawings.

/** Pauses between attempts to connect, milliseconds; the last one is kept. */
const PAUSES_MS = [250, 500, 1000, 2000, 4000];
const PING_MS = 2000;
/** A link that says nothing for so long is dead, whatever the browser believes. */
const SILENT_MS = 6000;

/** The pause before the attempt `n`, counted from 0. */
export const pauseMs = (n) => PAUSES_MS[Math.min(n, PAUSES_MS.length - 1)];

/** Takes the token out of the address bar, where it would be seen, copied and kept. */
export function takeToken(place = window.location, store = window.sessionStorage) {
  const query = new URLSearchParams(place.search);
  const token = query.get("token");
  if (token !== null) {
    store.setItem("token", token);
    window.history.replaceState(null, "", place.pathname);
  }
  return store.getItem("token") ?? "";
}

export class Link {
  #token;
  #session;
  #socket = null;
  #attempts = 0;
  #heard = 0;
  #timer = 0;
  #listener;
  /** Round trip, milliseconds, `null` before the first. */
  latencyMs = null;
  up = false;

  /** The listener has `changed()`, `hello(h)`, `feed(f)`. */
  constructor(token, listener) {
    this.#token = token;
    this.#session = window.sessionStorage.getItem("session") ?? "";
    this.#listener = listener;
    window.addEventListener("online", () => this.#again(0));
    window.setInterval(() => this.#tick(), PING_MS);
    this.#connect();
  }

  #connect() {
    window.clearTimeout(this.#timer);
    const scheme = window.location.protocol === "https:" ? "wss" : "ws";
    const query = new URLSearchParams();
    if (this.#token) query.set("token", this.#token);
    if (this.#session) query.set("session", this.#session);
    const socket = new WebSocket(`${scheme}://${window.location.host}/ws?${query}`);
    this.#socket = socket;
    socket.onmessage = (event) => this.#take(socket, event.data);
    socket.onclose = () => this.#lost(socket);
  }

  #take(socket, data) {
    if (socket !== this.#socket) return;
    this.#heard = performance.now();
    let message;
    try {
      message = JSON.parse(data);
    } catch {
      return;
    }
    if (message.hello) this.#hello(message.hello);
    if (message.feed) this.#listener.feed(message.feed);
    if (message.pong !== undefined) {
      this.latencyMs = performance.now() - message.pong;
      this.#listener.changed();
    }
  }

  #hello(hello) {
    this.#session = hello.session;
    window.sessionStorage.setItem("session", hello.session);
    if (!this.up) {
      this.up = true;
      this.#attempts = 0;
      this.#ping();
    }
    this.#listener.hello(hello);
  }

  #lost(socket) {
    if (socket !== this.#socket) return;
    this.#socket = null;
    this.up = false;
    this.latencyMs = null;
    this.#again(pauseMs(this.#attempts));
    this.#attempts += 1;
    this.#listener.changed();
  }

  #again(pause) {
    if (this.#socket) return;
    window.clearTimeout(this.#timer);
    this.#timer = window.setTimeout(() => this.#connect(), pause);
  }

  #tick() {
    if (!this.up) return;
    if (performance.now() - this.#heard > SILENT_MS) {
      const dead = this.#socket;
      dead.close();
      this.#lost(dead);
      return;
    }
    this.#ping();
  }

  #ping() {
    this.#send({ ping: Math.round(performance.now() * 10) / 10 });
  }

  #send(message) {
    if (this.#socket?.readyState !== WebSocket.OPEN) return false;
    this.#socket.send(JSON.stringify(message));
    return true;
  }

  /** Tells the server that a feed was drawn, so that the next may come. */
  seen(n) {
    this.#send({ seen: n });
  }

  /** Stops the robot: by the socket that is open already, and by a request of its own where it is not. */
  async abort() {
    if (!this.#send({ abort: true })) await this.post("/api/order", JSON.stringify({ order: "abort" }));
  }

  #headers(type) {
    const headers = { "x-sketchnav-session": this.#session };
    if (this.#token) headers["x-sketchnav-token"] = this.#token;
    if (type) headers["content-type"] = type;
    return headers;
  }

  /** Sends a body; the answer, or an `Error` with the server's words. */
  async post(path, body, type = "application/json") {
    let response;
    try {
      response = await fetch(path, { method: "POST", headers: this.#headers(type), body });
    } catch {
      throw new Error("The server does not answer.");
    }
    const answer = await response.json().catch(() => ({}));
    if (!response.ok) throw new Error(answer.error ?? `The server answered ${response.status}.`);
    return answer;
  }

  /** Fetches a file. */
  async fetch(path) {
    const response = await fetch(path, { headers: this.#headers() });
    if (!response.ok) throw new Error(`The server answered ${response.status}.`);
    return response.blob();
  }
}
