// The newest lines of all journals.
import { byId, clock, make } from "./parts.js";

const shown = new Set();
const idOf = (event) => `${event.cell} ${event.number} ${event.time}`;

export function showEvents(events, now) {
  const list = byId("events");
  for (const event of [...events].reverse()) {
    if (shown.has(idOf(event))) continue;
    shown.add(idOf(event));
    const line = make("li", "event");
    if (event.stop) line.dataset.is = "bad";
    const head = `${clock(event.time, now)} ${event.cell} ${event.kind}`;
    line.append(make("span", "event-head", head), make("span", "event-text", event.text));
    list.prepend(line);
  }
  while (list.childElementCount > events.length) list.lastElementChild.remove();
  if (shown.size > 20 * Math.max(events.length, 50)) {
    shown.clear();
    for (const event of events) shown.add(idOf(event));
  }
}
