// What a hand cannot touch, an eye cannot read, or hides something else, on the page as it is now.
// Returns sentences; none: all is well. Positions are those of the document, so that nothing is scrolled.
(only) => {
  const TOUCH = 44, BIG = 60, TEXT = 14, TOLERANCE = 0.75;
  const problems = [];
  const name = (element) => {
    const words = (element.innerText || element.getAttribute("aria-label") || "").trim().slice(0, 40);
    return `${element.tagName.toLowerCase()}.${String(element.className).split(" ").slice(0, 3).join(".")} "${words}"`;
  };
  const seen = (element) => (!only || element.closest(only)) && element.checkVisibility({ visibilityProperty: true, opacityProperty: false });
  const rect = (box) => ({ left: box.left + scrollX, right: box.right + scrollX, top: box.top + scrollY, bottom: box.bottom + scrollY });

  // Controls: large enough.
  const controls = new Set();
  for (const found of document.querySelectorAll("button, a[href], input, textarea, [role=slider], [role=checkbox], [role=combobox], iframe")) {
    const control = found.closest(".q-field__control, .q-slider, .q-checkbox, button, a") || found;
    if (seen(control) && !control.closest(".banner:not(:has(button))")) controls.add(control);
  }
  for (const control of controls) {
    const { width, height } = control.getBoundingClientRect();
    const least = control.matches(".stop-button, .jog-button") ? BIG : TOUCH;
    if (width < least - TOLERANCE || height < least - TOLERANCE) {
      problems.push(`touch: ${name(control)} is ${width.toFixed(0)} x ${height.toFixed(0)} px, at least ${least}`);
    }
  }

  // Texts: large enough, not cut, readable.
  const texts = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const node = walker.currentNode, element = node.parentElement;
    if (!node.data.trim() || element.closest("script, style, .q-icon, .echarts, [aria-hidden=true] .q-icon") || !seen(element)) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    const box = range.getBoundingClientRect();
    if (!box.width || !box.height) continue;
    const field = element.closest(".q-field__control")?.getBoundingClientRect();
    if (field && box.bottom > field.bottom + 1) problems.push(`cut: ${name(element)} leaves its field`);
    const frame = clipped(element, box);
    const boxes = [...range.getClientRects()].map(rect).map((line) => within(line, frame));
    texts.push({ element, boxes, style: getComputedStyle(element) });
  }

  function within(line, frame) {
    const [left, right] = [Math.max(line.left, frame.left), Math.min(line.right, frame.right)];
    return { left, right, top: Math.max(line.top, frame.top), bottom: Math.min(line.bottom, frame.bottom) };
  }

  // The part of a text that can be seen; what cannot be scrolled to is cut.
  function clipped(element, box) {
    let [left, right, top, bottom] = [box.left, box.right, box.top, box.bottom];
    for (let above = element; above && above !== document.body; above = above.parentElement) {
      const { overflowX, overflowY } = getComputedStyle(above);
      const isButton = above.matches("button, .plain-button") && box.width > above.clientWidth + 1;
      if (isButton) problems.push(`cut: ${name(above)} is narrower than its text`);
      if (overflowX === "visible" && overflowY === "visible") continue;
      const frame = above.getBoundingClientRect();
      const cut = box.left < frame.left - 1 || box.right > frame.right + 1;
      if (cut && overflowX !== "visible") problems.push(`cut: ${name(element)} is wider than ${name(above)}`);
      const low = box.top < frame.top - 1 || box.bottom > frame.bottom + 1;
      if (low && ["hidden", "clip"].includes(overflowY)) problems.push(`cut: ${name(element)} is higher than ${name(above)}`);
      [left, right] = [Math.max(left, frame.left), Math.min(right, frame.right)];
      [top, bottom] = [Math.max(top, frame.top), Math.min(bottom, frame.bottom)];
      if (low) break; // scrolled out of its list: what is around the list is not its matter
    }
    if (box.right > document.documentElement.clientWidth + 1) problems.push(`cut: ${name(element)} leaves the screen`);
    return rect({ left, right, top, bottom });
  }

  for (const { element, style } of texts) {
    const scale = element.matches(".q-field__label") && element.closest(".q-field--float") ? 0.75 : 1;
    const size = scale * parseFloat(style.fontSize);
    if (size < TEXT - 0.01) problems.push(`small: ${name(element)} has ${size.toFixed(1)} px`);
    const ratio = contrast(element, style);
    const large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
    const off = element.closest("[disabled], .disabled, [aria-disabled=true]");
    if (ratio !== null && !off && ratio < (large ? 3 : 4.5)) problems.push(`contrast: ${name(element)} has ${ratio.toFixed(2)}`);
  }

  // Nothing lies over anything else. A text has a box for each of its lines.
  const boxesOf = ({ element, boxes }) => boxes.map((box) => ({ element, box }));
  const scrolled = ".tab-panel, .plot-choice"; // what is scrolled out of its list lies under nothing
  const free = [...controls].filter((control) => !control.closest(scrolled));
  const things = [
    ...texts.flatMap(boxesOf),
    ...free.flatMap((element) => boxesOf({ element, boxes: [rect(element.getBoundingClientRect())] })),
  ].filter(({ box, element }) => box.right - box.left > 1 && box.bottom - box.top > 1 && !element.closest(".scene-body"));
  for (let i = 0; i < things.length; i += 1) {
    for (let k = i + 1; k < things.length; k += 1) {
      const [a, b] = [things[i], things[k]];
      if (a.element.contains(b.element) || b.element.contains(a.element) || fields(a.element, b.element)) continue;
      const wide = Math.min(a.box.right, b.box.right) - Math.max(a.box.left, b.box.left);
      const high = Math.min(a.box.bottom, b.box.bottom) - Math.max(a.box.top, b.box.top);
      if (wide > 2 && high > 4) problems.push(`overlap: ${name(a.element)} and ${name(b.element)} by ${wide.toFixed(0)} x ${high.toFixed(0)} px`);
    }
  }
  // The words of one field belong together.
  function fields(a, b) {
    const field = a.closest(".q-field, .q-slider");
    return field && field === b.closest(".q-field, .q-slider");
  }
  if (document.documentElement.scrollWidth > document.documentElement.clientWidth) problems.push("the page scrolls sideways");
  return [...new Set(problems)];

  // WCAG 2.2, contrast ratio of a text; null where a picture lies behind it.
  function contrast(element, style) {
    let back = null;
    const layers = [];
    for (let above = element; above; above = above.parentElement) {
      const own = getComputedStyle(above);
      if (own.backgroundImage !== "none") return null;
      const colour = rgba(own.backgroundColor);
      layers.push(colour);
      if (colour[3] === 1) break;
    }
    for (const layer of layers.reverse()) back = back ? over(layer, back) : layer;
    const [light, dark] = [luminance(over(rgba(style.color), back)), luminance(back)].sort((x, y) => y - x);
    return (light + 0.05) / (dark + 0.05);
  }
  function rgba(text) {
    const numbers = text.match(/[\d.]+/g).map(Number);
    if (text.startsWith("color(")) return [...numbers.slice(0, 3).map((v) => 255 * v), numbers[3] ?? 1];
    return [numbers[0], numbers[1], numbers[2], numbers[3] ?? 1];
  }
  function over(top, under) {
    return [0, 1, 2].map((k) => top[3] * top[k] + (1 - top[3]) * under[k]).concat(1);
  }
  function luminance(colour) {
    const linear = colour.slice(0, 3).map((value) => value / 255).map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
  }
}
