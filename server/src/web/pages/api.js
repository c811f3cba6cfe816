// Questions, commands and events. Paths are the keys of the protocol after toponym/v1/{site}.

async function answered(response) {
  const json = response.headers.get("content-type")?.startsWith("application/json");
  const body = json ? await response.json() : null;
  if (response.ok) return body;
  const problem = body?.error ?? { code: "internal", message: `${response.status} ${response.statusText}` };
  throw Object.assign(new Error(problem.message), { problem, status: response.status });
}

function query(parameters) {
  const given = Object.entries(parameters).filter(([, value]) => value !== undefined && value !== "");
  return given.length ? "?" + given.map(([name, value]) => `${name}=${encodeURIComponent(value)}`).join("&") : "";
}

export const ask = async (path, parameters = {}) => answered(await fetch(path + query(parameters)));

export const command = async (name, parameters = {}) =>
  answered(await fetch(`/do/${name}${query(parameters)}`, { method: "POST" }));

export const say = async (robot, sentence) =>
  answered(await fetch(`/robot/${robot}/say`, {
    method: "POST",
    headers: { "content-type": "application/json" },
    body: JSON.stringify(sentence),
    signal: AbortSignal.timeout(ANSWER_MS),
  }));

/** How long an answer may take. */
const ANSWER_MS = 15_000;
/** A stream of events that was refused is tried again after this. */
const AGAIN_MS = 3000;

/** Events as they come: `handlers` by name; `connection` is told whether there is one. */
export function listen(handlers, connection) {
  const source = new EventSource("/events");
  source.onopen = () => connection(true);
  source.onerror = () => {
    connection(false);
    // A browser tries again by itself, but not after an answer that is none.
    if (source.readyState === EventSource.CLOSED) setTimeout(() => listen(handlers, connection), AGAIN_MS);
  };
  for (const [name, handle] of Object.entries(handlers)) {
    source.addEventListener(name, (event) => handle(JSON.parse(event.data)));
  }
}

const LETTERS = "0123456789ABCDEFGHJKMNPQRSTVWXYZ";

/** A ULID: 48 bits of time, 80 of chance. */
export function newId(now = Date.now()) {
  let time = "";
  for (let k = 0, left = now; k < 10; k++, left = Math.floor(left / 32)) time = LETTERS[left % 32] + time;
  const chance = crypto.getRandomValues(new Uint8Array(16));
  return time + Array.from(chance, (byte) => LETTERS[byte % 32]).join("");
}

/** An element with attributes and children; texts are texts, never HTML. */
export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value !== undefined && value !== false) made.setAttribute(key, value === true ? "" : value);
  }
  made.append(...children.filter((child) => child !== undefined));
  return made;
}
