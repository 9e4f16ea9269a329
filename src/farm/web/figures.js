// Key figures of the last day, and the cells whose figures go away from their own past.
import { ago, byId, make, put } from "./parts.js";

const PERIOD_MS = 30000;
const SVG = "http://www.w3.org/2000/svg";
const percent = (share) => (share === null ? "" : `${(100 * share).toFixed(1)} %`);
const lasting = (seconds) => (seconds === null ? "" : ago(seconds));

const COLUMNS = [
  ["cell", (row) => row.cell || "all"],
  ["availability", (row) => percent(row.availability)],
  ["effectiveness", (row) => percent(row.effectiveness)],
  ["quality", (row) => percent(row.quality_ratio)],
  ["OEE", (row) => percent(row.oee)],
  ["cycles done", (row) => `${row.done} of ${row.cycles}`],
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

function picture(values) {
  const low = Math.min(...values);
  const size = Math.max(...values) - low || 1;
  const points = values.map((value, k) => `${(100 * k) / (values.length - 1)},${28 - (24 * (value - low)) / size}`);
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "0 0 100 30");
  svg.setAttribute("class", "row-picture");
  svg.setAttribute("aria-hidden", "true");
  const line = document.createElementNS(SVG, "polyline");
  line.setAttribute("points", points.join(" "));
  svg.append(line);
  return svg;
}

function driftLine(drift) {
  const line = make("li", "drift");
  const words = `${drift.cell}: ${drift.figure} ${drift.before.toFixed(3)} to ${drift.now.toFixed(3)}, ${Math.abs(drift.score).toFixed(0)} times its noise`;
  line.append(make("span", "", words), picture(drift.values));
  return line;
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
    const { kpi, causes, drifts, compared } = await answer.json();
    byId("kpi").replaceChildren(kpi.length ? tableOf(kpi) : make("p", "muted", "no cycle yet"));
    const now = Date.now() / 1000;
    const stopped = causes.length ? causes.map((cause) => causeLine(cause, now)) : [make("li", "muted", "nothing")];
    byId("causes").replaceChildren(...stopped);
    const away = drifts.length ? drifts.map(driftLine) : [make("li", "muted", `none of ${compared} figures`)];
    byId("drifts").replaceChildren(...away);
    put(byId("figures-trouble"), "");
  } catch (error) {
    put(byId("figures-trouble"), `not renewed: ${error.message}`);
  }
  setTimeout(showFigures, PERIOD_MS);
}
