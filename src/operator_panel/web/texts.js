// Texts, bars, tones, lists and banners of the page.
const OUTCOMES = { running: "under way" };
const ENDED = new Set(["done", "stopped", "refused", "lost"]);

// What shows a moment of the past while somebody looks back.
const OF_THE_PAST = ".joints-card, .links-card, .scene-card";
// What a place shows of which a moment says nothing.
const UNKNOWN = { text: "", tone: "", bar: [null, null], gauge: 0 };
const OLD_MS = 10_000; // after that long a command that has ended is no news

function clock(date) {
  return date.toLocaleTimeString([], { hour12: false });
}

export class Texts {
  constructor() {
    this.places = new Map();
    for (const [kind, attribute] of [["text", "live"], ["tone", "tone"], ["bar", "bar"], ["gauge", "gauge"]]) {
      const found = new Map();
      for (const place of document.querySelectorAll(`[data-${attribute}]`)) {
        const key = place.dataset[attribute];
        found.set(key, [...(found.get(key) || []), place]);
      }
      this.places.set(kind, found);
    }
    this.silent = null;
  }

  each(kind, values, apply) {
    for (const [key, value] of Object.entries(values || {})) {
      for (const place of this.places.get(kind).get(key) || []) {
        if (this.part(place)) apply(place, value);
      }
    }
  }

  // While somebody looks back, the live frame is for the places that stay live.
  show(frame, onlyLive = false) {
    this.part = onlyLive ? (place) => !place.closest(OF_THE_PAST) : () => true;
    this.put(frame);
    this.markLine(frame.program || ["", 0]);
    const silent = frame.silent || "";
    if (silent !== this.silent) {
      this.silent = silent;
      document.body.classList.toggle("is-silent", silent !== "");
      document.querySelector(".silent-text").textContent = silent;
    }
  }

  // No number of now stays where the frame of a moment lacks one, as while nobody has said anything yet.
  showPast(frame) {
    this.part = (place) => place.closest(OF_THE_PAST);
    const whole = {};
    for (const [kind, found] of this.places) {
      const unknown = [...found.keys()].map((key) => [key, UNKNOWN[kind]]);
      whole[kind] = { ...Object.fromEntries(unknown), ...frame[kind] };
    }
    this.put(whole);
  }

  put(frame) {
    this.each("text", frame.text, (place, text) => {
      if (place.textContent !== text) place.textContent = text;
    });
    this.each("tone", frame.tone, (place, tone) => {
      if (place.dataset.is !== tone) place.dataset.is = tone;
    });
    this.each("bar", frame.bar, (place, [real, twin]) => {
      this.mark(place.children[0], real);
      this.mark(place.children[1], twin);
    });
    this.each("gauge", frame.gauge, (place, share) => {
      const width = `${(100 * share).toFixed(1)}%`;
      if (place.firstElementChild.style.width !== width) place.firstElementChild.style.width = width;
    });
  }

  // The line that the robot's program is in.
  markLine([name, number]) {
    const key = `${name} ${number}`;
    if (key === this.line) return;
    this.line = key;
    for (const item of document.querySelectorAll("[data-program] [data-line]")) {
      const now = item.closest("[data-program]").dataset.program === name && Number(item.dataset.line) === number;
      if (now) item.setAttribute("aria-current", "step");
      else item.removeAttribute("aria-current");
    }
  }

  mark(element, place) {
    const left = place === null ? "" : `${(100 * place).toFixed(2)}%`;
    if (element.style.left !== left) element.style.left = left;
    element.hidden = place === null;
  }

  showLists({ alarms, commands, waiting }) {
    showWorst(alarms);
    const list = document.querySelector("[data-alarms]");
    if (isNews(list, alarms)) {
      list.replaceChildren(...(alarms.length ? alarms.map(alarmLine) : [line("li", "alarm none", "No alarm")]));
    }
    for (const place of document.querySelectorAll("[data-command]")) showCommand(place, commands[place.dataset.command]);
    const open = document.querySelector('[data-events="open"] span, [data-events="open"]');
    open.textContent = `Not acknowledged (${waiting})`;
  }

  lost(since) {
    document.body.classList.add("is-lost");
    document.querySelector(".lost-text").textContent =
      `No connection to the operator panel since ${clock(since)}. Nothing here is current. STOP does not get through: use the stop at the robot. Trying again.`;
  }

  back() {
    document.body.classList.remove("is-lost");
  }
}

export function line(tag, style, text) {
  return Object.assign(document.createElement(tag), { className: style, textContent: text });
}

function alarmLine(alarm) {
  const item = line("li", `alarm ${alarm.level}`, "");
  item.append(line("b", "alarm-source", alarm.source), line("span", "alarm-text", alarm.text));
  if (alarm.remedy) item.append(line("span", "alarm-remedy", alarm.remedy));
  return item;
}

// The worst alarm, and how many more there are: one line, which opens onto all of them.
function showWorst(alarms) {
  const place = document.querySelector("[data-alarm-line]");
  const card = place.closest("details");
  if (!alarms.length) delete card.dataset.level;
  else card.dataset.level = alarms[0].level;
  const more = alarms.length > 1 ? ` (${alarms.length - 1} more)` : "";
  const words = alarms.length ? `${capital(alarms[0].source)}: ${alarms[0].text}${more}` : "No alarm";
  if (isNews(place, words)) place.textContent = words;
}

// Alarms, commands and a count come together: what is the same is not announced again, nor new again.
function isNews(place, content) {
  const told = JSON.stringify(content);
  const isNew = told !== place.told;
  place.told = told;
  return isNew;
}

function capital(text) {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

// One command: what was asked for, where it is, and why; its place has one size whatever stands in it.
function showCommand(place, command) {
  if (!isNews(place, command ?? null)) return;
  place.dataset.is = command?.tone ?? "";
  place.dataset.outcome = command?.outcome ?? "";
  clearTimeout(place.ageing);
  place.classList.remove("is-old");
  if (!command) return place.replaceChildren();
  if (ENDED.has(command.outcome)) place.ageing = setTimeout(() => place.classList.add("is-old"), OLD_MS);
  const head = line("span", "command-head", "");
  head.append(line("b", "command-title", command.title), line("span", "command-outcome", OUTCOMES[command.outcome] || command.outcome));
  const text = line("span", "command-text", `${capital(command.text)} (${command.who}, ${command.clock})`);
  place.replaceChildren(head, text);
}
