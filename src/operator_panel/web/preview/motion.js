// A judged motion over the picture: the verdict, a ghost that makes it, and how near and how fast it is then.
const CURVES = ["clearance", "speed"];
const UNITS = { clearance: "mm", speed: "mm/s" };
const WIDTH = 100, HEIGHT = 30; // of a drawing, as in its viewBox

export class MotionLine {
  // show(pose): put the ghost there, null takes it away; opened(): somebody looks at a motion now.
  constructor(show, opened) {
    this.show = show;
    this.opened = opened;
    this.place = document.querySelector("[data-motion]");
    this.words = this.place.querySelector("[data-motion-words]");
    this.range = this.place.querySelector("[data-motion-range]");
    this.button = this.place.querySelector("[data-motion-play]");
    this.text = this.place.querySelector("[data-motion-at]");
    this.motion = null;
    this.target = null; // the pose that a typed position leads to
    this.asked = null; // title of the motion that somebody looks at; an answer to another one is old
    this.at = 0;
    this.begun = null;
    this.range.addEventListener("input", () => this.halt(Number(this.range.value)));
    this.button.addEventListener("click", () => (this.begun === null ? this.play() : this.halt(this.at)));
    this.place.querySelector("[data-motion-close]").addEventListener("click", () => this.close());
  }

  get isOpen() {
    return !this.place.hidden;
  }

  // Somebody types another position: what was judged is of the one before. The answer about what is typed comes
  // later, perhaps after a preview that was asked for meanwhile: that one stays.
  typed() {
    if (this.isOpen) this.close();
  }

  // The ghost of a position that was typed.
  aim(pose) {
    this.target = pose;
    if (!this.isOpen) this.show(pose);
  }

  wait(title) {
    this.open();
    this.asked = title;
    this.motion = null;
    this.begun = null;
    this.show(null);
    this.say(`${title}: judging ...`, "");
    this.place.classList.add("is-empty");
  }

  take(motion) {
    if (motion.title !== this.asked) return;
    this.motion = motion;
    this.say(`${motion.title}: ${motion.sentence}`, motion.tone);
    const length = motion.times.at(-1) || 0;
    this.place.classList.toggle("is-empty", length === 0);
    if (length === 0) return this.show(null);
    this.range.max = length;
    for (const name of CURVES) this.draw(name, motion[name], length);
    this.put(0);
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.play();
  }

  open() {
    if (this.isOpen) return;
    this.opened();
    this.place.hidden = false;
    document.body.classList.add("is-preview");
    this.place.scrollIntoView({ block: "nearest" });
  }

  close() {
    this.begun = null;
    this.motion = null;
    this.asked = null;
    this.place.hidden = true;
    document.body.classList.remove("is-preview");
    this.show(this.target);
  }

  say(text, tone) {
    this.words.textContent = text;
    this.words.dataset.is = tone;
  }

  play() {
    const length = this.motion.times.at(-1);
    if (this.at >= length) this.at = 0;
    this.begun = performance.now() - 1000 * this.at;
    this.button.textContent = "Halt";
    const motion = this.motion;
    const step = (now) => {
      if (this.begun === null || this.motion !== motion) return;
      const at = Math.max(0, (now - this.begun) / 1000);
      if (at >= length) return this.halt(length);
      this.put(at);
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  halt(at) {
    this.begun = null;
    this.button.textContent = "Play";
    if (this.motion) this.put(at);
  }

  // Show one instant: ghost, slider, numbers and the line in both drawings.
  put(at) {
    const { times, pose } = this.motion;
    const length = times.at(-1);
    this.at = Math.min(at, length);
    const place = (this.at / length) * (times.length - 1);
    const low = Math.min(Math.floor(place), times.length - 2);
    const part = place - low;
    const between = (values) => values[low] + part * (values[low + 1] - values[low]);
    this.show(Object.fromEntries(Object.entries(pose).map(([name, q]) => [name, between(q)])));
    this.range.value = this.at;
    this.text.textContent = `${this.at.toFixed(2)} of ${length.toFixed(2)} s`;
    for (const name of CURVES) {
      const values = this.motion[name];
      const known = values[low] !== null && values[low + 1] !== null;
      this.place.querySelector(`[data-motion-now=${name}]`).textContent = known ? `${between(values).toFixed(0)} ${UNITS[name]}` : "not known";
      move(this.drawing(name).querySelector(".now"), this.at / length);
    }
  }

  drawing(name) {
    return this.place.querySelector(`[data-motion-curve=${name}]`);
  }

  draw(name, values, length) {
    const most = Math.max(...values.filter((value) => value !== null), 1e-9);
    let pen = "M";
    const points = values.map((value, k) => {
      if (value === null) {
        pen = "M";
        return "";
      }
      const point = `${pen}${((WIDTH * k) / (values.length - 1)).toFixed(2)} ${(HEIGHT * (1 - (0.94 * value) / most)).toFixed(2)}`;
      pen = "L";
      return point;
    });
    const drawing = this.drawing(name);
    drawing.querySelector("path").setAttribute("d", points.join(""));
    const wrong = drawing.querySelector(".wrong");
    wrong.style.display = this.motion.at === null ? "none" : "";
    if (this.motion.at !== null) move(wrong, this.motion.at / length);
  }
}

function move(line, share) {
  for (const end of ["x1", "x2"]) line.setAttribute(end, WIDTH * share);
}
