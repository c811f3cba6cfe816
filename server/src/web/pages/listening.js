// The browser's own recogniser, where it has one: held while the button is.

const Recognition = globalThis.SpeechRecognition ?? globalThis.webkitSpeechRecognition;
const GUESSES = 5;

export const canListen = () => Boolean(Recognition);

/** Where what is said goes: to be told before anybody talks. */
export async function whereItGoes(lang) {
  if (!Recognition) return "This browser has no recogniser: type, or use your keyboard's dictation.";
  if (!globalThis.isSecureContext) return "A microphone needs an encrypted page: type, or use your keyboard's dictation.";
  try {
    const state = await Recognition.available?.({ langs: [lang], processLocally: true });
    if (state === "available") return "What you say is understood on this device.";
  } catch {
    // An older browser: it does not tell.
  }
  return "What you say goes to your browser's maker to be understood; only the words come here.";
}

/** Listens until `stop` is called; calls back with the guesses, likeliest first, and with what it seems to be so far. */
export function listen({ lang, heard, soFar, failed }) {
  const recognition = new Recognition();
  recognition.lang = lang;
  recognition.continuous = true;
  recognition.interimResults = true;
  recognition.maxAlternatives = GUESSES;
  if ("processLocally" in recognition) recognition.processLocally = false;
  const began = Date.now();
  let start = began;
  recognition.onresult = (event) => {
    for (let k = event.resultIndex; k < event.results.length; k++) {
      const result = event.results[k];
      const guesses = Array.from(result, (guess) => ({ text: guess.transcript.trim(), p: guess.confidence }));
      if (!result.isFinal) soFar(guesses[0].text);
      else {
        if (guesses[0].text) heard(guesses, start);
        start = Date.now();
      }
    }
  };
  recognition.onerror = (event) => failed(event.error);
  recognition.onend = () => soFar("");
  recognition.start();
  return () => recognition.stop();
}
