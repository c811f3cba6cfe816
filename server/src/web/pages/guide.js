// Hold to talk, or type; what became of each sentence; take it back.

import { ask, command, element, listen } from "./api.js";
import { canListen, listen as listenTo, whereItGoes } from "./listening.js";
import { Outbox } from "./outbox.js";

const at = (id) => document.getElementById(id);
const STATES = {
  waiting: "not sent yet", read: "heard, on disk", understood: "in the map", asked: "a question to you",
  not_understood: "not understood", refused: "not taken",
};
const MARKS = { waiting: "…", read: "✓", understood: "✓✓", asked: "?", not_understood: "✗", refused: "✗" };
/** Sentences of which it was already told what became of them, and the items that show them. */
const told = new Set();
const items = new Map();
/** Robot → its map. */
const maps = new Map();
let connected = false;
let outbox = null;

const robot = () => at("robot").value || localStorage.getItem("toponym.robot") || "any";
const lang = () => at("lang").value;

function sentenceItem(s, answered) {
  const buttons = [];
  if (s.state === "asked" && !answered) {
    for (const answer of ["yes", "no"]) {
      const reply = () => outbox.add(s.robot, { text: answer, answers: s.id });
      buttons.push(element("button", { type: "button", onclick: reply }, answer));
    }
  }
  if (s.state === "understood" && !s.asks && !s.undone) {
    buttons.push(element("button", { type: "button", onclick: () => undo(s) }, "Not that"));
  }
  const known = s.asks && s.state === "understood" ? "answered" : STATES[s.state] ?? s.state;
  const state = s.undone ? "taken back" : s.late ? `${known}: ${s.late}` : known;
  const time = new Date(s.saidAt).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" });
  return element("li", { class: s.undone ? "undone" : s.state },
    element("p", { class: "said" }, s.sentence.text),
    element("p", { class: "state" }, `${MARKS[s.state] ?? ""} ${time}, ${state}${s.durable && s.done ? ", on disk" : ""}`),
    s.words ? element("p", { class: "words" }, s.words) : undefined,
    ...buttons);
}

/** Only what has changed is made anew: a screen reader tells that alone. */
function show(sentences) {
  const list = at("sentences");
  const atEnd = list.scrollHeight - list.scrollTop - list.clientHeight < 80;
  const answered = new Set(sentences.map((s) => s.sentence.answers).filter(Boolean));
  const now = new Set(sentences.map((s) => s.id));
  for (const [id, { item }] of items) {
    if (now.has(id)) continue;
    item.remove();
    items.delete(id);
  }
  for (const s of sentences) {
    const looks = JSON.stringify([s, answered.has(s.id)]);
    const known = items.get(s.id);
    if (known?.looks === looks) continue;
    const item = sentenceItem(s, answered.has(s.id));
    if (known) known.item.replaceWith(item);
    else list.append(item);
    items.set(s.id, { item, looks });
    announce(s);
  }
  if (atEnd) list.scrollTop = list.scrollHeight;
  status();
}

/** By touch and by voice, for whoever does not look. */
function announce(s) {
  if (!s.done || told.has(s.id)) return;
  told.add(s.id);
  if (Date.now() - s.addedAt > 60_000) return;
  if (navigator.userActivation?.hasBeenActive) navigator.vibrate?.(s.state === "understood" ? 60 : [60, 80, 60]);
  if (at("aloud").checked && s.words) {
    globalThis.speechSynthesis?.speak(Object.assign(new SpeechSynthesisUtterance(s.words), { lang: "en" }));
  }
}

async function undo({ id, robot: of }) {
  try {
    const { words } = await command("undo", { id, map: maps.get(of) });
    outbox.change(id, (s) => Object.assign(s, { undone: true, words }));
  } catch (error) {
    outbox.change(id, (s) => (s.words = error.message));
  }
}

async function findRobots() {
  const info = await ask("/info");
  const chosen = robot();
  maps.clear();
  for (const state of info.robots) if (state.map) maps.set(state.robot, state.map);
  const options = [...maps.keys()].map((id) => element("option", { value: id, selected: id === chosen }, id));
  at("robot").replaceChildren(...options);
  if (maps.size === 1) localStorage.setItem("toponym.robot", robot());
}

function status() {
  const waiting = outbox?.waiting().length ?? 0;
  const kept = waiting ? ` (${waiting} waiting)` : "";
  at("connection").textContent = connected ? "connected" : `no connection: what you say is kept${kept}`;
  at("connection").className = connected ? "good" : "bad";
}

function connection(is) {
  connected = is;
  status();
  if (is) {
    outbox.again();
    findRobots().catch(() => {});
  }
}

function talk() {
  const button = at("talk");
  button.hidden = !canListen();
  let stop;
  const begin = (event) => {
    event.preventDefault();
    if (stop) return;
    if (event.pointerId !== undefined) button.setPointerCapture(event.pointerId);
    button.classList.add("held");
    stop = listenTo({
      lang: lang(),
      soFar: (text) => (at("sofar").textContent = text),
      failed: (why) => (at("sofar").textContent = `not heard: ${why}`),
      heard: ([best, ...others], began) => {
        at("sofar").textContent = "";
        const alternatives = others.filter((o) => o.text && o.text !== best.text && o.p > 0 && o.p <= 1);
        outbox.add(robot(), { text: best.text, lang: lang(), alternatives }, began);
      },
      // Only then is there room for another.
      ended: () => (stop = undefined),
    });
  };
  const end = () => {
    button.classList.remove("held");
    stop?.();
  };
  button.addEventListener("pointerdown", begin);
  button.addEventListener("pointerup", end);
  button.addEventListener("pointercancel", end);
  button.addEventListener("contextmenu", (event) => event.preventDefault());
  button.addEventListener("keydown", (event) => [" ", "Enter"].includes(event.key) && !event.repeat && begin(event));
  button.addEventListener("keyup", (event) => [" ", "Enter"].includes(event.key) && end());
  button.addEventListener("blur", end);
}

async function keepAwake() {
  try {
    await navigator.wakeLock?.request("screen");
  } catch {
    // The battery is low, or the page is hidden.
  }
}

const tellGoes = async () => (at("goes").textContent = await whereItGoes(lang()));
outbox = new Outbox(show, (why) => (at("warning").textContent = why));
outbox.again();
at("typed").addEventListener("submit", (event) => {
  event.preventDefault();
  const text = at("text").value.trim();
  if (!text) return;
  outbox.add(robot(), { text, lang: lang() });
  at("text").value = "";
});
at("robot").addEventListener("change", () => localStorage.setItem("toponym.robot", robot()));
at("lang").addEventListener("change", tellGoes);
document.addEventListener("visibilitychange", () => {
  if (document.visibilityState !== "visible") return;
  keepAwake();
  // What was told while the page slept was not heard.
  outbox.again();
});
addEventListener("offline", () => connection(false));
listen({
  heard: (heard) => outbox.heard(heard),
  state: () => maps.size || findRobots().catch(() => {}),
  missed: () => outbox.again(),
}, connection);
findRobots().catch(() => {});
talk();
keepAwake();
tellGoes();
navigator.serviceWorker?.register("/sw.js").catch(() => {});
