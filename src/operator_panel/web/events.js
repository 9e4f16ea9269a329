// The list of events: filtered here, acknowledged by the server for all pages.
import { secondsOf } from "./past/clock.js";
import { line } from "./texts.js";

const KEPT = "panel_events";
const NAMES = { info: "Info", warning: "Warning", fault: "Fault" };

export class Events {
  constructor(live) {
    this.live = live;
    this.events = [];
    this.place = document.querySelector("[data-event-list]");
    this.buttons = [...document.querySelectorAll("[data-events]")];
    for (const button of this.buttons) button.addEventListener("click", () => this.choose(button.dataset.events));
    document.addEventListener("click", (event) => {
      const button = event.target.closest?.("[data-acknowledge]");
      if (button) this.live.send({ acknowledge: Number(button.dataset.acknowledge) });
    });
    this.choose(sessionStorage.getItem(KEPT) || "");
  }

  choose(filter) {
    this.filter = filter;
    sessionStorage.setItem(KEPT, filter);
    for (const button of this.buttons) button.setAttribute("aria-selected", button.dataset.events === filter);
    this.show(this.events);
  }

  // The events up to a moment of the past [s since 1970], those of a recording if they are given; null: all.
  mark(at, recorded = null) {
    this.until = recorded ? null : at;
    this.recorded = recorded;
    this.show(this.events);
  }

  show(events) {
    this.events = events;
    const chosen = (this.recorded || events).filter((event) => {
      if (this.until && secondsOf(event.time) > this.until) return false; // its time is cut to seconds
      if (this.filter === "open") return isOpen(event);
      return this.filter === "" || event.severity !== "info";
    });
    const rows = chosen.map((event) => this.row(event));
    this.place.replaceChildren(...(rows.length ? rows : [line("li", "event-none", "No event")]));
  }

  row(event) {
    const item = line("li", `event event-${event.severity}`, "");
    const [date, time] = event.time.split("T");
    const head = line("span", "event-head", "");
    const clock = Object.assign(line("time", "num", time), { title: date });
    head.append(clock, line("b", "event-severity", NAMES[event.severity]), line("span", "event-source", event.source));
    item.append(head, line("span", "event-text", event.text));
    if (event.by) item.append(line("span", "event-by", `Acknowledged by ${event.by}, ${event.at.split("T")[1]}`));
    else if (!this.recorded && isOpen(event) && window.PANEL.operator) item.append(this.button(event));
    return item;
  }

  button(event) {
    const button = line("button", "button plain-button", "Acknowledge");
    button.type = "button";
    button.dataset.acknowledge = event.number;
    return button;
  }
}

function isOpen(event) {
  return event.severity !== "info" && !event.by;
}
