// The cells whose figures go away from their own past, and one picture of a figure with all cells in it.
import { byId, make } from "./parts.js";

const SVG = "http://www.w3.org/2000/svg";
const WIDE = 600;
const HIGH = 220;
const EDGE = 34;
const LEAST_SHARE = 0.1;
const figureOf = make("select", "button");
figureOf.setAttribute("aria-label", "figure of the picture");
figureOf.addEventListener("change", () => showPicture());
const drawing = make("div", "all-cells-drawing");
let known = [];

function drawn(tag, attributes, text = "") {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.textContent = text;
  return element;
}

function rowPicture(values) {
  const low = Math.min(...values);
  const size = Math.max(...values) - low || 1;
  const points = values.map((value, k) => `${(100 * k) / (values.length - 1)},${28 - (24 * (value - low)) / size}`);
  const svg = drawn("svg", { viewBox: "0 0 100 30", class: "row-picture", "aria-hidden": "true" });
  svg.append(drawn("polyline", { points: points.join(" ") }));
  return svg;
}

function driftLine(drift) {
  const line = make("li", "drift");
  const words = `${drift.cell}: ${drift.figure} ${drift.before.toFixed(3)} to ${drift.now.toFixed(3)}, ${Math.abs(drift.score).toFixed(0)} times its noise`;
  line.append(make("span", "", words), rowPicture(drift.values));
  return line;
}

// Each cell as a line of its figure's share of what it was at the beginning; the newest days end at the right edge.
function allCells(rows, figure) {
  const shares = rows.map((row) => row.values.map((value) => value / row.before - 1));
  const most = Math.max(LEAST_SHARE, ...shares.flat().map(Math.abs));
  const days = Math.max(2, ...rows.map((row) => row.values.length));
  const across = (row, k) => EDGE + ((WIDE - 2 * EDGE) * (days - row.values.length + k)) / (days - 1);
  const up = (share) => HIGH / 2 - ((HIGH / 2 - 12) * share) / most;
  const away = rows.filter((row) => row.drifts).map((row) => row.cell);
  const said = `${figure}: ${rows.length} cells, ${away.length ? `away: ${away.join(", ")}` : "none goes away"}`;
  const svg = drawn("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, class: "all-cells-picture", role: "img", "aria-label": said });
  for (const share of [-most, 0, most]) {
    svg.append(drawn("line", { x1: EDGE, x2: WIDE - EDGE, y1: up(share), y2: up(share), class: "grid" }));
    svg.append(drawn("text", { x: 0, y: up(share) + 4, class: "scale" }, `${share > 0 ? "+" : ""}${(100 * share).toFixed(0)} %`));
  }
  const drawRow = (row, place) => {
    const points = shares[place].map((share, k) => `${across(row, k)},${up(share)}`).join(" ");
    const line = drawn("polyline", { points, class: row.drifts ? "away" : "steady" });
    line.append(drawn("title", {}, row.cell));
    svg.append(line);
  };
  rows.forEach((row, place) => row.drifts || drawRow(row, place));
  let lowest = -Infinity;
  rows
    .map((row, place) => [row, place, up(shares[place].at(-1))])
    .filter(([row]) => row.drifts)
    .sort((one, other) => one[2] - other[2])
    .forEach(([row, place, y]) => {
      drawRow(row, place);
      lowest = Math.max(y - 6, lowest + 13);
      svg.append(drawn("text", { x: WIDE - EDGE - 4, y: lowest, class: "name" }, row.cell));
    });
  return svg;
}

function showPicture() {
  const rows = known.filter((row) => row.figure === figureOf.value);
  const place = byId("drift-picture");
  place.classList.toggle("hidden", !rows.length);
  if (!rows.length) return;
  const words = "Each line is a cell, as a share of what the figure was at its beginning.";
  // The choice stays where it is: who has opened it goes on.
  if (!place.childElementCount) place.append(figureOf, drawing, make("p", "muted", words));
  drawing.replaceChildren(allCells(rows, figureOf.value));
}

export function showDrifts(drifts) {
  known = drifts;
  const away = drifts.filter((drift) => drift.drifts).map(driftLine);
  const none = drifts.length ? `none of ${drifts.length} figures` : "not known yet: a figure needs six days";
  byId("drifts").replaceChildren(...(away.length ? away : [make("li", "muted", none)]));
  const figures = [...new Set(drifts.map((drift) => drift.figure))];
  const chosen = figures.includes(figureOf.value) ? figureOf.value : figures[0];
  figureOf.replaceChildren(
    ...figures.map((figure) => {
      const option = make("option", "", figure);
      option.selected = figure === chosen;
      return option;
    }),
  );
  showPicture();
}
