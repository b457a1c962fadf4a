// Shared by all visits to the page: a browser, pages whose errors are collected, and steps that save a screenshot if they fail.
// Environment: SKETCHNAV_PLAYWRIGHT (the folder of node_modules), SKETCHNAV_CHROMIUM.

import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

import { Hand } from "./hand.mjs";

export const { chromium } = createRequire(join(process.env.SKETCHNAV_PLAYWRIGHT, "node_modules/"))("playwright-core");
/** The only purpose of this time limit is to detect a test that hangs. */
export const LIMIT_MS = 150000;
/** The browser's options. */
export const BROWSER = {
  executablePath: process.env.SKETCHNAV_CHROMIUM,
  args: ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"],
};
/** The errors of all pages. */
export const faults = [];

/** Opens the page, with a hand on its sheet. `prepare` is called with the page before it is loaded. */
export async function opened(context, url, canvas, prepare = () => {}) {
  const page = await context.newPage();
  page.setDefaultTimeout(LIMIT_MS);
  page.on("pageerror", (error) => faults.push(error.stack));
  page.on("console", (message) => message.type() === "error" && faults.push(message.text()));
  prepare(page);
  await page.goto(url);
  return { page, hand: new Hand(page, await context.newCDPSession(page), canvas) };
}

/** A file in `/proc`; empty if its process has exited. */
function fact(pid, name) {
  try {
    return readFileSync(`/proc/${pid}/${name}`, "utf8");
  } catch {
    return "";
  }
}

const parentOf = (pid) => fact(pid, "status").match(/^PPid:\t(\d+)/m)?.[1];
const supervisor = process.env.SKETCHNAV_PAD_PID && parentOf(process.env.SKETCHNAV_PAD_PID);

/** The process that serves the page now: a child of the first one's parent. Only known with SKETCHNAV_PAD_PID, the first one. */
export function padPid() {
  const served = (pid) => parentOf(pid) === supervisor && fact(pid, "cmdline").includes("\0serve\0pad\0");
  return supervisor && Number(readdirSync("/proc").find((pid) => /^\d+$/.test(pid) && served(pid)));
}

/** Runs the steps in order. If one fails, saves a screenshot of `page()` in `out`. */
export async function inTurn(steps, take, page, out) {
  for (const step of steps) {
    try {
      await take(step);
    } catch (error) {
      await page()?.screenshot({ path: join(out, "failed.png") }).catch(() => {});
      throw new Error(step.name, { cause: error });
    }
  }
}

/** Fails if a page had errors other than the expected ones. */
export function assertNoFaults(expected) {
  assert.deepEqual(faults.filter((fault) => !expected.test(fault)), [], "errors on the page");
}
