// The time line: picture, numbers and charts of a moment of the last ten minutes. The bar with mode and STOP,
// the commands and the alarms stay live, and everything that is of the past has a frame that says so.
const FORGET_MS = 30000; // the label says how long ago it is; the moment itself does not change

export class TimeLine {
  constructor(handlers) {
    this.handlers = handlers; // show(look), live(), opened()
    this.button = document.querySelector("[data-look-back]");
    this.place = document.querySelector("[data-time-line]");
    this.range = this.place.querySelector("input");
    this.text = document.querySelector("[data-past-text]");
    this.at = null;
    this.asking = false;
    this.button.addEventListener("click", () => (this.at === null ? this.open() : this.close()));
    this.range.addEventListener("input", () => this.ask(this.last + Number(this.range.value)));
    for (const step of this.place.querySelectorAll("[data-past-step]")) {
      step.addEventListener("click", () => this.ask(this.at + Number(step.dataset.pastStep)));
    }
    this.place.querySelector("[data-past-live]").addEventListener("click", () => this.close());
    setInterval(() => this.at !== null && this.say(), FORGET_MS);
  }

  get isPast() {
    return this.at !== null;
  }

  open() {
    this.handlers.opened();
    this.last = Date.now() / 1000;
    this.place.hidden = false;
    this.button.setAttribute("aria-pressed", "true");
    document.body.classList.add("is-past");
    this.ask(this.last);
  }

  close() {
    this.at = null;
    this.place.hidden = true;
    this.button.setAttribute("aria-pressed", "false");
    document.body.classList.remove("is-past");
    this.handlers.live();
  }

  // One question at a time; of those that come meanwhile the last one counts.
  async ask(at) {
    this.at = this.wanted = at;
    if (this.asking) return;
    this.asking = true;
    try {
      let asked = null;
      while (asked !== this.wanted) {
        asked = this.wanted;
        const answer = await fetch(`/past.json?at=${asked}`, { cache: "no-store" });
        const look = await answer.json();
        if (this.at === null) return;
        if (!answer.ok) this.text.textContent = `Not known: ${look.error}`;
        else if (asked === this.wanted) {
          this.show(look);
          asked = this.wanted; // the moment that was found is nearest to the time asked for
        }
      }
    } catch (error) {
      if (this.at !== null) this.text.textContent = `Not known: ${error.message}`;
    } finally {
      this.asking = false;
    }
  }

  show(look) {
    this.at = this.wanted = look.at;
    this.range.min = Math.min(-1, look.first - this.last);
    this.range.value = look.at - this.last;
    this.say();
    this.handlers.show(look);
  }

  say() {
    const clock = new Date(1000 * this.at).toLocaleTimeString([], { hour12: false });
    const ago = Math.max(0, Math.round(Date.now() / 1000 - this.at));
    const words = ago < 60 ? `${ago} s` : `${Math.floor(ago / 60)} min ${ago % 60} s`;
    this.text.textContent = `Past: ${clock}, ${words} ago`;
  }
}
