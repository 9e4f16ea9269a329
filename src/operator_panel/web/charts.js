// Keeps the points of all joints and draws those of the chosen one.
import { Plot } from "./plot.js";

const REAL = 0;
const TWIN = 1;
const SET_POINT = 2;
const MEASURED = 3;
const ERROR = 4;
const EFFORT = 5;
const DRAW_MS = 200;
const REST_MS = 1000; // while nothing changes but the time axis
const KEPT = "panel_chart";
const [TOP, BOTTOM] = [0.32, 0.19]; // heights of both grids, as shares of a chart
const LINE = 1.2; // from one number of an axis to the next, at least [height of a letter]

export class Charts {
  constructor(told) {
    this.told = told;
    this.rows = [];
    this.changed = true;
    this.paused = false;
    this.title = document.querySelector("[data-chart-title]");
    this.whole = this.title.textContent;
    const kept = sessionStorage.getItem(KEPT);
    this.choose(kept in told.units ? kept : Object.keys(told.units)[0]);
    document.querySelector("[data-pause]").addEventListener("click", (event) => this.pause(event.currentTarget));
    for (const button of document.querySelectorAll("[data-select]")) {
      button.addEventListener("click", () => this.choose(button.dataset.select));
    }
    for (const button of document.querySelectorAll("[data-chart]")) {
      button.addEventListener("click", () => this.turn(button.dataset.chart));
    }
    this.turn("motion");
    this.plot = new Plot(told, () => {
      this.dressed = false;
      this.changed = this.fresh = true;
    });
    // A theme, and each dialog too: dressed once somebody sees them.
    new MutationObserver(() => {
      this.dressed = false;
      this.changed = true;
    }).observe(document.body, { attributeFilter: ["class"] });
    window.addEventListener("resize", () => (this.dressed = false)); // letters grow with the screen
    setInterval(() => this.draw(), DRAW_MS);
  }

  // Where there is room for one chart only: motion or loop.
  turn(kind) {
    document.querySelector(".charts").dataset.chartShown = kind;
    for (const button of document.querySelectorAll("[data-chart]")) {
      button.setAttribute("aria-selected", button.dataset.chart === kind);
    }
    this.dressed = false;
    this.changed = true;
    window.dispatchEvent(new Event("resize"));
  }

  // A chart that stands still can be zoomed into; the points go on being kept.
  pause(button) {
    this.paused = !this.paused;
    button.setAttribute("aria-pressed", this.paused);
    button.textContent = this.paused ? "Go on" : "Freeze";
    this.since = this.paused ? `Frozen ${new Date().toLocaleTimeString([], { hour12: false })}` : "";
    const dataZoom = [{ disabled: !this.paused, start: 0, end: 100 }];
    for (const id of [this.told.motion, this.told.loop]) getElement(id)?.chart?.setOption({ dataZoom });
    this.frozen = this.paused ? [...this.rows] : null;
    this.changed = true;
    this.entitle();
  }

  // Rows of the past in place of those that come or are frozen; null: go on.
  hold(rows) {
    this.past = rows;
    this.changed = this.moved = true;
    this.fresh = true;
    this.entitle();
  }

  entitle() {
    this.title.textContent = (!this.past && this.since) || this.whole;
  }

  add(time, points) {
    this.rows.push([time, points]);
    while (time - this.rows[0][0] > this.told.window) this.rows.shift();
    const told = JSON.stringify(this.plot?.isOwn ? points : points[this.joint]);
    this.moved ||= told !== this.last;
    this.last = told;
    this.changed = true;
  }

  restart(rows) {
    this.rows = rows;
    this.changed = true;
  }

  choose(joint) {
    this.joint = joint;
    sessionStorage.setItem(KEPT, joint);
    this.changed = true;
    for (const button of document.querySelectorAll("[data-select]")) {
      button.setAttribute("aria-selected", button.dataset.select === joint);
    }
    this.dressed = false;
  }

  draw() {
    const [motion, loop, own] = ["motion", "loop", "own"].map((name) => getElement(this.told[name])?.chart);
    if (!motion || !loop || !own || document.hidden || !this.changed || !isSeen([motion, loop, own])) return;
    const time = performance.now();
    if (!this.dressed) this.fresh = true;
    if (!this.fresh && (this.paused || (!this.moved && time - this.drawn < REST_MS))) return;
    if (!this.dressed) this.dress();
    this.drawn = time;
    this.changed = this.moved = this.fresh = false;
    const rows = this.past || this.frozen || this.rows;
    const now = rows.at(-1)?.[0] ?? 0;
    if (this.plot.isOwn) {
      own.setOption(this.plot.options(rows, now, span, this.look()), { replaceMerge: ["grid", "xAxis", "yAxis", "series"] });
      return;
    }
    const column = (value) => rows.map(([time, points]) => [time - now, value(points[this.joint] || [])]);
    const of = (index) => column((point) => point[index] ?? null);
    const deviation = column((p) => (p[REAL] == null || p[TWIN] == null ? null : p[REAL] - p[TWIN]));
    const [real, twin, setPoint, measured, error, effort] = [REAL, TWIN, SET_POINT, MEASURED, ERROR, EFFORT].map(of);
    const room = (chart) => [TOP, BOTTOM].map((share) => this.most(chart.getHeight() * share));
    const [high, low] = room(motion);
    this.put(motion, [span([real, twin], 1, high), around(deviation, 0.05, low)], { real, twin, deviation });
    const [upper, lower] = room(loop);
    const axes = [span([setPoint, measured], 1, upper), around(error, 0.05, lower), around(effort, 1, lower)];
    this.put(loop, axes, { setpoint: setPoint, twin: measured, deviation: error, effort });
  }

