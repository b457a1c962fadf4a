// The link to the server: a WebSocket that reconnects by itself, and requests with readable error messages. Independent of
// drawings.

/** Delays between connection attempts, milliseconds; the last one is repeated. */
const PAUSES_MS = [250, 500, 1000, 2000, 4000];
const PING_MS = 2000;
/** A link that is silent for this long is dead, whatever the browser reports. */
const SILENT_MS = 6000;
/** The same while a long message arrives that the server has announced. */
const LONG_MS = 60000;
/** How long a link may take to come back before a request is given up, and how many times it is sent. */
const BACK_MS = 60000;
const ATTEMPTS = 5;

/** The delay before attempt `n`, counted from 0. */
export const pauseMs = (n) => PAUSES_MS[Math.min(n, PAUSES_MS.length - 1)];

/** Removes the token from the address bar, where it would be visible, copied and stored. */
export function takeToken(place = window.location, store = window.sessionStorage) {
  const query = new URLSearchParams(place.search);
  const token = query.get("token");
  if (token !== null) {
    store.setItem("token", token);
    window.history.replaceState(null, "", place.pathname);
  }
  return store.getItem("token") ?? "";
}

function parsed(text) {
  try {
    return JSON.parse(text);
  } catch {
    return {};
  }
}

export class Link {
  #token;
  #session;
  #socket = null;
  #attempts = 0;
  #heard = 0;
  #patienceMs = SILENT_MS;
  #timer = 0;
  #listener;
  #waiting = new Set();
  #hellos = 0;
  /** Round-trip time, milliseconds; `null` before the first. */
  latencyMs = null;
  up = false;
  /** Whether a connection attempt has failed. */
  failed = false;
  /** The server's reason for refusing this page; `null` if it accepts the page or gives none. */
  refusal = null;

