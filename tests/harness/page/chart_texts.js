// What an eye cannot read in the drawings of the page as it is now; a drawing has no elements to measure.
// Returns sentences; none: all is well.
() => {
  const root = parseFloat(getComputedStyle(document.documentElement).fontSize);
  const least = 0.875 * root; // as everything else, and never below 14 px
  const problems = [];
  for (const place of document.querySelectorAll(".chart, .step-chart")) {
    const chart = place.checkVisibility() && getElement(Number(place.id.slice(1)))?.chart;
    if (!chart) continue;
    const what = place.className.split(" ").at(-1);
    const texts = [];
    for (const shape of chart.getZr().storage.getDisplayList(true)) {
      if (shape.type !== "tspan" || !shape.style.text.trim()) continue;
      const box = shape.getBoundingRect().clone();
      if (shape.transform) box.applyTransform(shape.transform);
      const size = parseFloat(shape.style.font.match(/([\d.]+)px/)[1]);
      texts.push({ words: shape.style.text, size, left: box.x, right: box.x + box.width, middle: box.y + box.height / 2 });
    }
    if (!texts.length) problems.push(`empty: ${what} has no text`);
    for (const { words, size, left, right } of texts) {
      if (size < least - 0.1) problems.push(`small: ${what} "${words}" has ${size.toFixed(1)} px, at least ${least.toFixed(1)}`);
      if (left < -1 || right > chart.getWidth() + 1) problems.push(`cut: ${what} "${words}" leaves its drawing`);
    }
    texts.forEach((a, k) => texts.slice(k + 1).forEach((b) => {
      const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      const high = 0.9 * Math.max(a.size, b.size) - Math.abs(a.middle - b.middle);
      if (wide > 1 && high > 0) problems.push(`overlap: ${what} "${a.words}" and "${b.words}" by ${wide.toFixed(0)} x ${high.toFixed(0)} px`);
    }));
  }
  return problems;
}
