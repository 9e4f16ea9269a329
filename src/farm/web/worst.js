// The cells that ask for somebody as a row of chips, the worst first; a chip leads to its card. As many stand in the
// row as it has room for, the number of the others is beside it.
import { goTo } from "./cards.js";
import { byId, make, put } from "./parts.js";

const chips = new Map();
let shown = [];
let firstHidden = "";
const turned = new ResizeObserver(() => fit(byId("worst"), shown));

function newChip(name) {
  const place = make("li", "chip-place");
  const chip = make("button", "chip");
  chip.type = "button";
  const parts = { short: make("span", "chip-name"), title: make("span", "chip-title") };
  chip.append(parts.short, parts.title);
  chip.addEventListener("click", () => goTo(name));
  place.append(chip);
  const made = { place, chip, parts };
  chips.set(name, made);
  return made;
}

export function showWorst(worst, cells) {
  const list = byId("worst");
  const of = new Map(cells.map((cell) => [cell.name, cell]));
  for (const [name, { place }] of chips) {
    if (worst.includes(name)) continue;
    place.remove();
    chips.delete(name);
  }
  worst.forEach((name, k) => {
    const cell = of.get(name);
    const { place, chip, parts } = chips.get(name) ?? newChip(name);
    chip.dataset.is = cell.tone;
    put(parts.short, cell.short);
    put(parts.title, cell.title);
    if (list.children[k] !== place) list.insertBefore(place, list.children[k] ?? null);
  });
  list.dataset.empty = cells.length ? "No cell asks for somebody" : "No cell yet";
  shown = worst;
  turned.observe(list);
  fit(list, worst);
}

// What has no room has been wrapped to a second line, which is not seen.
function fit(list, worst) {
  const top = list.firstElementChild?.offsetTop;
  const hidden = worst.filter((name) => {
    const { place } = chips.get(name);
    place.classList.toggle("is-hidden", place.offsetTop > top);
    return place.offsetTop > top;
  });
  firstHidden = hidden[0] ?? "";
  const more = byId("more");
  more.classList.toggle("is-hidden", !hidden.length);
  put(more.firstElementChild ?? more, `+${hidden.length}`);
  more.setAttribute("aria-label", `${hidden.length} more cells ask for somebody: go to the first`);
  more.onclick = () => goTo(firstHidden);
}