  /** The listener has `changed()`, `hello(h, isNew)` (whether the link was down before), `feed(f)`, `drawn(d)`, `people(p)`. */
  constructor(token, listener) {
    this.#token = token;
    this.#session = window.sessionStorage.getItem("session") ?? "";
    this.#listener = listener;
    window.addEventListener("online", () => this.#again(0));
    window.setInterval(() => this.#tick(), PING_MS);
    this.#connect();
  }

  #query() {
    const query = new URLSearchParams();
    if (this.#token) query.set("token", this.#token);
    if (this.#session) query.set("session", this.#session);
    return query;
  }

  #connect() {
    window.clearTimeout(this.#timer);
    const scheme = window.location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${window.location.host}/ws?${this.#query()}`);
    this.#socket = socket;
    // Keeps the connection alive while a long hello arrives.
    socket.onopen = () => socket === this.#socket && this.#ping();
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
    this.#patienceMs = message.long === undefined ? SILENT_MS : LONG_MS;
    if (message.hello) this.#hello(message.hello);
    if (message.drawn) this.#listener.drawn(message.drawn);
    if (message.people) this.#listener.people(message.people);
    if (message.feed) this.#listener.feed(message.feed);
    if (message.pong !== undefined) {
      this.latencyMs = performance.now() - message.pong;
      this.#listener.changed();
    }
  }

  #hello(hello) {
    this.#session = hello.session;
    window.sessionStorage.setItem("session", hello.session);
    const isNew = !this.up;
    if (isNew) {
      this.up = true;
      this.refusal = null;
      this.#attempts = 0;
      this.#ping();
    }
    this.#hellos += 1;
    this.#listener.hello(hello, isNew);
    this.#waiting.forEach((go) => go());
  }

  #lost(socket) {
    if (socket !== this.#socket) return;
    this.#socket = null;
    if (!this.up) this.#askWhy();
    [this.up, this.failed] = [false, true];
    this.latencyMs = null;
    this.#again(pauseMs(this.#attempts));
    this.#attempts += 1;
    this.#listener.changed();
  }

  /** The browser does not report why a WebSocket was refused; the server does. */
  async #askWhy() {
    try {
      const response = await fetch(`/api/seat?${this.#query()}`, { headers: this.#headers() });
      const answer = await response.json();
      this.refusal = response.ok ? null : answer.error;
    } catch {
      this.refusal = null;
    }
    this.#listener.changed();
  }

  #again(pause) {
    if (this.#socket) return;
    window.clearTimeout(this.#timer);
    this.#timer = window.setTimeout(() => this.#connect(), pause);
  }

  #tick() {
    if (!this.up) {
      this.#ping();
      return;
    }
    if (performance.now() - this.#heard > this.#patienceMs) {
      this.restart();
      return;
    }
    this.#ping();
  }

  /** Closes the link, and connects again. */
  restart() {
    const old = this.#socket;
    old?.close();
    if (old) this.#lost(old);
  }

  #ping() {
    this.#send({ ping: Math.round(performance.now() * 10) / 10 });
  }

  #send(message) {
    if (this.#socket?.readyState !== WebSocket.OPEN) return false;
    this.#socket.send(JSON.stringify(message));
    return true;
  }

  /** Shows the others where this page draws. */
  show(presence) {
    this.#send({ presence });
  }

  /** Tells the server that a feed was drawn, so that it sends the next one. */
  seen(n) {
    this.#send({ seen: n });
  }

  /** Stops the robot: through the open socket, or by a request if there is none. */
  async abort() {
    if (!this.#send({ abort: true })) await this.post("/api/order", JSON.stringify({ order: "abort" }));
  }

  #headers(type) {
    const headers = { "x-sketchnav-session": this.#session };
    if (this.#token) headers["x-sketchnav-token"] = this.#token;
    if (type) headers["content-type"] = type;
    return headers;
  }

  /** Posts a body. Returns the answer; throws an `Error` with the server's message and its `status`, or with `unheard` if no answer came. */
  async post(path, body, type = "application/json", more = {}) {
    let response;
    let answer;
    try {
      response = await fetch(path, { method: "POST", headers: { ...this.#headers(type), ...more }, body });
      answer = await response.text();
    } catch {
      throw Object.assign(new Error("The server does not answer."), { unheard: true });
    }
    answer = parsed(answer);
    if (!response.ok) throw Object.assign(new Error(answer.error ?? `The server answered ${response.status}.`), { status: response.status });
    return answer;
  }

  /**
   * Posts a body like `post`, until it is answered: if the link breaks meanwhile, the body is sent again under the same name once
   * the link is back, and the server handles it once. `broken` is called each time.
   */
  async send(path, body, type, broken) {
    const name = Array.from(crypto.getRandomValues(new Uint32Array(4)), (n) => n.toString(16).padStart(8, "0")).join("");
    for (let attempt = 1; ; attempt += 1) {
      const { up } = this;
      const hellos = this.#hellos;
      try {
        return await this.post(path, body, type, { "x-sketchnav-sending": name });
      } catch (error) {
        // A restarted server refuses requests until this page has joined it.
        const isBack = hellos !== this.#hellos;
        if (!(error.unheard || isBack || !up || !this.up) || attempt === ATTEMPTS) throw error;
        broken();
        if (!isBack && !await this.#back()) throw new Error("The link did not come back. It is not known whether this has arrived: send it again.");
      }
    }
  }

  /** Waits for the next hello; resolves to whether it came in time. */
  #back() {
    return new Promise((resolve) => {
      const done = (is) => {
        window.clearTimeout(timer);
        this.#waiting.delete(go);
        resolve(is);
      };
      const go = () => done(true);
      const timer = window.setTimeout(() => done(false), BACK_MS);
      this.#waiting.add(go);
    });
  }

  /** Fetches a file. */
  async fetch(path) {
    const response = await fetch(path, { headers: this.#headers() });
    if (!response.ok) throw new Error(`The server answered ${response.status}.`);
    return response.blob();
  }
}
