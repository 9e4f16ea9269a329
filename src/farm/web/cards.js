// The wall. A card keeps its place: the first cells stand in the order of their names, a new one comes after them, and
// one that the desk knows no longer stays until the page is loaded again. So no STOP becomes another cell's below a
// finger.
import { ago, byId, make, makeButton, put } from "./parts.js";

const ANSWER_MS = 30000;
const FOUND_MS = 2500;
const cards = new Map();

function newCard(name) {
  const card = make("article", "cell");
  card.dataset.cell = name;
  const parts = {
    name: make("h3", "cell-name"),
    title: make("span", "cell-title"),
    since: make("span", "cell-since"),
    text: make("p", "cell-text"),
    facts: make("p", "cell-facts"),
  };
  const head = make("div", "cell-head");
  const mode = make("p", "cell-mode");
  mode.append(parts.title, parts.since);
  head.append(parts.name, mode);
  const buttons = make("div", "cell-buttons");
  for (const command of ["PAUSE", "STOP"]) {
    const button = makeButton(command.toLowerCase(), command, `${command} ${name}`);
    button.dataset.command = command;
    button.dataset.cell = name;
    buttons.append(button);
  }
  card.append(head, parts.text, parts.facts, buttons);
  byId("wall").append(card);
  const made = { card, parts, facts: "", answer: null };
  cards.set(name, made);
  return made;
}

function showCard(cell, now) {
  const shown = cards.get(cell.name) ?? newCard(cell.name);
  const { card, parts } = shown;
  card.dataset.is = cell.tone;
  put(parts.name, cell.short);
  parts.name.title = cell.name;
  put(parts.title, cell.title);
  put(parts.since, ago(now - cell.since));
  put(parts.text, cell.text);
  // A line breaks between facts, not within one.
  shown.facts = cell.facts.map((fact) => fact.replaceAll(" ", "\u00a0")).join(", ");
  showFacts(shown);
}

// A good answer fades; one that says that a command did not get through stays until the next.
function showFacts(shown) {
  const { card, parts, answer } = shown;
  if (answer?.is === "good" && Date.now() > answer.until) shown.answer = null;
  parts.facts.dataset.is = shown.answer?.is ?? "";
  put(parts.facts, shown.answer?.text ?? shown.facts);
  card.classList.toggle("is-unanswered", shown.answer?.is === "bad");
}

export function showCards(found, now) {
  for (const cell of found) showCard(cell, now);
  const names = new Set(found.map((cell) => cell.name));
  for (const [name, shown] of cards) {
    if (names.has(name)) continue;
    shown.card.dataset.is = "gone";
    put(shown.parts.title, "Gone");
    put(shown.parts.since, "");
    put(shown.parts.text, "The desk no longer knows this cell. Load the page again to remove its card.");
    shown.facts = "";
    showFacts(shown);
  }
}

// What became of a command, in the card of its cell.
export function answerOn(name, text, is) {
  const shown = cards.get(name);
  if (!shown) return;
  shown.answer = { text, is, until: Date.now() + ANSWER_MS };
  showFacts(shown);
}

export function goTo(name) {
  const card = cards.get(name)?.card;
  if (!card) return;
  card.scrollIntoView({ block: "center" });
  card.classList.add("is-found");
  setTimeout(() => card.classList.remove("is-found"), FOUND_MS);
}
