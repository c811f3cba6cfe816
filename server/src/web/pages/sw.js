// The pages themselves are kept for when there is no connection; nothing that they ask is.

const SHELL = "toponym-1";
const FILES = ["/guide", "/", "/assets/style.css", "/assets/api.js", "/assets/map.js", "/assets/drawing.js", "/assets/guide.js",
  "/assets/outbox.js", "/assets/listening.js", "/assets/icon.svg", "/assets/manifest.webmanifest"];

addEventListener("install", (event) => {
  skipWaiting();
  event.waitUntil(caches.open(SHELL).then((cache) => cache.addAll(FILES)));
});

addEventListener("activate", (event) => {
  const old = caches.keys().then((names) => Promise.all(names.filter((n) => n !== SHELL).map((n) => caches.delete(n))));
  event.waitUntil(old.then(() => clients.claim()));
});

addEventListener("fetch", (event) => {
  const path = new URL(event.request.url).pathname;
  if (event.request.method !== "GET" || !FILES.includes(path)) return;
  // The server's as it is now; the one that is kept where there is none.
  const fresh = fetch(event.request).then((response) => {
    const copy = response.clone();
    if (response.ok) caches.open(SHELL).then((cache) => cache.put(path, copy));
    return response;
  });
  event.respondWith(fresh.catch(() => caches.match(path)));
});
