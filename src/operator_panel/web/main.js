// The page's own part in the browser: it shows what comes over the live connection and tells what is held.
import { Live } from "./live.js";
import { Texts } from "./texts.js";
import { Scene } from "./scene.js";
import { Camera } from "./camera.js";
import { Charts } from "./charts.js";
import { Stop } from "./stop.js";
import { Events } from "./events.js";
import { watchJog } from "./hands.js";
import { TimeLine } from "./past.js";
import { Drag } from "./picture/drag.js";
import { MotionLine } from "./preview/motion.js";

const told = window.PANEL;

function startTabs() {
  const buttons = [...document.querySelectorAll("[data-tab]")];
  const panels = [...document.querySelectorAll("[data-panel]")];
  const show = (name) => {
    for (const button of buttons) button.setAttribute("aria-selected", button.dataset.tab === name);
    for (const panel of panels) panel.classList.toggle("shown", panel.dataset.panel === name);
    sessionStorage.setItem("panel_tab", name);
    window.dispatchEvent(new Event("resize"));
  };
  for (const button of buttons) button.addEventListener("click", () => show(button.dataset.tab));
  const kept = sessionStorage.getItem("panel_tab");
  show(buttons.some((button) => button.dataset.tab === kept) ? kept : buttons[0].dataset.tab);
}

// One way of jogging at a time, and one length, frame and pace for all of them; no choice outlives the page,
// because the server knows length and frame only from here.
function startJogWays() {
  choice("way", "hold", (way) => {
    for (const panel of document.querySelectorAll("[data-way-panel]")) {
      panel.classList.toggle("shown", panel.dataset.wayPanel === way);
    }
  });
  choice("step", "1");
  choice("frame", "world");
  choice("pace", "slow");
}

// Buttons that stay pressed: whether the eye goes with the tool, and whether a pointer drags the twin's tool. One that
// has turned grey is let go: nobody could press it again.
function startPressed(kind, then = () => {}) {
  const button = document.querySelector(`[data-${kind}]`);
  if (!button) return;
  const isPressed = () => button.getAttribute("aria-pressed") === "true";
  const press = (pressed) => {
    button.setAttribute("aria-pressed", pressed);
    then(pressed);
  };
  button.addEventListener("click", () => press(!isPressed()));
  const looked = new MutationObserver(() => button.disabled && isPressed() && press(false));
  looked.observe(button, { attributeFilter: ["disabled"] });
}

// Buttons of which one is chosen, wherever they stand; the server may make some anew.
function choice(kind, first, then = () => {}) {
  const one = `[data-${kind}]`;
  const choose = (value) => {
    for (const button of document.querySelectorAll(one)) button.setAttribute("aria-selected", button.dataset[kind] === value);
    then(value);
  };
  document.addEventListener("click", (event) => {
    const button = event.target.closest(one);
    if (button) choose(button.dataset[kind]);
  });
  choose(first);
}

// What the server would hear only later is not pressed at all: it would be done when the connection is back, behind a
// STOP that was not sent. What was pressed just before the loss was seen is forgotten, where it still waits here.
const PRESSES = ["click", "beforeinput", "change", "keydown"];

function barWhileLost(live, stop) {
  const bar = (event) => {
    if ((live.open && window.socket.connected) || event.target.closest?.("[data-stop]")) return;
    if (event.type === "keydown" && event.key !== "Enter") return;
    event.preventDefault();
    event.stopImmediatePropagation();
  };
  for (const kind of PRESSES) document.addEventListener(kind, bar, true);
  window.socket.io.on("reconnect_attempt", forgetPresses);
  window.socket.io.on("open", forgetPresses); // what waits is sent right after it
  // The server may not know what was chosen or typed right before the loss, and nobody tells it again.
  window.socket.io.on("reconnect", () => {
    stop.keep();
    window.location.reload();
  });
}

function forgetPresses() {
  window.socket.sendBuffer = window.socket.sendBuffer.filter((packet) => packet.data[0] !== "event");
}

function tabId() {
  const kept = sessionStorage.getItem("panel_tab_id");
  const id = kept || `${Date.now()}-${Math.random()}`;
  sessionStorage.setItem("panel_tab_id", id);
  return id;
}

function start() {
  const texts = new Texts();
  let odd = false;
  const scene = new Scene(told.scene);
  const charts = new Charts(told.charts);
  let newest = null;
  const timeLine = new TimeLine({
    show: (look) => {
      texts.showPast(look.frame);
      const { pose, people } = look.frame;
      scene.show({ pose, people }); // without the tools: trails are of now
      scene.showParts(look.parts);
      charts.hold(look.rows);
      events.mark(look.at, look.events);
    },
    opened: () => {
      if (motion.isOpen) motion.close();
      document.querySelector("[data-guide][aria-pressed=true]")?.click(); // a pointer turns that picture
    },
    live: () => {
      if (newest) scene.showParts(newest);
      charts.hold(null);
      events.mark(null);
    },
  });
  const motion = new MotionLine(
    (pose) => scene.preview(pose),
    () => timeLine.isPast && timeLine.close(),
  );
  const live = new Live(`${told.live}?page=${told.page}&tab=${encodeURIComponent(tabId())}`, {
    frame(frame) {
      stop.look(frame);
      // Where the processor draws, every second frame is enough to read.
      odd = !odd;
      if (!odd || !scene.software || frame.silent) {
        texts.show(frame, timeLine.isPast);
        if (!timeLine.isPast) scene.show(frame);
      }
      if (frame.point) charts.add(frame.t, frame.point);
    },
    lists: (lists) => texts.showLists(lists),
    events: (list) => events.show(list),
    parts: (parts) => {
      newest = parts;
      if (!timeLine.isPast) scene.showParts(parts);
    },
    history: (rows) => charts.restart(rows),
    refused: () => {}, // the place of the commands says why
    stopped: (answer) => stop.answered(answer),
    lost: (since) => {
      texts.lost(since);
      stop.forget();
      forgetPresses();
    },
    back: () => texts.back(),
  });
  const stop = new Stop(live);
  const events = new Events(live);
  barWhileLost(live, stop);
  startTabs();
  startJogWays();
  startPressed("follow");
  startPressed("guide", (on) => scene.guide(on));
  new Camera();
  if (told.operator) {
    watchJog(live, told.jog_period_ms, (event) => scene.placeUnder(event));
    new Drag(scene, document.querySelector("[data-drag]"));
  }
  window.panel = {
    typed: () => motion.typed(),
    preview: (pose) => motion.aim(pose),
    judging: (title) => motion.wait(title),
    judged: (found) => motion.take(found),
    live,
    scene,
    timeLine,
  };
}

// nicegui builds the page after this file is loaded.
const waiting = setInterval(() => {
  if (!document.querySelector("[data-panel]") || typeof getElement !== "function") return;
  clearInterval(waiting);
  start();
}, 20);
