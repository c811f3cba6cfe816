// The map, its rooms, and questions to it.

import { ask, command, element, listen } from "./api.js";
import { Drawing, inside } from "./drawing.js";

/** Tiles of a map that changes all the time are asked for no more often, … */
const REFRESH_MS = 5000;
/** … and rooms and the graph, which are whole, only so often, unless something was said or the map jumped. */
const WHOLE_MS = 60_000;
/** Then so soon. */
const SOON_MS = 200;
/** A name that was just said is shown once the robot has seen the room that it is in. */
const NAMES_MS = 30_000;

const at = (id) => document.getElementById(id);
const drawing = new Drawing(at("canvas"));
let map = null;
let shown = false;
let following = true;
let due = null;
let refreshing = false;
let stale = false;
let wholeAt = 0;
let namesUntil = 0;
let choice = 0;
let sentences = new Map();

const percent = (p) => `${Math.round(100 * p)} %`;

async function tile(id, x, y, hash) {
  const response = await fetch(`/map/${id}/tile/${x}/${y}?hash=${hash}`);
  if (!response.ok) throw new Error(response.statusText);
  return createImageBitmap(await response.blob());
}

async function refresh() {
  if (refreshing || !map) {
    stale = true;
    return;
  }
  const id = map;
  [refreshing, stale] = [true, false];
  let failed = false;
  try {
    const whole = Date.now() - wholeAt > WHOLE_MS || Date.now() < namesUntil;
    // What changes from here on is for the next time.
    if (whole) wholeAt = Date.now();
    const asked = whole ? Promise.all([ask(`/map/${id}/ask/regions`), ask(`/map/${id}/ask/graph`)]) : null;
    // It may fail while walls are still awaited.
    asked?.catch(() => {});
    const tiles = await ask(`/map/${id}/tiles`);
    if (id !== map) return;
    await drawing.take(tiles, (x, y, hash) => tile(id, x, y, hash));
    if (id !== map) return;
    at("connection").textContent = "";
    at("empty").hidden = tiles.tiles.length > 0;
    if (!shown && tiles.tiles.length) {
      shown = true;
      at("view").setAttribute("aria-busy", false);
      drawing.fit();
    }
    if (!asked) return;
    // Walls are there first: to find rooms takes longer.
    const [rooms, graph] = await asked;
    if (id !== map) return;
    const isFirst = !drawing.graph;
    drawing.graph = graph;
    drawing.trail = [];
    drawing.setRegions(rooms.regions, rooms.areas);
    list(rooms.regions);
    tellDoubt(graph);
    if (isFirst) drawing.fit();
    else drawing.draw();
  } catch (error) {
    at("connection").textContent = error.message;
    [stale, failed, wholeAt] = [true, true, 0];
  } finally {
    refreshing = false;
    if (stale || id !== map) changed(wholeAt || failed ? undefined : SOON_MS);
  }
}

/** More than walls has changed: that is looked for by somebody. */
function changedWhole() {
  wholeAt = 0;
  clearTimeout(due);
  due = null;
  changed(SOON_MS);
}

/** The map has changed: it is fetched soon, and not too often. */
function changed(wait = shown ? REFRESH_MS : SOON_MS) {
  due ??= setTimeout(() => {
    due = null;
    refresh();
  }, wait);
}

function robotAt() {
  for (const pose of drawing.robots.values()) return [pose.map_from_body.x_m, pose.map_from_body.y_m];
  return null;
}

