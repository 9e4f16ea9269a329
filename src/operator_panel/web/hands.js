// Hands of the operator: jog buttons that act only while they are held, by a finger, a mouse or the Enter key; and the
// twin's tool, dragged in the picture while Guide is pressed.
const HELD = "[data-jog], [data-axis]";
// In a picture of the past the tool is not where it is drawn.
const GUIDE = "body:not(.is-past) [data-guide][aria-pressed=true]";

// A press has a number that grows; signs are sent until the button is let go, the pointer leaves, or the page loses
// focus. A press that was let go, or that the server let die, never counts again: the next touch is a new one.
export function watchJog(live, periodMs, placeUnder) {
  let held = null;
  let last = 0;

  const release = () => {
    if (held === null) return;
    clearInterval(held.timer);
    held.button.classList.remove("held");
    held.area.removeEventListener("pointerleave", release);
    live.send({ release: held.press });
    held = null;
  };

  // What the button moved when it was pressed: who changes the choice meanwhile changes the next press.
  const way = (button) => {
    const direction = Number(button.dataset.direction);
    if (button.dataset.jog) return { joint: button.dataset.jog, direction };
    return { axis: button.dataset.axis, direction, frame: chosen("frame"), fast: chosen("pace") === "fast" };
  };

  const sign = () => {
    if (held.button.disabled || !live.open || (held.way.guide && !held.button.matches(GUIDE))) return release();
    const percent = held.way.joint ? { percent: Number(window.panelJogPercent) } : {};
    live.send({ hold: held.press, ...held.way, ...percent });
  };

  const press = (button, pointer, area = button, moved = way(button)) => {
    last = Math.max(Date.now(), last + 1);
    held = { button, press: last, pointer, area, way: moved };
    button.classList.add("held");
    sign();
    if (held !== null) held.timer = setInterval(sign, periodMs);
  };

  document.addEventListener("pointerdown", (event) => {
    const picture = event.target.closest?.(".scene");
    const guide = picture && document.querySelector(GUIDE);
    const button = guide || event.target.closest?.(HELD);
    if (!button || button.disabled || held !== null || event.button !== 0) return;
    const place = guide && placeUnder(event);
    if (guide && !place) return;
    if (event.target.hasPointerCapture?.(event.pointerId)) event.target.releasePointerCapture(event.pointerId);
    event.preventDefault();
    const area = guide ? picture : button;
    area.addEventListener("pointerleave", release, { once: true });
    press(button, event.pointerId, area, guide ? { guide: place } : way(button));
  });
  document.addEventListener("pointermove", (event) => {
    if (held?.way.guide && held.pointer === event.pointerId) held.way.guide = placeUnder(event) ?? held.way.guide;
  });
  for (const kind of ["pointerup", "pointercancel"]) {
    document.addEventListener(kind, (event) => held?.pointer === event.pointerId && release());
  }
  // Before the buttons themselves: they let no Enter through.
  const keyed = { capture: true };
  document.addEventListener("keydown", (event) => {
    if (held !== null && event.key !== "Enter") return release(); // another key: STOP, or the hand has moved on
    const button = event.target.closest?.(HELD);
    if (event.key !== "Enter" || event.repeat || !button || button.disabled || held !== null) return;
    event.preventDefault();
    press(button, null);
  }, keyed);
  document.addEventListener("keyup", (event) => event.key === "Enter" && held?.pointer === null && release(), keyed);
  document.addEventListener("focusout", () => held?.pointer === null && release());
  document.addEventListener("contextmenu", (event) => event.target.closest?.(HELD) && event.preventDefault());
  document.addEventListener("visibilitychange", () => document.hidden && release());
  window.addEventListener("blur", release);
  window.addEventListener("pagehide", release);
}

function chosen(kind) {
  return document.querySelector(`[data-${kind}][aria-selected="true"]`).dataset[kind];
}
