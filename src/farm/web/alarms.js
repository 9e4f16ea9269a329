// The list of alarms; equal ones of several cells are one row. A row keeps its place for as long as one of its alarms
// is listed, so that no button moves away below a finger. A new one takes the first row whose alarms have gone, else
// it comes last.
import { ago, byId, clock, make, makeButton, put } from "./parts.js";

const HOUR_S = 3600;
// { line, parts, acknowledge, why, shelve, group, asked }: group is null when its alarms have gone; asked is the group
// as it was shown when somebody began to write why it is shelved, else null.
const rows = [];

async function mark(asked, tell) {
  try {
    const answer = await fetch("/farm/alarm", {
      method: "POST",
      headers: { "content-type": "application/json" },
      body: JSON.stringify(asked),
    });
    tell(await answer.text(), answer.ok ? "good" : "bad");
  } catch (error) {
    tell(`${asked.word} ${asked.alarms[0].id}: not sent: ${error.message}`, "bad");
  }
}

// In the row itself, in the place of Acknowledge: a dialog of the browser would hold up STOP ALL and all that is shown.
function askWhy(row, group) {
  row.asked = group;
  row.acknowledge.classList.toggle("hidden", group !== null);
  row.why.classList.toggle("hidden", group === null);
  row.why.value = "";
  if (group) row.why.focus();
}

function pressShelve(row, tell) {
  const { asked, group } = row;
  if (asked) {
    const why = row.why.value.trim();
    if (why) mark({ word: "shelve", alarms: asked.alarms, seconds: HOUR_S, why }, tell);
    askWhy(row, null);
  } else if (group.status === "shelved") {
    mark({ word: "shelve", alarms: group.alarms, seconds: 0 }, tell);
  } else {
    askWhy(row, group);
  }
}

function newRow(tell) {
  const line = make("li", "alarm");
  const parts = {
    head: make("p", "alarm-head"),
    cells: make("p", "alarm-cells"),
    facts: make("p", "alarm-facts"),
  };
  const buttons = make("div", "alarm-buttons");
  const row = {
    line,
    parts,
    acknowledge: makeButton("", "Acknowledge"),
    why: make("input", "alarm-why hidden"),
    shelve: makeButton("", "Shelve"),
    group: null,
    asked: null,
  };
  row.why.placeholder = "Why, for 1 h?";
  row.acknowledge.addEventListener("click", () => mark({ word: "acknowledge", alarms: row.group.waiting }, tell));
  row.shelve.addEventListener("click", () => pressShelve(row, tell));
  row.why.addEventListener("keydown", ({ key }) => {
    if (key === "Enter") pressShelve(row, tell);
    if (key === "Escape") askWhy(row, null);
  });
  buttons.append(row.acknowledge, row.why, row.shelve);
  line.append(...Object.values(parts), buttons);
  byId("alarms").append(line);
  rows.push(row);
  return row;
}

function titleOf(group) {
  const times = group.alarms.length > 1 ? `${group.alarms.length} × ` : "";
  return `${times}${group.source}: ${group.text}`;
}

function factsOf(group, now) {
  const facts = group.status === "raised" ? [] : [group.status];
  if (group.waiting.length && group.waiting.length < group.alarms.length) facts.push(`${group.waiting.length} wait`);
  facts.push(`raised ${clock(group.raised, now)}, ${ago(now - group.raised)} ago`);
  if (group.times > group.alarms.length) facts.push(`${group.times} times`);
  if (group.cleared) facts.push(`gone for ${ago(now - group.cleared)}`);
  if (group.persons.length) facts.push(`by ${group.persons.join(", ")} ${ago(now - group.marked)} ago`);
  if (group.until) facts.push(`until ${clock(group.until, now)}: ${group.why.join("; ")}`);
  return facts.join(" · ");
}

function showRow(row, now) {
  const { line, parts, acknowledge, why, shelve, group, asked } = row;
  if (asked && !(group && meets(group, asked))) askWhy(row, null);
  line.classList.toggle("is-gone", !group);
  if (!group) return;
  line.dataset.status = group.status.split(",")[0];
  line.dataset.level = group.level;
  put(parts.head, titleOf(group));
  put(parts.cells, group.cells.join(", "));
  put(parts.facts, factsOf(group, now));
  const isShelved = group.status === "shelved";
  acknowledge.classList.toggle("is-hidden", !group.waiting.length);
  put(shelve, isShelved && !row.asked ? "Unshelve" : "Shelve");
  why.setAttribute("aria-label", `Why is ${titleOf(group)} shelved for an hour?`);
  for (const button of [acknowledge, shelve]) button.setAttribute("aria-label", `${button.textContent} ${titleOf(group)}`);
}

const isSame = (one, other) => one.source === other.source && one.level === other.level && one.text === other.text;
const meets = (one, other) => one.alarms.some(({ id }) => other.alarms.some((each) => each.id === id));

// Each group gets the row that it has; one whose words have changed the row of its cells.
function place(groups, tell) {
  const left = new Set(groups);
  const before = rows.map((row) => row.group);
  for (const row of rows) row.group = null;
  for (const fits of [isSame, meets]) {
    rows.forEach((row, k) => {
      if (row.group || !before[k]) return;
      const found = [...left].find((group) => fits(group, before[k]));
      if (!found) return;
      row.group = found;
      left.delete(found);
    });
  }
  for (const group of left) (rows.find((row) => !row.group) ?? newRow(tell)).group = group;
  while (rows.length && !rows.at(-1).group) rows.pop().line.remove();
}

export function showAlarms(groups, waiting, now, tell) {
  place(groups, tell);
  for (const row of rows) showRow(row, now);
  const count = groups.reduce((sum, group) => sum + group.alarms.length, 0);
  put(byId("alarm-count"), count ? `${waiting} of ${count} wait for somebody` : "No alarm");
  const link = byId("to-alarms");
  put(link.firstElementChild ?? link, waiting ? `${waiting} alarms` : "No alarm");
  link.dataset.is = waiting ? (groups.some((group) => group.waiting.length && group.level === "error") ? "bad" : "warn") : "good";
  link.onclick = () => byId("alarms").parentElement.scrollIntoView({ block: "start" });
}
