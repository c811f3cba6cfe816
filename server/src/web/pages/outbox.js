// Sentences until it is known what became of them: kept in the browser, each by its id, sent in their order, and again
// under the same id until the server has told how it ended.

import { newId, say } from "./api.js";

const KEPT = "toponym.said.";
const AGAIN_MS = [500, 1000, 2000, 4000, 8000];
/** Of those that are done so many are kept to be shown. */
const DONE_MAX = 50;
/** What is wrong with the sentence itself: it would be refused again. All else is tried again. */
const WRONG = [400, 413, 415, 422];
const NOT_YET = ["busy", "internal", "robot_ambiguous", "no_such_robot"];

/** Whether a reading (PROTOCOL.md) tells the map nothing. */
const onlyAsks = (reading) => Boolean(reading) && reading.split("&").every((act) => /^(ask\(|none)/.test(act));

export class Outbox {
  /** `changed` is called with all sentences, the newest last; `warn` with what keeps them from being kept. */
  constructor(changed, warn) {
    this.changed = changed;
    this.warn = warn;
    /** What could not be stored: lost with the page. */
    this.unstored = new Map();
    /** Those that the server has had since it was last connected to. */
    this.sent = new Set();
    this.tries = 0;
    this.sending = false;
    addEventListener("online", () => this.again());
    addEventListener("storage", (event) => event.key?.startsWith(KEPT) && this.show());
  }

  /** All of them, in the order in which they were said. */
  all() {
    const kept = new Map(this.unstored);
    try {
      for (const key of Object.keys(localStorage)) {
        if (!key.startsWith(KEPT) || kept.has(key.slice(KEPT.length))) continue;
        try {
          const sentence = JSON.parse(localStorage.getItem(key));
          kept.set(sentence.id, sentence);
        } catch {
          localStorage.removeItem(key);
        }
      }
    } catch {
      // A browser that keeps nothing.
    }
    return [...kept.values()].sort((a, b) => a.addedAt - b.addedAt || (a.id < b.id ? -1 : 1));
  }

  find(id) {
    return this.all().find((s) => s.id === id);
  }

  keep(sentence) {
    try {
      localStorage.setItem(KEPT + sentence.id, JSON.stringify(sentence));
      this.unstored.delete(sentence.id);
    } catch {
      this.unstored.set(sentence.id, sentence);
      this.warn("This browser's storage is full or shut: what you say is lost if the page is closed before it is sent.");
    }
  }

  /** Changes one, as it is now. */
  change(id, how) {
    const sentence = this.find(id);
    if (!sentence) return;
    how(sentence);
    this.keep(sentence);
    this.show();
  }

  show() {
    const all = this.all();
    const done = all.filter((s) => s.done);
    for (const { id } of done.slice(0, Math.max(0, done.length - DONE_MAX))) {
      this.unstored.delete(id);
      try {
        localStorage.removeItem(KEPT + id);
      } catch {
        // As above.
      }
    }
    this.changed(this.all());
  }

  /** Takes a sentence that began at `saidAt` (ms); sends it as soon as there is a connection. */
  add(robot, sentence, saidAt = Date.now()) {
    const newest = this.all().at(-1)?.addedAt ?? 0;
    const addedAt = Math.max(Date.now(), newest + 1);
    this.keep({ id: newId(), robot, sentence, saidAt, addedAt, state: "waiting", words: "", done: false });
    this.show();
    this.send();
  }

  /** What is told of one of them, by an event or as an answer. What is done stays done. */
  heard(heard) {
    if (heard.status === "refused" && NOT_YET.includes(heard.error?.code)) return;
    const known = this.find(heard.id);
    if (!known || known.done) return;
    this.change(heard.id, (s) => {
      s.state = heard.status;
      s.words = heard.question ?? (heard.words || heard.error?.message || "");
      s.durable = s.durable || heard.durable;
      s.asks = onlyAsks(heard.parse);
      s.late = undefined;
      s.done = heard.status !== "read";
    });
  }

  /** There is a connection, perhaps after something was missed: all that is not done is asked for again. */
  again() {
    this.tries = 0;
    this.sent.clear();
    clearTimeout(this.timer);
    this.show();
    this.send();
  }

  waiting() {
    return this.all().filter((s) => !s.done && !this.sent.has(s.id));
  }

  async send() {
    if (this.sending) return;
    this.sending = true;
    try {
      // One page of a browser sends at a time, or two would send out of order.
      const work = () => this.sendAll();
      if (navigator.locks) await navigator.locks.request("toponym.outbox", work);
      else await work();
    } finally {
      this.sending = false;
      if (this.waiting().length) {
        const wait = AGAIN_MS[Math.min(this.tries++, AGAIN_MS.length - 1)];
        clearTimeout(this.timer);
        this.timer = setTimeout(() => this.send(), wait);
      }
    }
  }

  async sendAll() {
    for (let next; (next = this.waiting()[0]); ) {
      const ago_s = Math.max(0, (Date.now() - next.saidAt) / 1000);
      try {
        const heard = await say(next.robot, { ...next.sentence, id: next.id, ago_s });
        if (!heard?.status) throw new Error("somebody else answers in the server's place");
        this.heard(heard);
      } catch (error) {
        const code = error.problem?.code;
        if (!(code && WRONG.includes(error.status) && !NOT_YET.includes(code))) {
          this.change(next.id, (s) => (s.late = error.problem?.message ?? "no connection"));
          return;
        }
        this.heard({ id: next.id, status: "refused", words: error.message, error: error.problem, durable: false });
      }
      this.tries = 0;
      this.sent.add(next.id);
    }
  }
}