function list(regions) {
  // Whoever is at one of them is not to lose it.
  if (at("rooms").contains(document.activeElement)) return;
  const from = robotAt();
  const distance = (r) => from && Math.hypot(r.middle[0] - from[0], r.middle[1] - from[1]);
  const rooms = drawing.regions.map((r) => ({ r, far: distance(r) })).filter(({ r }) => r.names.length || regions.length < 40);
  rooms.sort((a, b) => (b.r.names[0]?.p ?? 0) - (a.r.names[0]?.p ?? 0));
  at("rooms").replaceChildren(...rooms.map(({ r, far }) => {
    const name = r.names[0];
    const text = name ? `${name.label}, ${percent(name.p)}` : `${r.kind} without a name`;
    const where = `${r.area_m2.toFixed(0)} m²${far === null ? "" : `, ${far.toFixed(0)} m away`}`;
    const swatch = element("span", { class: `swatch c${r.id % 8}`, "aria-hidden": "true" });
    return element("li", {}, element("button", { type: "button", onclick: () => choose(r, true) }, swatch,
      element("span", {}, text), element("small", {}, where)));
  }));
}

function tellDoubt({ differences, unresolved }) {
  const lines = differences.map((d) => element("li", {}, `${percent(d.weight)}: ${d.words}`));
  const rest = unresolved > 0.005 ? element("p", {}, `None of those kept: ${percent(unresolved)}`) : undefined;
  at("doubt").hidden = !drawing.doubt || !(lines.length || rest);
  at("doubt").replaceChildren(element("h2", {}, "This map can be so"), element("ul", {}, ...lines), ...(rest ? [rest] : []));
}

async function readSentences() {
  try {
    const reply = await ask(`/map/${map}/sentences`);
    sentences = new Map(reply.sentences.map((s) => [s.id, s]));
  } catch {
    // Whoever may look may not always read what was said.
    sentences = new Map();
  }
}

async function because(name) {
  const { candidates } = await ask(`/map/${map}/ask/where`, { name });
  return (id) => candidates.find((c) => c.region === id)?.because ?? [];
}

/** A room: what it may be called, why, and how to mend that. */
async function choose(region, fly) {
  const mine = ++choice;
  drawing.chosen = region.id;
  drawing.found = [];
  if (fly) {
    setFollowing(false);
    drawing.fly(region.middle, Math.max(8, Math.sqrt(region.area_m2)));
  }
  drawing.draw();
  const room = at("room");
  room.hidden = false;
  const title = region.names[0]?.label ?? `A ${region.kind} without a name`;
  const doors = `${region.kind}, ${region.area_m2.toFixed(1)} m², ${region.doorways.length} doorways`;
  room.replaceChildren(element("h2", {}, title), element("p", {}, doors));
  await readSentences();
  if (mine !== choice) return;
  for (const name of region.names) {
    const behind = element("ul", { class: "because" });
    const actions = element("p", {},
      element("button", { type: "button", onclick: () => rename(name.label, actions) }, "Rename"),
      element("button", { type: "button", onclick: () => mend("forget", { name: name.label }) }, "Forget"));
    room.append(element("h3", {}, `${name.label}: ${percent(name.p)}`), behind, actions);
    const ids = await because(name.label).then((of) => of(region.id), () => []);
    if (mine !== choice) return;
    behind.replaceChildren(...ids.map((id) => {
      const text = sentences.get(id)?.text ?? "a sentence";
      return element("li", {}, `“${text}” `, element("button", { type: "button", onclick: () => mend("undo", { id }) }, "Undo"));
    }));
  }
  room.append(desk(region));
}

/** What only who knows the building can tell of a room: another name, and whether robots keep out. */
function desk(region) {
  // One line that goes to each hole and back: what a corridor goes round is not in it.
  const ring = (line) => [...line, line[0]];
  const holes = region.holes_m.flatMap((hole) => [...ring(hole), region.polygon_m[0]]);
  const polygon_m = (holes.length ? [...ring(region.polygon_m), ...holes] : region.polygon_m).flat().join();
  const out = drawing.areas.filter((a) => a.forbidden && inside(region.middle, a.polygon_m));
  const button = (text, onclick) => element("button", { type: "button", onclick }, text);
  const actions = element("p", {},
    button("Name this room", () => form("Its name", "Name", actions, (name) => mend("area", { polygon_m, name }))),
    out.length ? button("Robots may enter", () => mend("undo", { id: out.at(-1).id }))
      : button("Robots keep out", () => mend("area", { polygon_m, forbidden: true })));
  return actions;
}

