// The browser's own recogniser, where it has one: it listens while the button is held.

const Recognition = globalThis.SpeechRecognition ?? globalThis.webkitSpeechRecognition;
const GUESSES = 5;

export const canListen = () => Boolean(Recognition) && globalThis.isSecureContext;

/** Whether this device understands a language by itself. */
async function onDevice(lang) {
  try {
    return (await Recognition.available?.({ langs: [lang], processLocally: true })) === "available";
  } catch {
    // An older browser: it does not tell, and does not.
    return false;
  }
}

/** Where what is said goes: to be told before anybody talks. */
export async function whereItGoes(lang) {
  if (!Recognition) return "This browser has no recogniser: type, or use your keyboard's dictation.";
  if (!globalThis.isSecureContext) return "A microphone needs an encrypted page: type, or use your keyboard's dictation.";
  return (await onDevice(lang))
    ? "What you say is understood on this device."
    : "What you say goes to your browser's maker to be understood; only the words come here.";
}

/**
 * Listens until what it returns is called; then hands over all that was said meanwhile, as guesses with the likeliest
 * first. A browser that stops by itself before is started again.
 */
export function listen({ lang, heard, soFar, failed, ended }) {
  const began = Date.now();
  let held = true;
  let parts = [];
  let before = [];
  let error = null;
  let recognition;
  const begin = async () => {
    recognition = new Recognition();
    Object.assign(recognition, { lang, continuous: true, interimResults: true, maxAlternatives: GUESSES });
    if ("processLocally" in recognition) recognition.processLocally = await onDevice(lang);
    recognition.onresult = (event) => {
      // All of it anew: some browsers tell each result several times, and more of it each time.
      parts = Array.from(event.results, (result) =>
        Array.from(result, (guess) => ({ text: guess.transcript.trim(), p: guess.confidence })));
      soFar([...before, ...parts].map(([best]) => best.text).join(" "));
    };
    recognition.onerror = (event) => (error = event.error);
    recognition.onend = () => {
      before = [...before, ...parts];
      parts = [];
      if (held && !error) begin();
      else finish();
    };
    if (held) recognition.start();
    else finish();
  };
  const finish = () => {
    const all = before.filter(([best]) => best?.text);
    if (all.length === 1) heard(all[0], began);
    // Of several pieces the likeliest of each, together.
    else if (all.length) heard([{ text: longest(all.map(([best]) => best.text)), p: 0 }], began);
    else if (error) failed(error);
    else soFar("");
    ended();
  };
  begin().catch((why) => {
    error = why.message;
    finish();
  });
  return () => {
    held = false;
    recognition?.stop();
  };
}

/** Pieces in a row; one that only begins the next is not said twice. */
function longest(texts) {
  const said = texts.filter((text, k) => !texts[k + 1]?.toLowerCase().startsWith(text.toLowerCase()));
  return said.join(" ");
}
