// A class: learners by exercises, as the desk's history tells it.
import { byId, clock, make } from "./parts.js";

// e07_planted_error: its number is enough for a heading.
const number = (exercise) => exercise.split("_")[0].replace(/^e0*/, "");

export function showClass(rows, now) {
  byId("class-card").classList.toggle("hidden", !rows.length);
  const titles = new Map(rows.map((row) => [row.exercise, row.title]).sort());
  const lines = new Map();
  for (const row of rows) {
    const key = `${row.learner} ${row.cell}`;
    lines.set(key, [...(lines.get(key) || []), row]);
  }
  const table = make("table", "figures class");
  const head = table.createTHead().insertRow();
  const heading = (text, title = "") => head.append(Object.assign(make("th", "", text), { scope: "col", title }));
  for (const text of ["learner", "passed"]) heading(text);
  for (const [exercise, title] of titles) heading(number(exercise), title);
  heading("last");
  const body = table.createTBody();
  for (const own of lines.values()) {
    const line = body.insertRow();
    const put = (name, text, tone = "", title = "") => {
      const cell = Object.assign(line.insertCell(), { textContent: text, className: tone, title });
      cell.dataset.name = name;
    };
    put("learner", own[0].learner, "", own[0].cell);
    put("passed", String(own.filter((row) => row.passed).length));
    for (const [exercise, title] of titles) {
      const row = own.find((each) => each.exercise === exercise);
      const word = row?.passed ? "passed" : "not yet";
      const told = row ? `${title}: ${word}, marked ${row.tries} times, last ${clock(row.last, now)}` : "";
      put(number(exercise), row ? `${row.passed ? "✓" : "–"} ${row.tries}` : "", row?.passed ? "is-passed" : "is-open", told);
    }
    put("last", clock(Math.max(...own.map((row) => row.last)), now));
  }
  byId("class").replaceChildren(table);
}