function rename(from, after) {
  form(`Instead of ${from}`, "Rename", after, (to) => mend("rename", { from, to }));
}

/** Asks for a name where buttons were. */
function form(label, verb, after, done) {
  const input = element("input", { type: "text", "aria-label": label, maxlength: 100 });
  after.replaceChildren(element("form", {
    onsubmit: (event) => {
      event.preventDefault();
      if (input.value.trim()) done(input.value.trim());
    },
  }, input, element("button", { type: "submit" }, verb)));
  input.focus();
}

async function mend(what, parameters) {
  let words;
  try {
    ({ words } = await command(what, { ...parameters, map }));
  } catch (error) {
    words = error.message;
  }
  wholeAt = 0;
  at("room").replaceChildren(element("p", {}, words));
  await refresh();
}

function bearing(rad) {
  const degrees = Math.round((rad * 180) / Math.PI);
  if (Math.abs(degrees) < 15) return "ahead";
  if (Math.abs(degrees) > 165) return "behind";
  return `${Math.abs(degrees)}° ${degrees > 0 ? "left" : "right"}`;
}

async function question(text) {
  choice++;
  const answer = at("answer");
  answer.hidden = false;
  at("room").hidden = true;
  drawing.chosen = null;
  let reply;
  try {
    reply = await ask(`/map/${map}/ask/where`, { text });
  } catch (error) {
    drawing.found = [];
    answer.replaceChildren(element("p", {}, `${error.message}${error.problem?.hint ? `: ${error.problem.hint}` : ""}`));
    return;
  }
  const likely = reply.candidates.filter((c) => c.probability >= 0.02);
  drawing.found = likely;
  const lines = likely.map((c) => {
    const from = c.from_robot ? `, ${c.from_robot.distance_m.toFixed(0)} m ${bearing(c.from_robot.bearing_rad)}` : "";
    const go = () => drawing.fly([c.x_m, c.y_m], 8);
    return element("li", {}, element("button", { type: "button", onclick: go },
      element("strong", {}, c.shown || c.label), ` ${percent(c.probability)}${from}`));
  });
  if (reply.p_none >= 0.01) lines.push(element("li", { class: "none" }, `Not in this map, as far as it is known: ${percent(reply.p_none)}`));
  const { via, label, suggestions } = reply.resolved;
  const how = via === "exact" || !label ? undefined : element("p", {}, `understood as ${label} (${via})`);
  const offers = suggestions.length ? element("p", {}, `Did you mean ${suggestions.join(" or ")}?`) : undefined;
  answer.replaceChildren(element("h2", {}, text), ...[how, element("ul", {}, ...lines), offers].filter(Boolean));
  if (likely.length) {
    setFollowing(false);
    drawing.fly([likely[0].x_m, likely[0].y_m], 10);
  } else drawing.draw();
}

function setFollowing(is) {
  following = is;
  at("follow").setAttribute("aria-pressed", is);
}

