const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const HEIGHTS = { only: 24, first: 13, other: 9 };
const BRIGHT = { "#c81e3a": "#fb7185", "#6b7280": "#cbd5e1", "#1667c2": "#6fb0fb" };
const LEGEND = 2.4, GAP = 1.6, FOOT = 5, LEFT = 4.8, RIGHT = 1.2;

// The panels of one chart stand one above the other, over one axis of time. All lengths in em.
function options(told, em) {
  const [ink, soft, line, paper] = ["--ink", "--soft", "--line", "--paper"].map(css);
  const count = told.panels.length, bottom = count - 1;
  const [, unit] = told.x.match(/\[(.+)\]/);
  const fontSize = 0.85 * em, small = { color: soft, fontSize };
  const height = (k) => em * (count === 1 ? HEIGHTS.only : k ? HEIGHTS.other : HEIGHTS.first);
  const [left, right] = [LEFT * em, RIGHT * em];
  let top = LEGEND * em;
  const grid = told.panels.map((_, k) => {
    const place = { left, right, top, height: height(k) };
    top += place.height + GAP * em;
    return place;
  });
  const dark = matchMedia("(prefers-color-scheme: dark)").matches;
  const seen = (color) => (dark && BRIGHT[color]) || color;
  const area = ([from, to, color]) =>
    [{ xAxis: from, itemStyle: { color, opacity: dark ? 0.14 : 0.3 } }, { xAxis: to }];
  const series = told.panels.flatMap((panel, k) => panel.series.map((one, n) => ({
    type: one.points ? "scatter" : "line", name: one.name, xAxisIndex: k, yAxisIndex: k,
    data: one.data, showSymbol: false, symbol: "circle", itemStyle: { color: seen(one.color) },
    symbolSize: one.points ? 8 : 4, label: { show: Boolean(one.points), position: "top",
      color: ink, fontSize, fontWeight: "bold", formatter: ({ data }) => data[2] || "" },
    lineStyle: { width: one.width, color: seen(one.color), type: one.dash },
    markLine: n || panel.limit == null ? undefined : { silent: true, symbol: "none",
      lineStyle: { color: soft, type: "dashed" }, data: [{ yAxis: panel.limit }],
      label: { color: ink, fontSize, position: "insideEndTop", formatter: "allowed" } },
    markArea: n ? undefined : { silent: true, data: (panel.bands || []).map(area) },
  })));
  const axisLine = { show: true, onZero: false, lineStyle: { color: soft } };
  const common = { type: "value", axisLine, splitLine: { lineStyle: { color: line } },
    nameLocation: "middle", nameTextStyle: small };
  const zoomed = { xAxisIndex: told.panels.map((_, k) => k), filterMode: "none" };
  const value = (number) => (number == null ? "-" : Number(number).toPrecision(4));
  return {
    height: top + FOOT * em,
    option: {
      animation: false, grid, series,
      textStyle: { fontFamily: getComputedStyle(document.body).fontFamily },
      legend: { type: "scroll", top: 0, left, right, icon: "rect", itemHeight: 4,
        textStyle: { color: ink, fontSize }, pageTextStyle: small, pageIconColor: ink },
      tooltip: { trigger: "axis", confine: true, backgroundColor: paper, borderColor: line,
        textStyle: { color: ink, fontSize }, valueFormatter: value },
      axisPointer: { link: [{ xAxisIndex: "all" }], lineStyle: { color: soft } },
      xAxis: told.panels.map((_, k) => ({
        ...common, gridIndex: k, min: told.from, max: told.to,
        name: k === bottom ? told.x : "", nameGap: 1.8 * em,
        axisLabel: { ...small, show: k === bottom, showMaxLabel: false } })),
      yAxis: told.panels.map((panel, k) => ({
        ...common, gridIndex: k, min: panel.low, max: panel.high,
        name: panel.y, nameGap: 3.2 * em, splitNumber: count > 1 ? 3 : 5,
        axisLabel: { ...small, hideOverlap: true, showMinLabel: count === 1,
          showMaxLabel: count === 1, formatter: (number) => String(Number(number.toFixed(4))) } })),
      dataZoom: [
        { ...zoomed, type: "slider", bottom: 0.4 * em, height: 1.6 * em, left, right,
          textStyle: small, borderColor: line,
          labelFormatter: (number) => `${Number(number).toFixed(2)} ${unit}` },
        { ...zoomed, type: "inside", zoomOnMouseWheel: "ctrl", moveOnMouseWheel: false },
      ],
    },
  };
}

function draw(place) {
  const told = JSON.parse(place.nextElementSibling.textContent);
  const made = options(told, parseFloat(getComputedStyle(document.documentElement).fontSize));
  place.style.height = `${made.height}px`;
  const chart = echarts.getInstanceByDom(place) || echarts.init(place);
  chart.resize();
  chart.setOption(made.option, true);
}

const places = [...document.querySelectorAll(".chart")];
// A chart is drawn when it comes near: a long report opens at once.
const near = new IntersectionObserver((seen) => {
  for (const { isIntersecting, target } of seen) {
    if (!isIntersecting) continue;
    near.unobserve(target);
    draw(target);
  }
}, { rootMargin: "600px" });
for (const place of places) {
  place.parentElement.classList.add("drawn");
  place.style.minHeight = "18rem";
  near.observe(place);
}
const again = () => places.filter((place) => echarts.getInstanceByDom(place)).forEach(draw);
addEventListener("resize", again);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
let opened = [];
addEventListener("beforeprint", () => {
  opened = [...document.querySelectorAll("details.printed:not([open])")];
  for (const each of opened) each.open = true;
});
addEventListener("afterprint", () => opened.forEach((each) => { each.open = false; }));
