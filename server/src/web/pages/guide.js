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
const told = new Set();
let current = [];

const robot = () => at("robot").value || "any";
const lang = () => at("lang").value;

function sentenceItem(s) {
  const buttons = [];
  if (s.state === "asked") {
    for (const answer of ["yes", "no"]) {
      const reply = () => outbox.add(s.robot, { text: answer, answers: s.id });
      buttons.push(element("button", { type: "button", onclick: reply }, answer));
    }
  }
  if (s.state === "understood" && !s.undone) {
    buttons.push(element("button", { type: "button", onclick: () => undo(s) }, "Not that"));
  }
  const state = s.undone ? "taken back" : s.late ? `${STATES[s.state]}: ${s.late}` : STATES[s.state] ?? s.state;
  const time = new Date(s.saidAt).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" });
  return element("li", { class: s.undone ? "undone" : s.state },
    element("p", { class: "said" }, s.sentence.text),
    element("p", { class: "state" }, `${MARKS[s.state] ?? ""} ${time}, ${state}${s.durable && s.done ? ", on disk" : ""}`),
    s.words ? element("p", { class: "words" }, s.words) : undefined,
    ...buttons);
}

function show(sentences) {
  current = sentences;
  const list = at("sentences");
  const atEnd = list.scrollHeight - list.scrollTop - list.clientHeight < 80;
  list.replaceChildren(...sentences.map(sentenceItem));
  if (atEnd) list.scrollTop = list.scrollHeight;
  for (const s of sentences.filter((s) => s.done && !told.has(s.id))) {
    told.add(s.id);
    if (document.readyState !== "complete" || Date.now() - s.saidAt > 60_000) continue;
    navigator.vibrate?.(s.state === "understood" ? 60 : [60, 80, 60]);
    if (at("aloud").checked && s.words) {
      speechSynthesis?.speak(Object.assign(new SpeechSynthesisUtterance(s.words), { lang: "en" }));
    }
  }
}

async function undo(s) {
  try {
    const mended = await command("undo", { id: s.id, map: maps.get(s.robot) });
    s.undone = true;
    s.words = mended.words;
  } catch (error) {
    s.words = error.message;
  }
  outbox.keep();
}

/** Robot → its map. */
const maps = new Map();

async function findRobots() {
  const info = await ask("/info");
  const chosen = at("robot").value || localStorage.getItem("toponym.robot");
  maps.clear();
  for (const state of info.robots) if (state.map) maps.set(state.robot, state.map);
  at("robot").replaceChildren(...[...maps.keys()].map((id) => element("option", { value: id, selected: id === chosen }, id)));
}

function connected(is) {
  const waiting = current.filter((s) => !s.sent && !s.done).length;
  at("connection").textContent = is ? "connected" : `no connection: what you say is kept${waiting ? ` (${waiting} waiting)` : ""}`;
  at("connection").className = is ? "good" : "bad";
  if (is) {
    outbox.again();
    findRobots().catch(() => {});
  }
}

function talk() {
  const button = at("talk");
  button.hidden = !(canListen() && globalThis.isSecureContext);
  let stop;
  const begin = (event) => {
    event.preventDefault();
    if (stop) return;
    button.classList.add("held");
    button.setPointerCapture?.(event.pointerId ?? 0);
    stop = listenTo({
      lang: lang(),
      soFar: (text) => (at("sofar").textContent = text),
      failed: (why) => (at("sofar").textContent = `not heard: ${why}`),
      heard: ([best, ...others], began) => {
        const alternatives = others.filter((o) => o.text && o.text !== best.text && o.p > 0 && o.p <= 1);
        outbox.add(robot(), { text: best.text, lang: lang(), alternatives }, began);
      },
    });
  };
  const end = () => {
    button.classList.remove("held");
    stop?.();
    stop = undefined;
  };
  button.addEventListener("pointerdown", begin);
  button.addEventListener("pointerup", end);
  button.addEventListener("pointercancel", end);
  button.addEventListener("contextmenu", (event) => event.preventDefault());
  button.addEventListener("keydown", (event) => [" ", "Enter"].includes(event.key) && !event.repeat && begin(event));
  button.addEventListener("keyup", (event) => [" ", "Enter"].includes(event.key) && end());
}

async function keepAwake() {
  try {
    await navigator.wakeLock?.request("screen");
  } catch {
    // The battery is low, or the page is hidden.
  }
}

const outbox = new Outbox(show);
show(outbox.sentences);
at("typed").addEventListener("submit", (event) => {
  event.preventDefault();
  const text = at("text").value.trim();
  if (!text) return;
  outbox.add(robot(), { text, lang: lang() });
  at("text").value = "";
});
at("robot").addEventListener("change", () => localStorage.setItem("toponym.robot", robot()));
at("lang").addEventListener("change", async () => (at("goes").textContent = await whereItGoes(lang())));
document.addEventListener("visibilitychange", () => document.visibilityState === "visible" && keepAwake());
addEventListener("offline", () => connected(false));
listen({ heard: (heard) => outbox.heard(heard), state: () => maps.size || findRobots().catch(() => {}) }, connected);
findRobots().catch(() => {});
talk();
keepAwake();
at("goes").textContent = await whereItGoes(lang());
navigator.serviceWorker?.register("/sw.js").catch(() => {});
