// Sentences until it is known what became of them: kept in the browser, sent in their order, again under the same id.

import { newId, say } from "./api.js";

const KEPT = "toponym.outbox";
const AGAIN_MS = [500, 1000, 2000, 4000, 8000];
/** Of those that are done so many are shown. */
const DONE_MAX = 50;

export class Outbox {
  /** `changed` is called with all sentences, the newest last, whenever one changes. */
  constructor(changed) {
    this.changed = changed;
    this.sentences = JSON.parse(localStorage.getItem(KEPT) ?? "[]");
    this.tries = 0;
    this.sending = false;
    addEventListener("online", () => this.again());
    // What another page of this browser has done.
    addEventListener("storage", (event) => {
      if (event.key === KEPT) this.read();
    });
    this.send();
  }

  read() {
    this.sentences = JSON.parse(localStorage.getItem(KEPT) ?? "[]");
    this.changed(this.sentences);
  }

  keep() {
    const done = this.sentences.filter((s) => s.done);
    const old = new Set(done.slice(0, Math.max(0, done.length - DONE_MAX)));
    this.sentences = this.sentences.filter((s) => !old.has(s));
    localStorage.setItem(KEPT, JSON.stringify(this.sentences));
    this.changed(this.sentences);
  }

  /** Takes a sentence that began at `saidAt` (ms); sends it as soon as there is a connection. */
  add(robot, sentence, saidAt = Date.now()) {
    this.read();
    this.sentences.push({ id: newId(saidAt), robot, sentence, saidAt, state: "waiting", words: "", done: false });
    this.keep();
    this.send();
  }

  /** What an event tells of one of them. */
  heard(heard) {
    const of = this.sentences.find((s) => s.id === heard.id);
    if (!of || of.done) return;
    this.settle(of, heard);
    this.keep();
  }

  settle(of, heard) {
    of.state = heard.status;
    of.words = heard.question ?? (heard.words || heard.error?.message || "");
    of.question = heard.question ?? null;
    of.durable = of.durable || heard.durable;
    of.late = undefined;
    of.sent = true;
    of.done = heard.status !== "read";
  }

  again() {
    this.tries = 0;
    clearTimeout(this.timer);
    this.send();
  }

  async send() {
    if (this.sending) return;
    this.sending = true;
    // One page of a browser sends, or two would send out of order.
    const work = () => this.sendAll();
    if (navigator.locks) await navigator.locks.request("toponym.outbox", work);
    else await work();
    this.sending = false;
    if (this.sentences.some((s) => !s.done && !s.sent)) {
      this.timer = setTimeout(() => this.send(), AGAIN_MS[Math.min(this.tries++, AGAIN_MS.length - 1)]);
    }
  }

  async sendAll() {
    this.read();
    for (let next; (next = this.sentences.find((s) => !s.done && !s.sent)); ) {
      const ago_s = (Date.now() - next.saidAt) / 1000;
      let told;
      try {
        told = await say(next.robot, { ...next.sentence, id: next.id, ago_s });
      } catch (error) {
        const final = error.problem && ![408, 429, 502, 503, 504].includes(error.status) && error.status < 500;
        if (!final) {
          next.late = error.problem?.message ?? "no connection";
          this.keep();
          return;
        }
        told = { id: next.id, status: "refused", words: error.message, error: error.problem };
      }
      this.tries = 0;
      this.read();
      const of = this.sentences.find((s) => s.id === told.id);
      if (of) this.settle(of, told);
      this.keep();
    }
  }
}
