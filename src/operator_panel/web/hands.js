// Hands of the operator: STOP by the keyboard, jog buttons that act only while they are held.
const TYPING = "input, textarea, select, [contenteditable=true]";

// Escape stops always, space wherever it is not typed into a field.
export function watchKeys(live, complain) {
  window.addEventListener(
    "keydown",
    (event) => {
      const isSpace = event.code === "Space" && !event.target.closest?.(TYPING);
      if (event.code !== "Escape" && !isSpace) return;
      if (isSpace) event.preventDefault(); // else it would press the focused button too
      if (isSpace) event.stopPropagation();
      if (event.repeat) return;
      if (!live.send({ command: "STOP" })) complain("STOP was NOT sent: no connection. Use the robot's own stop.");
    },
    true,
  );
}

// A press has a number that grows; signs are sent until the button is let go, the pointer leaves, or the page loses focus.
export function watchJog(live, periodMs) {
  let held = null;

  const release = () => {
    if (held === null) return;
    clearInterval(held.timer);
    held.button.classList.remove("held");
    live.send({ release: held.press });
    held = null;
  };

  const sign = () => {
    if (held.button.disabled || !live.open) return release();
    const { jog, direction } = held.button.dataset;
    live.send({ hold: held.press, joint: jog, direction: Number(direction), percent: Number(window.panelJogPercent) });
  };

  document.addEventListener("pointerdown", (event) => {
    const button = event.target.closest?.("[data-jog]");
    if (!button || button.disabled || held !== null || event.button !== 0) return;
    if (event.target.hasPointerCapture?.(event.pointerId)) event.target.releasePointerCapture(event.pointerId);
    event.preventDefault();
    held = { button, press: Date.now(), pointer: event.pointerId };
    button.classList.add("held");
    button.addEventListener("pointerleave", release, { once: true });
    sign();
    if (held !== null) held.timer = setInterval(sign, periodMs);
  });
  for (const kind of ["pointerup", "pointercancel"]) {
    document.addEventListener(kind, (event) => held?.pointer === event.pointerId && release());
  }
  document.addEventListener("contextmenu", (event) => event.target.closest?.("[data-jog]") && event.preventDefault());
  document.addEventListener("visibilitychange", () => document.hidden && release());
  window.addEventListener("blur", release);
  window.addEventListener("pagehide", release);
}
