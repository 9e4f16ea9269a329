// Key figures of the last day, what stopped the cells, and their drifts.
import { showClass } from "./learners.js";
import { showDrifts } from "./drifts.js";
import { ago, byId, make, put } from "./parts.js";

const PERIOD_MS = 30000;
const percent = (share) => (share === null ? "" : `${(100 * share).toFixed(1)} %`);
const lasting = (seconds) => (seconds === null ? "" : ago(seconds));

const COLUMNS = [
  ["cell", (row) => row.cell || "all"],
  ["availability", (row) => percent(row.availability)],
  ["effectiveness", (row) => percent(row.effectiveness)],
  ["quality", (row) => percent(row.quality_ratio)],
  ["OEE", (row) => percent(row.oee)],
  ["programs, moves", (row) => `${row.programs}, ${row.twin_moves + row.operator_moves}`],
  ["cycle", (row) => (row.cycle_s === null ? "" : `${row.cycle_s.toFixed(1)} s`)],
  ["failures", (row) => `${row.failures} of ${row.stops} stops`],
  ["between failures", (row) => lasting(row.mean_between_failures_s)],
  ["restoration", (row) => lasting(row.mean_restoration_s)],
];

function tableOf(rows) {
  const table = make("table", "figures");
  const head = table.createTHead().insertRow();
  for (const [name] of COLUMNS) {
    const cell = make("th", "", name);
    cell.scope = "col";
    head.append(cell);
  }
  const body = table.createTBody();
  for (const row of rows) {
    const line = body.insertRow();
    if (!row.cell) line.className = "all-cells";
    for (const [name, show] of COLUMNS) {
      const cell = line.insertCell();
      cell.dataset.name = name;
      cell.textContent = show(row);
    }
  }
  return table;
}

function causeLine(cause, now) {
  const line = make("li", "cause");
  const where = cause.cells === 1 ? cause.last_in : `${cause.cells} cells`;
  line.append(make("strong", "", `${cause.times} x ${cause.cause}`));
  line.append(make("span", "", ` in ${where}. Last ${ago(now - cause.last)} ago in ${cause.last_in}: ${cause.last_text}`));
  return line;
}

export async function showFigures() {
  try {
    const answer = await fetch("/farm/figures");
    if (!answer.ok) throw new Error(await answer.text());
    const { kpi, causes, drifts, learners } = await answer.json();
    byId("kpi").replaceChildren(kpi.length ? tableOf(kpi) : make("p", "muted", "no cycle yet"));
    const now = Date.now() / 1000;
    const stopped = causes.length ? causes.map((cause) => causeLine(cause, now)) : [make("li", "muted", "nothing")];
    byId("causes").replaceChildren(...stopped);
    showDrifts(drifts);
    showClass(learners, now);
    put(byId("figures-trouble"), "");
  } catch (error) {
    put(byId("figures-trouble"), `not renewed: ${error.message}`);
  }
  setTimeout(showFigures, PERIOD_MS);
}