function pointers() {
  const canvas = at("canvas");
  const down = new Map();
  let moved = 0;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    down.set(event.pointerId, [event.offsetX, event.offsetY]);
    if (down.size === 1) moved = 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = down.get(event.pointerId);
    if (!before) return;
    const now = [event.offsetX, event.offsetY];
    const other = [...down].find(([id]) => id !== event.pointerId)?.[1];
    moved += Math.hypot(now[0] - before[0], now[1] - before[1]);
    if (other) {
      const spread = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]) || 1;
      drawing.zoom(spread(now) / spread(before), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
    } else if (moved > 4) {
      setFollowing(false);
      drawing.pan(now[0] - before[0], now[1] - before[1]);
    }
    down.set(event.pointerId, now);
  });
  const up = (event) => {
    if (down.delete(event.pointerId) && moved <= 4 && !down.size) {
      const region = drawing.regionAt(drawing.toMap(event.offsetX, event.offsetY));
      if (region) choose(region, false);
    }
  };
  canvas.addEventListener("pointerup", up);
  canvas.addEventListener("pointercancel", (event) => down.delete(event.pointerId));
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    drawing.zoom(Math.exp(-event.deltaY / 400), event.offsetX, event.offsetY);
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const moves = { ArrowLeft: [60, 0], ArrowRight: [-60, 0], ArrowUp: [0, 60], ArrowDown: [0, -60] };
    if (moves[event.key]) {
      setFollowing(false);
      drawing.pan(...moves[event.key]);
    } else if ("+=".includes(event.key)) drawing.zoom(1.3);
    else if (event.key === "-") drawing.zoom(1 / 1.3);
    else if (event.key === "0") drawing.fit();
    else return;
    event.preventDefault();
  });
}

async function findMaps() {
  const info = await ask("/info");
  const wanted = map ?? new URLSearchParams(location.search).get("map") ?? info.maps[0]?.id;
  at("map").replaceChildren(...info.maps.map(({ id }) => element("option", { value: id, selected: id === wanted }, id)));
  if (!info.maps.length) at("empty").hidden = false;
  if (wanted && wanted !== map) open(wanted);
  // Where those are who stand still.
  for (const { robot, map: of } of info.robots) {
    if (of !== map) continue;
    ask(`/robot/${robot}/out/pose`).then((pose) => {
      drawing.robots.set(robot, pose);
      drawing.draw();
    }, () => {});
  }
}

function open(id) {
  map = id;
  shown = false;
  at("view").setAttribute("aria-busy", true);
  choice++;
  at("room").hidden = at("answer").hidden = true;
  drawing.setRegions([]);
  drawing.graph = null;
  drawing.trail = [];
  wholeAt = 0;
  drawing.tiles.clear();
  drawing.robots.clear();
  drawing.found = [];
  refresh();
}

listen({
  pose: (pose) => {
    if (pose.map.id !== map) return map ? undefined : findMaps().catch(() => {});
    drawing.robots.set(pose.robot, pose);
    const { x_m, y_m } = pose.map_from_body;
    drawing.trail.push([x_m, y_m]);
    if (following && shown) {
      // Only when it nears the edge: a picture that never stands still is hard to read.
      const box = at("canvas").getBoundingClientRect();
      const [x, y] = drawing.toScreen([x_m, y_m]).map((k) => k / drawing.ratio);
      if (x < 60 || y < 60 || x > box.width - 60 || y > box.height - 60) drawing.fly([x_m, y_m]);
    }
    drawing.draw();
  },
  map: ({ id }) => {
    if (id === map) changed();
    else if (![...at("map").options].some((option) => option.value === id)) findMaps().catch(() => {});
  },
  heard: () => {
    namesUntil = Date.now() + NAMES_MS;
    changedWhole();
  },
  mended: ({ map: id }) => id === map && changedWhole(),
  jump: changedWhole,
  missed: changedWhole,
}, (is) => {
  at("connection").textContent = is ? "" : "no connection";
  at("connection").className = is ? "good" : "bad";
  if (is) findMaps().then(changedWhole).catch(() => {});
});
at("map").addEventListener("change", () => open(at("map").value));
at("asked").addEventListener("submit", (event) => {
  event.preventDefault();
  const text = at("name").value.trim();
  if (text && map) question(text);
});
at("all").addEventListener("click", () => drawing.fit());
at("follow").addEventListener("click", () => setFollowing(!following));
at("more").addEventListener("click", () => {
  drawing.doubt = !drawing.doubt;
  at("more").setAttribute("aria-pressed", drawing.doubt);
  if (drawing.graph) tellDoubt(drawing.graph);
  drawing.draw();
});
pointers();
navigator.serviceWorker?.register("/sw.js").catch(() => {});
