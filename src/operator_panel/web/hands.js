// Hands of the operator: jog buttons that act only while they are held.

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