  // So many steps of an axis have room for their numbers in a grid of this height [px].
  most(height) {
    return Math.max(1, Math.floor(height / (LINE * this.look().fontSize)));
  }

  put(chart, yAxis, series) {
    const x = { min: -this.told.window, max: 0 };
    chart.setOption({ xAxis: [x, x], yAxis, series: Object.entries(series).map(([id, data]) => ({ id, data })) });
  }

  // Colours and letters of the theme.
  look() {
    const css = (name) => getComputedStyle(document.body).getPropertyValue(name).trim();
    const [text, line] = [css("--muted"), css("--line")];
    const fontSize = 0.875 * parseFloat(getComputedStyle(document.documentElement).fontSize);
    // The unit stands inside the grid: beside the numbers it would cover the highest.
    const axis = (name, align = "left") => ({
      name, nameTextStyle: { color: text, fontSize, align }, nameGap: 6,
      axisLabel: { color: text, fontSize, formatter: (value) => signed(tidy(value)) }, axisLine: { onZero: false, lineStyle: { color: line } }, axisTick: { show: false },
      splitLine: { show: true, lineStyle: { color: line } },
    });
    // A canvas takes no "inherit": it would fall back to 10 px.
    const fontFamily = getComputedStyle(document.body).fontFamily;
    const tooltip = {
      trigger: "axis", confine: true, transitionDuration: 0,
      backgroundColor: css("--card"), borderColor: line, textStyle: { color: css("--text"), fontSize },
      valueFormatter: (value) => (value == null ? "-" : value.toFixed(3)),
    };
    const common = { animation: false, textStyle: { fontFamily }, tooltip, legend: { textStyle: { color: text, fontSize } } };
    const ends = { alignMinLabel: "left", alignMaxLabel: "right" }; // not below the numbers of an axis
    const seconds = { color: text, fontSize, formatter: (value) => `${signed(value)} s`, ...ends };
    return { css, fontSize, axis, common, seconds };
  }

  // Names and units of the chosen joint.
  dress() {
    const { css, fontSize, axis, common, seconds } = this.look();
    const unit = this.told.units[this.joint];
    const colours = { real: "--real", twin: "--twin", setpoint: "--text", deviation: "--deviation", effort: "--effort" };
    const x = { ...axis(""), splitLine: { show: false } };
    const style = (ids) => ids.map((id) => ({ id, lineStyle: { color: css(colours[id]) }, itemStyle: { color: css(colours[id]) } }));
    const grid = (right) => [
      { left: 3.6 * fontSize, right: right * fontSize, top: 2.8 * fontSize, height: `${100 * TOP}%` },
      { left: 3.6 * fontSize, right: right * fontSize, bottom: 1.7 * fontSize, height: `${100 * BOTTOM}%` },
    ];
    const bottom = { ...x, axisLabel: seconds };
    const top = { ...x, axisLabel: { show: false } };
    const two = (name) => ({ ...axis(name, "right"), splitLine: { show: false } });
    getElement(this.told.motion)?.chart?.setOption({
      ...common, grid: grid(1.2), xAxis: [top, bottom], yAxis: [axis(unit), axis(unit)], series: style(["real", "twin", "deviation"]),
    });
    getElement(this.told.loop)?.chart?.setOption({
      ...common, grid: grid(3), xAxis: [top, bottom], yAxis: [axis(unit), axis(unit), two(this.told.efforts[this.joint])],
      series: style(["setpoint", "twin", "deviation", "effort"]),
    });
    this.dressed = true;
    this.changed = true;
  }
}

function isSeen(charts) {
  return charts.some((chart) => chart.getDom().offsetParent);
}

function values(series) {
  return series.flatMap((data) => data.map(([, value]) => value)).filter((value) => value !== null);
}

// Limits of an axis that holds all values, at least `least` wide, in at most `most` steps.
function span(series, least, most = 5) {
  const all = values(series);
  if (!all.length) return { min: 0, max: least, interval: least };
  const [low, high] = [Math.min(...all), Math.max(...all)];
  const margin = Math.max(0.06 * (high - low), 0.5 * (least - (high - low)), 0);
  const step = round(high - low + 2 * margin) / 4;
  const [min, max] = [Math.floor((low - margin) / step), Math.ceil((high + margin) / step)];
  const each = Math.ceil((max - min) / most);
  const steps = Math.ceil((max - min) / each); // whole ones: the last number stands at the end
  return { min: tidy(min * step), max: tidy((min + steps * each) * step), interval: tidy(each * step) };
}

// Limits the same on both sides of zero, at least `least`.
function around(data, least, most) {
  const limit = round(Math.max(least, ...values([data]).map(Math.abs)));
  return { min: -limit, max: limit, interval: most > 1 ? limit : 2 * limit };
}

// The next of 1, 2, 5 times a power of ten.
function round(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return tidy(power * [1, 2, 5, 10].find((digit) => digit * power >= value * 0.999));
}

function signed(value) {
  return `${value}`.replace("-", "\u2212");
}

function tidy(value) {
  return Number(value.toPrecision(8));
}
