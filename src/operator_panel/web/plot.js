// A chart of whatever quantities somebody has chosen. They stand in the address (#plot=joint_1.real,pair.speed), so
// that a link shows the same. Each unit has an axis of its own, left or right; two units share a grid.
const POINTS = ["real", "twin", "setpoint", "measured", "error", "effort"];
const COLOURS = ["--real", "--twin", "--operator", "--good", "--deviation", "--bad"];
const KEY = "plot";
const MOST_UNITS = 4; // more grids than two have no room for their numbers

export class Plot {
  constructor(told, changed) {
    this.told = told;
    this.pair = Object.keys(told.quantities).filter((key) => key.startsWith("pair.")); // in the order of its points
    this.changed = changed;
    this.place = document.querySelector("[data-plot-choice]");
    this.opener = document.querySelector("[data-plot-choose]");
    this.opener.addEventListener("click", () => this.open(this.place.hidden));
    document.querySelector("[data-plot-close]").addEventListener("click", () => this.open(false));
    document.querySelector("[data-plot-clear]").addEventListener("click", () => this.choose([]));
    this.picks = [...document.querySelectorAll("[data-plot]")];
    for (const pick of this.picks) pick.addEventListener("click", () => this.toggle(pick.dataset.plot));
    window.addEventListener("hashchange", () => this.read());
    this.read();
  }

  get isOwn() {
    return this.keys.length > 0;
  }

  open(shown) {
    this.place.hidden = !shown;
    this.opener.setAttribute("aria-expanded", shown);
    (shown ? this.picks[0] : this.opener).focus();
  }

  // What the address asks for; what there is not on this robot is left out.
  read() {
    const asked = new URLSearchParams(location.hash.slice(1)).get(KEY) || "";
    const keys = [];
    for (const key of asked.split(",")) if (key in this.told.quantities && this.fits(keys, key)) keys.push(key);
    this.show(keys);
  }

  // Whether one more quantity has room.
  fits(keys, key) {
    return keys.length < this.told.most && !keys.includes(key) && this.units([...keys, key]).length <= MOST_UNITS;
  }

  units(keys) {
    return [...new Set(keys.map((key) => this.told.quantities[key].unit))];
  }

  toggle(key) {
    const without = this.keys.filter((other) => other !== key);
    this.choose(without.length < this.keys.length ? without : [...this.keys, key]);
  }

  choose(keys) {
    const hash = new URLSearchParams(location.hash.slice(1));
    if (keys.length) hash.set(KEY, keys.join(","));
    else hash.delete(KEY);
    history.replaceState(history.state, "", `#${hash.toString().replaceAll("%2C", ",")}`);
    this.show(keys);
  }

  show(keys) {
    this.keys = keys;
    for (const pick of this.picks) {
      const isChosen = keys.includes(pick.dataset.plot);
      pick.setAttribute("aria-pressed", isChosen);
      pick.disabled = !isChosen && !this.fits(keys, pick.dataset.plot);
    }
    document.querySelector(".charts").classList.toggle("has-own", this.isOwn);
    document.querySelector("[data-plot-legend]").replaceChildren(...keys.map((key, k) => this.word(key, k)));
    window.dispatchEvent(new Event("resize"));
    this.changed();
  }

  word(key, k) {
    const { title, unit } = this.told.quantities[key];
    const item = Object.assign(document.createElement("li"), { textContent: `${title}, ${unit}` });
    item.style.setProperty("--colour", `var(${COLOURS[k]})`);
    return item;
  }

  // One value of a row's points.
  value(points, key) {
    const [owner, kind] = key.split(".");
    const own = points[owner] || [];
    if (owner === "pair") return own[this.pair.indexOf(key)] ?? null;
    if (kind !== "apart") return own[POINTS.indexOf(kind)] ?? null;
    return own[0] == null || own[1] == null ? null : own[0] - own[1];
  }

  // Options of the whole chart; span gives the limits of an axis.
  options(rows, now, span, look) {
    const units = this.units(this.keys);
    const axis = (key) => units.indexOf(this.told.quantities[key].unit);
    const series = this.keys.map((key, k) => ({
      id: key, name: this.told.quantities[key].title, type: "line", showSymbol: false,
      xAxisIndex: axis(key) >> 1, yAxisIndex: axis(key),
      data: rows.map(([time, points]) => [time - now, this.value(points, key)]),
      lineStyle: { width: 1.6, color: look.css(COLOURS[k]) }, itemStyle: { color: look.css(COLOURS[k]) },
    }));
    const grids = units.length > 2 ? [0, 1] : [0];
    const sides = { left: 3.6 * look.fontSize, right: (units.length > 1 ? 3.6 : 1.2) * look.fontSize };
    const x = { type: "value", min: -this.told.window, max: 0, ...look.axis(""), splitLine: { show: false } };
    const isLast = (grid) => grid === grids.length - 1;
    return {
      ...look.common,
      legend: { show: false }, // its words stand above the chart, where they have lines enough
      grid: grids.map((grid) => ({
        ...sides, top: grid ? "61%" : 1.6 * look.fontSize, bottom: isLast(grid) ? 1.7 * look.fontSize : "53%",
      })),
      xAxis: grids.map((grid) => ({ ...x, gridIndex: grid, axisLabel: isLast(grid) ? look.seconds : { show: false } })),
      yAxis: units.map((unit, k) => ({
        type: "value", gridIndex: k >> 1, splitNumber: 2, ...look.axis(unit, k % 2 ? "right" : "left"), position: k % 2 ? "right" : "left",
        splitLine: { show: k % 2 === 0, lineStyle: { color: look.css("--line") } },
        ...ends(span(series.filter((one) => one.yAxisIndex === k).map((one) => one.data), unit === "ms" || unit === "mm" ? 0.1 : 1)),
      })),
      series,
    };
  }
}

// Numbers at both ends and in the middle: a low chart has no room for more.
function ends({ min, max }) {
  return { min, max, interval: (max - min) / 2 };
}
