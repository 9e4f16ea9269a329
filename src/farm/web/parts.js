// What all parts of the page need.
const DAY_MS = 86400000;
export const byId = (name) => document.getElementById(name);

export function make(tag, classes, text = "") {
  const element = document.createElement(tag);
  element.className = classes;
  element.textContent = text;
  return element;
}

export function makeButton(classes, text, label = text) {
  const button = make("button", `button ${classes}`, text);
  button.type = "button";
  button.setAttribute("aria-label", label);
  return button;
}

export function put(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export function ago(seconds) {
  if (seconds < 60) return `${Math.max(0, Math.floor(seconds))} s`;
  if (seconds < 3600) return `${Math.floor(seconds / 60)} min`;
  if (seconds < 172800) return `${Math.floor(seconds / 3600)} h`;
  return `${Math.floor(seconds / 86400)} days`;
}

// As the operator's page shows times: in the browser's zone, 24 hours. What is of another day says which.
export function clock(at, now = at) {
  const date = new Date(1000 * at);
  const text = date.toLocaleTimeString("en-GB", { hourCycle: "h23" });
  const isOld = Math.abs(now - at) * 1000 > DAY_MS || date.getDate() !== new Date(1000 * now).getDate();
  return isOld ? `${date.toLocaleDateString("sv")} ${text}` : text;
}
