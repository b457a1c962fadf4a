// The page without a server: keeps its files, and hands them out when the server does not answer. While it does, its files count, so
// that page and server are of one version. What the robot says and is told is never kept.

const CACHE = "page";
/** A server that says nothing for so long does not answer, milliseconds. */
const PATIENCE_MS = 4000;
/** What is not of the page. */
const NEVER = /^\/(api\/|metrics)/;

async function fill() {
  const response = await fetch("/files.json");
  if (!response.ok) throw new Error(`files.json: the server answered ${response.status}`);
  const [cache, files] = await Promise.all([caches.open(CACHE), response.json()]);
  await cache.addAll(files);
}

/** A file from the server, or as it was kept. Only its path counts: the token of the link is in no cache. */
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
