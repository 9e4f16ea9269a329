// STOP and E-STOP, by button or key, for whoever sees the page. What became of the last press of each stands below
// its button within half a second; where that is not a confirmed stop, the whole width says what to do.
const ANSWER_MS = 500;
const CLICK_MS = 300; // our choice: a click comes right behind the end of its pointer
const AT_THE_ROBOT = "use the stop at the robot";
// A slider takes no space: STOP works while the time line is in hand.
const TYPING = "input:not([type=range]), textarea, select, [contenteditable=true]";
const KEPT = "stop_failures";
// In these modes a confirmed stop is in force; only a reset leads from RESET_MODES to STOPPED.
const IN_FORCE = { STOP: ["STOPPED", "STANDSTILL", "ESTOP"], ESTOP: ["ESTOP"] };
const RESET_MODES = ["ESTOP", "FAULT", "STANDSTILL"];

export class Stop {
  constructor(live) {
    this.live = live;
    this.trouble = "";
    this.mode = "";
    this.silent = false;
    // command -> { press, timer, failure, told: when [ms], confirmed: when [ms], obeyed: a mode has shown it }
    this.presses = new Map();
    for (const button of document.querySelectorAll("[data-stop]")) {
      this.watch(button);
    }
    window.addEventListener("keydown", (event) => this.key(event), true);
    this.restore();
  }

  // What failed still stands there when the page has loaded itself again.
  keep() {
    const failed = [...this.presses].filter(([, last]) => last.failure);
    sessionStorage.setItem(KEPT, JSON.stringify(failed.map(([command, { failure }]) => [command, failure])));
  }

  restore() {
    for (const [command, failure] of JSON.parse(sessionStorage.getItem(KEPT)) || []) {
      this.presses.set(command, { press: 0, failure, told: performance.now() });
      this.showBanner();
    }
    sessionStorage.removeItem(KEPT);
  }

  // By a pointer and by Enter when it goes down. A screen reader, a voice or a switch only clicks.
  watch(button) {
    const send = () => this.send(button.dataset.stop);
    let isDown = false;
    button.addEventListener("pointerdown", () => {
      isDown = true;
      send();
    });
    // A pointer that goes up elsewhere clicks nothing: the next click is a press of its own.
    for (const end of ["pointerup", "pointercancel"]) {
      window.addEventListener(end, () => setTimeout(() => (isDown = false), CLICK_MS));
    }
    button.addEventListener("click", (event) => {
      if (event.detail === 0 || !isDown) send();
      isDown = false;
    });
    button.addEventListener("keydown", (event) => {
      if (event.key !== "Enter") return;
      event.preventDefault(); // else a click follows
      if (!event.repeat) send();
    });
    // Space has sent STOP: some browsers would click this button too when it goes up.
    button.addEventListener("keyup", (event) => event.code === "Space" && event.preventDefault());
  }

  // Escape stops always, space wherever it is not typed into a field.
  key(event) {
    const isSpace = event.code === "Space" && !event.target.closest?.(TYPING);
    const isEscape = event.code === "Escape" || event.key === "Escape"; // it may lie on another key
    if (!isEscape && !isSpace) return;
    if (isSpace) event.preventDefault(); // else it would press the focused button too
    if (isSpace) event.stopPropagation();
    if (!event.repeat) this.send("STOP");
  }

  send(command) {
    const press = (this.presses.get(command)?.press || 0) + 1;
    clearTimeout(this.presses.get(command)?.timer);
    this.presses.set(command, { press, failure: "" });
    if (!this.live.send({ stop: command, press })) {
      this.show(command, "not sent", "there is no connection to the page's server");
      return;
    }
    this.say(command, "", "sent", "");
    this.presses.get(command).timer = setTimeout(
      () => this.show(command, "not confirmed", "the page's server has not answered within 0.5 s"),
      ANSWER_MS,
    );
  }

  // An answer to an older press says nothing of the last one.
  answered({ command, press, confirmed, success, text }) {
    const last = this.presses.get(command);
    if (last?.press !== press) return;
    clearTimeout(last.timer);
    if (confirmed && success) last.confirmed = performance.now();
    if (confirmed && success) this.show(command, "", text);
    else this.show(command, confirmed ? "refused" : "not confirmed", text);
  }

  show(command, failure, text) {
    const sentence = `${text.charAt(0).toUpperCase()}${text.slice(1)}.`;
    const last = this.presses.get(command);
    last.failure = failure && `${command} ${failure}: ${AT_THE_ROBOT}. ${sentence}`;
    last.told = performance.now();
    this.say(command, failure ? "bad" : "good", failure || "confirmed", text);
    this.showBanner();
  }

  say(command, tone, word, title) {
    const place = document.querySelector(`[data-stop-answer="${command}"]`);
    place.textContent = word;
    place.dataset.is = tone;
    place.title = title;
  }

  // Each frame says in which mode the pair is, and whether the controller and its line for STOP are heard.
  look(frame) {
    const trouble = frame.no_stop || "";
    const silent = Boolean(frame.silent);
    if ((silent && !this.silent) || (trouble && !this.trouble)) this.forget();
    const before = this.mode;
    [this.mode, this.silent] = [frame.mode || "", silent];
    const reset = this.mode === "STOPPED" && RESET_MODES.includes(before);
    for (const [command, last] of this.presses) {
      const inForce = IN_FORCE[command].includes(this.mode) && !reset;
      if (inForce && last.failure && !silent) this.settle(command, last);
      if (!last.confirmed) continue;
      // The mode of a moment before the stop may come behind its answer.
      const changed = this.mode !== before && performance.now() - last.confirmed > ANSWER_MS;
      if (inForce) last.obeyed = true;
      else if (last.obeyed || reset || changed) this.withdraw(command, last);
    }
    this.showTrouble(trouble);
  }

  // What was confirmed over a connection that is lost says nothing of now.
  forget() {
    for (const [command, last] of this.presses) if (last.confirmed) this.withdraw(command, last);
  }

  // Whatever became of the press, both are stopped now: nothing is left to do at the robot.
  settle(command, last) {
    if (performance.now() - last.told < ANSWER_MS) return; // it may be the mode of a moment before
    last.failure = "";
    this.withdraw(command, last);
    this.showBanner();
  }

  withdraw(command, last) {
    last.confirmed = 0;
    this.say(command, "", "", "");
  }

  // The server tests its own connection all the time and tells why no STOP would get through.
  showTrouble(text) {
    if (text === this.trouble) return;
    this.trouble = text;
    this.showBanner();
  }

  showBanner() {
    // What is so now comes first.
    const failure = this.trouble || [...this.presses.values()].map((last) => last.failure).find((text) => text) || "";
    document.body.classList.toggle("no-stop", failure !== "");
    document.querySelector(".no-stop-text").textContent = failure;
  }
}
