// Notes which controls of the page were shown, and which were clicked or moved, by place and words.
// Installed once; window.controls.look() takes in what is shown now, window.controls.left() returns what nobody touched.
() => {
  const ALL = "button, a[href], summary, input, textarea, [role=slider], [role=checkbox], [role=switch], [role=combobox]";
  const PLACES = "[data-way-panel], [data-panel], [data-motion], [data-time-line], [data-plot-choice], .q-dialog, .charts-card, .strip";
  const [shown, touched] = [new Set(), new Set()];

  const controlOf = (element) => {
    const found = element.closest?.(ALL) || element.closest?.(".q-field, .q-slider, .q-checkbox, .q-toggle");
    return found && (found.closest(".q-field, .q-slider, .q-checkbox, .q-toggle") || found);
  };
  const placeOf = (control) => {
    const place = control.closest(PLACES);
    return place?.dataset.wayPanel || place?.dataset.panel || place?.classList[0] || "page";
  };
  const wordsOf = (control) => {
    const label = control.querySelector(".q-field__label, .q-checkbox__label, .q-toggle__label")?.textContent;
    const words = label || control.getAttribute("aria-label") || control.textContent.trim();
    // Words that change with what the control does are one control.
    const kind = ["data-pause", "data-motion-play", "data-look-back", "data-teach-line"].find((name) => control.hasAttribute(name));
    const theme = control.matches(".theme") && "theme";
    return theme || kind || words.replace(/ \(\d+\)$/, "") || control.tagName;
  };
  // Greyed for good: this robot does not have it, and a text that can be seen says why.
  const isGreyed = (control) => {
    const reason = document.getElementById(control.getAttribute("aria-describedby"));
    return control.disabled && reason?.checkVisibility({ visibilityProperty: true }) && reason.innerText.trim() !== "";
  };
  const nameOf = (control) => `${placeOf(control)}: ${wordsOf(control)}`;

  for (const kind of ["pointerdown", "click", "input"]) {
    const note = (event) => {
      const control = event.isTrusted && controlOf(event.target);
      if (control) touched.add(nameOf(control));
    };
    document.addEventListener(kind, note, true);
  }
  window.controls = {
    look() {
      for (const element of document.querySelectorAll(ALL)) {
        const control = controlOf(element);
        if (control.checkVisibility({ visibilityProperty: true }) && !isGreyed(control)) shown.add(nameOf(control));
      }
    },
    left() {
      return [...shown].filter((name) => !touched.has(name)).sort();
    },
    count: () => touched.size,
  };
}
