// The wall, the events and the buttons. A card stays the same element for as long as its cell is known, and its place
// is a CSS order, so that nothing jumps away below a finger.
import { showAlarms } from "./alarms.js";
import { offerCells } from "./compare.js";
import { showConfigurations } from "./configurations.js";
import { showFigures } from "./figures.js";
import { ago, byId, make, put } from "./parts.js";

const PERIOD_MS = 1000;
const LOST_MS = 3000;
const MOST_ANSWERS = 200;
const cards = new Map();
const shownEvents = new Set();
let heard = 0;

function button(command, cell) {
  const made = make("button", `button ${command.toLowerCase()}`, command);
  made.type = "button";
  made.dataset.command = command;
  made.dataset.cell = cell;
  made.setAttribute("aria-label", `${command} ${cell}`);
  return made;
}

function newCard(name) {
  const card = make("article", "cell");
  const parts = {
    name: make("h3", "cell-name", name),
    status: make("p", "cell-status"),
    text: make("p", "cell-text"),
    facts: make("p", "cell-facts"),
  };
  const buttons = make("div", "cell-buttons");
  buttons.append(button("PAUSE", name), button("STOP", name));
  card.append(...Object.values(parts), buttons);
  byId("wall").append(card);
  const made = { card, parts };
  cards.set(name, made);
  return made;
}

function showCell(cell, place, now) {
  const { card, parts } = cards.get(cell.name) ?? newCard(cell.name);
  card.style.order = String(place);
  card.dataset.level = String(cell.level);
  card.dataset.status = cell.status;
  put(parts.status, `${cell.status || "starting"} for ${ago(now - cell.since)}`);
  put(parts.text, cell.text);
  const state = cell.state;
  const facts = [];
  if (state?.leader) facts.push(`${state.leader} leads`);
  if (state?.deviation_mm != null) facts.push(`${state.deviation_mm.toFixed(2)} mm apart`);
  if (state) facts.push(`speed cap ${state.speed_percent.toFixed(0)} %`);
  if (state?.holder) facts.push(`held by ${state.holder}`);
  if (state?.remote) facts.push("remote");
  if (cell.missing) facts.push(`${cell.missing} events missing`);
  put(parts.facts, facts.join(" · "));
}

function showEvents(events) {
  const list = byId("events");
  for (const event of [...events].reverse()) {
    const id = `${event.cell} ${event.number} ${event.time}`;
    if (shownEvents.has(id)) continue;
    shownEvents.add(id);
    const line = make("li", "event");
    if (event.stop) line.dataset.is = "bad";
    const time = new Date(event.time * 1000).toLocaleTimeString();
    line.append(make("span", "event-head", `${time} ${event.cell} ${event.kind}`), make("span", "event-text", event.text));
    list.prepend(line);
  }
  while (list.childElementCount > events.length) list.lastElementChild.remove();
  if (shownEvents.size > 20 * Math.max(events.length, 50)) {
    shownEvents.clear();
    for (const event of events) shownEvents.add(`${event.cell} ${event.number} ${event.time}`);
  }
}

function show(wall) {
  const names = new Set(wall.cells.map((cell) => cell.name));
  wall.cells.forEach((cell, place) => showCell(cell, place, wall.now));
  offerCells([...names]);
  for (const [name, { card }] of cards) {
    if (!names.has(name)) {
      card.remove();
      cards.delete(name);
    }
  }
  const lost = wall.cells.filter((cell) => cell.status === "lost").length;
  const bad = wall.cells.filter((cell) => cell.level > 1).length - lost;
  put(byId("summary"), `${wall.cells.length} cells, ${lost} lost, ${bad} need a look`);
  showEvents(wall.events);
  showAlarms(wall.alarms, wall.now, tell);
  showConfigurations(wall.configurations);
  warn(wall.trouble ? `Events are not kept: ${wall.trouble}. Nothing is lost: the cells have them.` : "");
}

function warn(text) {
  put(byId("banner"), text);
  byId("banner").classList.toggle("hidden", !text);
}

async function look() {
  try {
    const answer = await fetch("/farm/wall", { signal: AbortSignal.timeout(LOST_MS) });
    if (!answer.ok) throw new Error(await answer.text());
    show(await answer.json());
    heard = Date.now();
  } catch (error) {
    if (Date.now() - heard > LOST_MS) warn(`The desk does not answer (${error.message}). What you see is old. Stop cells at the cells.`);
  }
  setTimeout(look, PERIOD_MS);
}

function tell(text, is) {
  const list = byId("answers");
  const line = make("li", "answer", text);
  line.dataset.is = is;
  list.prepend(line);
  while (list.childElementCount > MOST_ANSWERS) list.lastElementChild.remove();
}

async function send(command, cell) {
  tell(`${new Date().toLocaleTimeString()} ${command} ${cell} ...`, "asked");
  try {
    const answer = await fetch("/farm/command", {
      method: "POST",
      headers: { "content-type": "application/json" },
      body: JSON.stringify({ command, cell }),
    });
    if (!answer.ok) throw new Error(await answer.text());
    const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
    let rest = "";
    for (;;) {
      const { value, done } = await reader.read();
      if (done) break;
      const lines = (rest + value).split("\n");
      rest = lines.pop();
      for (const line of lines) {
        const said = JSON.parse(line);
        tell(`${command} ${said.text}`, said.good ? "good" : "bad");
      }
    }
  } catch (error) {
    tell(`${command} ${cell}: NOT SENT, or no answer: ${error.message}. Use the STOP at the cell.`, "bad");
  }
}

// A press counts, not its end: a stop does not wait for the finger to leave. Keys and screen readers make a click
// without a press.
document.addEventListener("pointerdown", (event) => {
  const pressed = event.target.closest("[data-command]");
  if (pressed && event.button === 0) send(pressed.dataset.command, pressed.dataset.cell);
});
document.addEventListener("click", (event) => {
  const pressed = event.target.closest("[data-command]");
  if (pressed && event.detail === 0) send(pressed.dataset.command, pressed.dataset.cell);
});

look();
showFigures();
