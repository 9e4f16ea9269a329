// The time line: picture, numbers, charts and events of a moment, of the last ten minutes or of a recording. The bar
// with mode and STOP, the commands and the alarms stay live, and everything that is not of now has a frame that says so.
import { clockText, momentOf, setZone } from "./past/clock.js";

const FORGET_MS = 30000; // the label says how long ago it is; the moment itself does not change
const NEWEST = 1e11; // later than any moment: the browser's clock may differ from the server's
const NO_ANSWER = "the page's server does not answer";
const AGAIN_MS = 500; // a recording that is still being read is asked again

export class TimeLine {
  constructor(handlers) {
    this.handlers = handlers; // show(look), live(), opened()
    this.button = document.querySelector("[data-look-back]");
    this.place = document.querySelector("[data-time-line]");
    this.range = this.place.querySelector("[data-past-range]");
    this.clock = this.place.querySelector("[data-past-clock]");
    this.wrong = document.querySelector("[data-past-wrong]");
    this.text = document.querySelector("[data-past-text]");
    this.at = null;
    this.asking = false;
    this.button.addEventListener("click", () => (this.at === null ? this.open("") : this.close()));
    this.range.addEventListener("input", () => this.ask(this.base + Number(this.range.value)));
    for (const step of this.place.querySelectorAll("[data-past-step]")) {
      step.addEventListener("click", () => this.ask(this.at + Number(step.dataset.pastStep)));
    }
    this.place.querySelector("[data-past-go]").addEventListener("click", () => this.go());
    this.clock.addEventListener("keydown", (event) => event.key === "Enter" && this.go());
    this.clock.addEventListener("input", () => this.refuse(""));
    for (const back of document.querySelectorAll("[data-past-live]")) back.addEventListener("click", () => this.close());
    document.addEventListener("click", (event) => {
      const button = event.target.closest?.("[data-look-at]");
      if (button) this.open(button.dataset.lookAt);
    });
    setInterval(() => this.at !== null && !this.run && this.look && this.say(), FORGET_MS);
    setInterval(() => this.isReading && this.ask(this.target), AGAIN_MS);
  }

  get isPast() {
    return this.at !== null;
  }

  // A recording begins at its start, the last ten minutes at their end.
  open(run) {
    this.handlers.opened();
    this.run = run;
    this.look = null;
    this.isReading = false;
    this.base = run ? 0 : NEWEST;
    this.place.hidden = false;
    this.clock.value = "";
    this.refuse("");
    this.button.setAttribute("aria-pressed", "true");
    document.body.classList.add("is-past");
    document.body.classList.toggle("is-recording", run !== "");
    if (run) this.tell("being opened");
    if (run) this.bringHere();
    this.ask(this.base);
  }

  // Where the list of recordings stands below the picture, whoever opens one sees its picture.
  bringHere() {
    const { top, bottom } = document.querySelector(".scene-card").getBoundingClientRect();
    if (bottom > window.innerHeight || top < 0) window.scrollBy(0, bottom - window.innerHeight);
  }

  close() {
    this.at = null;
    this.run = "";
    this.isReading = false;
    this.place.hidden = true;
    this.button.setAttribute("aria-pressed", "false");
    document.body.classList.remove("is-past", "is-recording");
    this.handlers.live();
  }

  // To the time of day that is typed; one that is not in here changes nothing but the text that says so.
  async go() {
    if (!this.look) return this.refuse("The recording is still being opened.");
    const run = this.run;
    let { first, last } = this.look;
    if (run) last = this.look.ends;
    else [first, last] = await this.remembered();
    if (this.at === null || run !== this.run || !this.look) return; // another one was opened meanwhile
    const { at, wrong } = momentOf(this.clock.value, first, last);
    this.refuse(wrong || "");
    if (!wrong) this.ask(at);
  }

  // From when to when the server remembers: it goes on while somebody looks back.
  async remembered() {
    try {
      const answer = await fetch(`/past.json?at=${NEWEST}`, { cache: "no-store" });
      if (answer.ok) {
        const { first, last } = await answer.json();
        return [first, last];
      }
    } catch {
      this.refuse(NO_ANSWER);
    }
    return [this.look.first, this.look.last];
  }

  refuse(why) {
    this.wrong.textContent = why;
    this.clock.setAttribute("aria-invalid", why !== "");
  }

  // One question at a time; of those that come meanwhile the last one counts.
  async ask(at) {
    this.at = this.wanted = this.target = at; // a target that is not read yet is asked for again
    if (this.asking) return;
    this.asking = true;
    try {
      let asked = null;
      while (asked !== this.wanted) {
        asked = this.wanted;
        const run = this.run;
        const answer = await fetch(`/past.json?at=${asked}&run=${encodeURIComponent(run)}`, { cache: "no-store" });
        const look = await answer.json();
        if (this.at === null) return;
        if (run !== this.run) asked = null; // another one was opened meanwhile
        else if (answer.status === 202) this.isReading = true;
        else if (!answer.ok) this.fail(look.error);
        else if (asked === this.wanted) {
          this.show(look);
          asked = this.wanted; // the moment that was found is nearest to the time asked for
        }
      }
    } catch {
      if (this.at !== null) this.fail(NO_ANSWER);
    } finally {
      this.asking = false;
    }
  }

  show(look) {
    this.look = look;
    setZone(look.zone_s);
    this.ahead = look.last - Date.now() / 1000; // the server's newest moment is of now
    if (this.base === NEWEST) this.base = this.target = look.last;
    this.isReading = this.run !== "" && look.last < look.ends;
    if (this.run) this.base = look.first;
    this.at = this.wanted = look.at;
    this.range.min = this.run ? 0 : Math.min(-1, look.first - this.base);
    this.range.max = this.run ? Math.max(1, look.last - this.base) : Math.max(0, look.at - this.base);
    this.range.step = this.run ? 0.1 : 0.5;
    this.range.value = look.at - this.base;
    this.say();
    this.handlers.show(look);
  }

  fail(why) {
    this.isReading = false;
    this.tell(`not known: ${why}`);
  }

  say() {
    // The nearest moment that is known may be a hair before the one asked for: 14:03:20 does not read 14:03:19.
    const clock = clockText(Math.abs(this.at - this.target) < 0.5 ? this.target : this.at);
    if (!this.run) {
      const ago = Math.max(0, Math.round(Date.now() / 1000 + this.ahead - this.at));
      this.tell(`${clock}, ${length(ago)} ago`, this.look.frame.silent);
      return;
    }
    const { first, last, ends, note } = this.look;
    const read = this.isReading ? `; ${Math.floor((100 * (last - first)) / (ends - first))} % read` : "";
    this.tell(`${clock}, ${length(Math.round(this.at - first))} after its start${read}`, note);
  }

  // What is shown is said in the bar, which never leaves the screen.
  tell(words, note = "") {
    const what = this.run ? `Recording ${this.run}` : "Past";
    this.text.textContent = `Not now. ${what}: ${words}. ${note}`.trim();
  }
}

function length(seconds) {
  return seconds < 60 ? `${seconds} s` : `${Math.floor(seconds / 60)} min ${seconds % 60} s`;
}
