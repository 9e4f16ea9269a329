// The list of alarms. A line stays the same element for as long as its alarm is listed, so that no button moves away
// below a finger because something else was renewed.
import { ago, byId, make, put } from "./parts.js";

const HOUR_S = 3600;
const lines = new Map();

async function mark(asked) {
  const answer = await fetch("/farm/alarm", {
    method: "POST",
    headers: { "content-type": "application/json" },
    body: JSON.stringify(asked),
  });
  return { good: answer.ok, text: await answer.text() };
}

function newLine(alarm, tell) {
  const line = make("li", "alarm");
  const parts = { head: make("p", "alarm-head"), text: make("p", "alarm-text"), facts: make("p", "alarm-facts") };
  const words = make("div", "alarm-words");
  words.append(...Object.values(parts));
  const buttons = make("div", "alarm-buttons");
  const acknowledge = make("button", "button", "Acknowledge");
  const shelve = make("button", "button", "Shelve");
  for (const [pressed, word] of [[acknowledge, "Acknowledge"], [shelve, "Shelve"]]) {
    pressed.type = "button";
    pressed.setAttribute("aria-label", `${word} ${alarm.id}`);
  }
  const send = async (asked) => {
    try {
      const { good, text } = await mark(asked);
      tell(text, good ? "good" : "bad");
    } catch (error) {
      tell(`${asked.id}: not sent: ${error.message}`, "bad");
    }
  };
  acknowledge.addEventListener("click", () => send({ word: "acknowledge", id: alarm.id }));
  shelve.addEventListener("click", () => {
    if (line.dataset.status === "shelved") {
      send({ word: "shelve", id: alarm.id, seconds: 0 });
      return;
    }
    const why = window.prompt(`Shelve ${alarm.id} for an hour. Why?`);
    if (why) send({ word: "shelve", id: alarm.id, seconds: HOUR_S, why });
  });
  buttons.append(acknowledge, shelve);
  line.append(words, buttons);
  byId("alarms").append(line);
  const made = { line, parts, acknowledge, shelve };
  lines.set(alarm.id, made);
  return made;
}

function showAlarm(alarm, place, now, tell) {
  const { line, parts, acknowledge, shelve } = lines.get(alarm.id) ?? newLine(alarm, tell);
  line.style.order = String(place);
  line.dataset.status = alarm.status.split(",")[0];
  line.dataset.level = alarm.level;
  put(parts.head, alarm.id);
  put(parts.text, alarm.text);
  const facts = [alarm.status, `raised ${ago(now - alarm.raised)} ago`];
  if (alarm.times > 1) facts.push(`${alarm.times} times`);
  if (alarm.cleared) facts.push(`gone for ${ago(now - alarm.cleared)}`);
  if (alarm.person) facts.push(`by ${alarm.person} ${ago(now - alarm.marked)} ago`);
  if (alarm.until) facts.push(`until ${new Date(alarm.until * 1000).toLocaleTimeString()}: ${alarm.why}`);
  put(parts.facts, facts.join(" · "));
  const seen = alarm.status === "acknowledged";
  acknowledge.classList.toggle("hidden", seen || alarm.status === "shelved");
  put(shelve, alarm.status === "shelved" ? "Unshelve" : "Shelve");
}

export function showAlarms(alarms, now, tell) {
  const there = new Set(alarms.map((alarm) => alarm.id));
  alarms.forEach((alarm, place) => showAlarm(alarm, place, now, tell));
  for (const [id, { line }] of lines) {
    if (!there.has(id)) {
      line.remove();
      lines.delete(id);
    }
  }
  const waiting = alarms.filter((alarm) => alarm.status === "raised" || alarm.status.startsWith("cleared")).length;
  put(byId("alarm-count"), alarms.length ? `${waiting} of ${alarms.length} wait for somebody` : "none");
}
