// In the place of the browser's recogniser: what it hears is what a test puts there.
globalThis.toBeHeard = [];
globalThis.SpeechRecognition = globalThis.webkitSpeechRecognition = class extends EventTarget {
  start() {
    const guesses = globalThis.toBeHeard.shift() ?? [];
    setTimeout(() => {
      const result = guesses.map(([transcript, confidence]) => ({ transcript, confidence }));
      if (result.length) this.onresult?.({ results: [Object.assign(result, { isFinal: true })] });
    });
  }

  stop() {
    setTimeout(() => this.onend?.());
  }
};
