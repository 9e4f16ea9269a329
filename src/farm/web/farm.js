// Asks for the wall once a second and hands it to the parts of the page.
import { showAlarms } from "./alarms.js";
import { showCards } from "./cards.js";
import { listen, tell, warn } from "./commands.js";
import { offerCells } from "./compare.js";
import { showConfigurations } from "./configurations.js";
import { showEvents } from "./events.js";
import { showFigures } from "./figures.js";
import { byId, clock, put } from "./parts.js";
import { showWorst } from "./worst.js";

const PERIOD_MS = 1000;
const LOST_MS = 3000;
let heard = 0;

function show(wall) {
  showCards(wall.cards, wall.now);
  showWorst(wall.worst, wall.cards);
  offerCells(wall.cards.map((card) => card.name));
  const asking = wall.worst.length - wall.lost;
  const bad = wall.unreadable ? `, ${wall.unreadable} messages could not be read` : "";
  put(byId("summary"), `${wall.cards.length} cells, ${wall.lost} lost, ${asking} need a look${bad}`);
  put(byId("clock"), clock(wall.now));
  showEvents(wall.events, wall.now);
  showAlarms(wall.alarms, wall.waiting, wall.now, tell);
  showConfigurations(wall.configurations);
  warn("wall", wall.trouble ? `Events are not kept: ${wall.trouble}. Nothing is lost: the cells have them.` : "");
}

function lost(why) {
  document.body.classList.toggle("is-lost", why !== "");
  warn("desk", why && `The desk does not answer (${why}). What you see is old. Stop cells at the cells.`);
}

async function look() {
  try {
    const answer = await fetch("/farm/wall", { signal: AbortSignal.timeout(LOST_MS) });
    if (!answer.ok) throw new Error(await answer.text());
    show(await answer.json());
    heard = Date.now();
    lost("");
  } catch (error) {
    if (Date.now() - heard > LOST_MS) lost(error.message);
  }
  setTimeout(look, PERIOD_MS);
}

listen();
look();
showFigures();
