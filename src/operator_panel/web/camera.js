// The camera beside or in place of the model: pictures are asked for one after the other, only while they can be seen.
const RETRY_MS = 1000;
const PATIENCE_MS = 10_000;
const KEPT = "panel_show";

export class Camera {
  constructor() {
    this.card = document.querySelector(".stage");
    this.image = document.querySelector("[data-camera]");
    this.text = document.querySelector("[data-camera-text]");
    this.buttons = [...document.querySelectorAll("[data-show]")];
    this.stamp = this.trouble = "";
    new MutationObserver(() => this.say(this.trouble)).observe(document.body, { attributeFilter: ["class"] });
    for (const button of this.buttons) button.addEventListener("click", () => this.show(button.dataset.show));
    const kept = localStorage.getItem(KEPT);
    this.show(this.buttons.some((button) => button.dataset.show === kept) ? kept : this.buttons[0].dataset.show);
    this.run();
  }

  show(name) {
    this.shown = name;
    this.card.dataset.shows = name.toLowerCase();
    for (const button of this.buttons) button.setAttribute("aria-selected", button.dataset.show === name);
    localStorage.setItem(KEPT, name);
    window.dispatchEvent(new Event("resize")); // charts have no size while they are not shown
    this.wake?.();
  }

  get seen() {
    return (this.shown === "Both" || this.shown === "Camera") && !document.hidden;
  }

  async run() {
    for (;;) {
      if (!this.seen) await this.pause();
      else if (!(await this.next())) await this.pause();
    }
  }

  // Wait a second, or until another view is chosen.
  pause() {
    return new Promise((resolve) => {
      this.wake = resolve;
      setTimeout(resolve, RETRY_MS);
    });
  }

  // Show the next picture; return whether there was one.
  async next() {
    try {
      const answer = await fetch(`/camera.jpg?after=${this.stamp}`, { signal: AbortSignal.timeout(PATIENCE_MS) });
      if (!answer.ok) {
        this.say((await answer.json()).error);
        return false;
      }
      this.stamp = answer.headers.get("X-Stamp");
      await this.put(await answer.blob());
      this.say("");
      return true;
    } catch {
      this.say("No connection");
      return false;
    }
  }

  // The picture in view is replaced only when the next one can be drawn: it never goes blank.
  async put(blob) {
    const shown = this.image;
    const next = shown.cloneNode();
    next.src = URL.createObjectURL(blob);
    try {
      await next.decode();
    } catch (error) {
      URL.revokeObjectURL(next.src);
      throw error;
    }
    shown.replaceWith(next);
    this.image = next;
    if (shown.src) URL.revokeObjectURL(shown.src);
  }

  // A picture that is not current is shown as such, and one of now beside a model of then.
  say(trouble) {
    this.trouble = trouble;
    this.card.classList.toggle("camera-old", trouble !== "");
    const told = document.body.matches(".is-past") ? "Camera: now" : "Camera";
    const text = trouble ? trouble[0].toUpperCase() + trouble.slice(1) : told;
    if (this.text.textContent !== text) this.text.textContent = text;
  }
}
