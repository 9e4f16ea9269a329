// Two cells, or two weeks of one: what differs by more than its own scatter.
import { byId, make, put } from "./parts.js";

const TIMES = [["12h", "12 hours"], ["1d", "a day"], ["7d", "7 days"], ["30d", "30 days"]];
const LAST_WEEKS = "its week before";
const digits = (value) => (value === null ? "" : String(Number(value.toPrecision(4))));

function choice(name, options, chosen) {
  const select = make("select", "button");
  select.setAttribute("aria-label", name);
  for (const [value, text] of options) {
    const option = make("option", "", text);
    option.value = value;
    option.selected = value === chosen;
    select.append(option);
  }
  return select;
}

const one = choice("cell", []);
const other = choice("compared with", [["", LAST_WEEKS]]);
const time = choice("time", TIMES, "7d");

// Keeps what is chosen while cells come. The page's frame may come after its script.
export function offerCells(names) {
  if (!byId("compare-form").childElementCount) byId("compare-form").append(...form());
  for (const select of [one, other]) {
    const there = new Set([...select.options].map((option) => option.value));
    for (const name of names.filter((each) => !there.has(each)).sort()) {
      const option = make("option", "", name);
      option.value = name;
      select.append(option);
    }
  }
}

function tableOf(found) {
  const table = make("table", "figures compared");
  const head = table.createTHead().insertRow();
  const titles = ["figure", found.a, found.b, "scatter", ""];
  for (const title of titles) {
    const cell = make("th", "", title);
    cell.scope = "col";
    head.append(cell);
  }
  const body = table.createTBody();
  for (const row of found.figures) {
    const line = body.insertRow();
    line.dataset.differs = row.differs;
    const values = [row.figure, digits(row.a), digits(row.b), digits(row.scatter), row.differs ? "differs" : ""];
    values.forEach((value, k) => {
      const cell = line.insertCell();
      cell.dataset.name = titles[k];
      cell.textContent = value;
    });
  }
  return table;
}

async function compare() {
  const place = byId("compared");
  put(place, "asking ...");
  try {
    const asked = new URLSearchParams({ a: one.value, b: other.value, begin: time.value });
    const answer = await fetch(`/farm/compare?${asked}`);
    if (!answer.ok) throw new Error(await answer.text());
    place.replaceChildren(tableOf(await answer.json()));
  } catch (error) {
    put(place, error.message);
  }
}

function form() {
  const press = make("button", "button", "Compare");
  press.type = "button";
  press.addEventListener("click", compare);
  other.addEventListener("change", () => time.classList.toggle("hidden", other.value === ""));
  time.classList.toggle("hidden", other.value === "");
  return [one, make("span", "", "with"), other, time, press];
}
