// Watches a running view with third-party code: connects, subscribes to every topic, and decodes every message by the schema
// received with it. Exits when a message of each listed topic has arrived.
//
//   node watch.mjs ws://127.0.0.1:8765 /scan,/odometry [picture.svg]
//
// Prints one JSON object: for each topic its type, the number of decoded messages, and the bytes of the first ones in hexadecimal.
// Needs the packages in SKETCHNAV_FOXGLOVE (a folder with node_modules). The exit code is 0 if all arrived and were decoded, and 1
// otherwise.
import { createRequire } from "node:module";
import { writeFileSync } from "node:fs";
import { picture } from "./picture.mjs";

const need = createRequire(`${process.env.SKETCHNAV_FOXGLOVE}/`);
const { FoxgloveClient } = need("@foxglove/ws-protocol");
const { parse } = need("@foxglove/rosmsg");
const { MessageReader } = need("@foxglove/rosmsg2-serialization");
const WebSocket = need("ws");

const [url, list, svg] = process.argv.slice(2);
const missing = new Set(list.split(","));
const KEPT = 3;
const LIMIT_MS = 60_000;

const topics = {};
const newest = {};
const subscriptions = new Map();
let isEnding = false;
let client;

// Only once: messages continue to arrive while the answer is written.
function end(words) {
  if (isEnding) return;
  isEnding = true;
  if (words) console.error(words);
  if (svg) writeFileSync(svg, picture(newest));
  process.stdout.write(JSON.stringify(topics), () => process.exit(words ? 1 : 0));
}

function announced(channels) {
  for (const { id, topic, encoding, schemaName, schemaEncoding, schema } of channels) {
    if (encoding !== "cdr" || schemaEncoding !== "ros2msg") end(`${topic}: ${encoding}, ${schemaEncoding}`);
    topics[topic] = { type: schemaName, decoded: 0, first: [] };
    const reader = new MessageReader(parse(schema, { ros2: true }));
    subscriptions.set(client.subscribe(id), { topic, reader });
  }
}

function came({ subscriptionId, data }) {
  if (isEnding) return;
  const { topic, reader } = subscriptions.get(subscriptionId);
  const bytes = new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
  try {
    newest[topic] = reader.readMessage(bytes);
  } catch (error) {
    return end(`${topic}: ${error}`);
  }
  topics[topic].decoded += 1;
  if (topics[topic].first.length < KEPT) topics[topic].first.push(Buffer.from(bytes).toString("hex"));
  missing.delete(topic);
  if (missing.size === 0) end();
}

// Sets all handlers before it returns, because data in the same packet as the handshake's answer is delivered directly afterwards.
function watch(socket) {
  client = new FoxgloveClient({ ws: socket });
  client.on("error", (error) => end(`error: ${error}`));
  client.on("close", () => end("the view has ended"));
  client.on("advertise", announced);
  client.on("message", came);
}

// The view may not be listening yet.
function connect() {
  const socket = new WebSocket(url, ["foxglove.sdk.v1"]);
  socket.once("open", () => watch(socket));
  socket.once("error", () => setTimeout(connect, 100));
}

setTimeout(() => end(`nothing on ${[...missing].join(", ")}`), LIMIT_MS);
connect();
