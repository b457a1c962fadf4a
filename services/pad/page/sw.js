// The page without a server: caches its files and serves them when the server does not answer. If it does, its files take
// precedence, so that page and server have the same version. The robot's data is never cached.

const CACHE = "page";
/** Time without an answer after which the server counts as unreachable, milliseconds. */
const PATIENCE_MS = 4000;
/** Paths that are not part of the page. */
const NEVER = /^\/(api\/|metrics)/;

async function fill() {
  const response = await fetch("/files.json");
  if (!response.ok) throw new Error(`files.json: the server answered ${response.status}`);
  const [cache, files] = await Promise.all([caches.open(CACHE), response.json()]);
  await cache.addAll(files);
}

/** A file from the server, or else from the cache. Only the path is the key: the link's token is never cached. */
async function file(path, event) {
  try {
    const response = await fetch(path, { signal: AbortSignal.timeout(PATIENCE_MS) });
    if (response.ok) event.waitUntil(keep(path, response.clone()));
    return response;
  } catch (error) {
    const kept = await caches.match(path);
    if (kept) return kept;
    throw error;
  }
}

const keep = async (path, response) => (await caches.open(CACHE)).put(path, response);

self.addEventListener("install", (event) => {
  self.skipWaiting();
  event.waitUntil(fill());
});
self.addEventListener("activate", (event) => event.waitUntil(self.clients.claim()));
self.addEventListener("fetch", (event) => {
  const { origin, pathname } = new URL(event.request.url);
  if (event.request.method !== "GET" || origin !== self.location.origin || NEVER.test(pathname)) return;
  event.respondWith(file(pathname, event));
});
