// STOP and PAUSE of one cell or of all, and what each cell answers.
import { answerOn } from "./cards.js";
import { byId, clock, make, put } from "./parts.js";

const MOST_ANSWERS = 200;
const wrong = { command: "", desk: "", wall: "" };

// The whole width says what is wrong; a command that was not sent comes first.
export function warn(of, text) {
  wrong[of] = text;
  const said = wrong.command || wrong.desk || wrong.wall;
  put(byId("banner"), said);
  byId("banner").classList.toggle("hidden", !said);
}

export function tell(text, is) {
  const list = byId("answers");
  const line = make("li", "answer", `${clock(Date.now() / 1000)} ${text}`);
  line.dataset.is = is;
  list.prepend(line);
  while (list.childElementCount > MOST_ANSWERS) list.lastElementChild.remove();
}

function answered(command, said) {
  const is = said.good ? "good" : "bad";
  tell(`${command} ${said.text}`, is);
  answerOn(said.cell, said.text.replace(`${said.cell}: `, ""), is);
}

async function send(command, cell) {
  tell(`${command} ${cell} ...`, "asked");
  answerOn(cell, `${command} sent`, "asked");
  warn("command", "");
  try {
    const answer = await fetch("/farm/command", {
      method: "POST",
      headers: { "content-type": "application/json" },
      body: JSON.stringify({ command, cell }),
    });
    if (!answer.ok) throw new Error(await answer.text());
    const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
    let rest = "";
    for (;;) {
      const { value, done } = await reader.read();
      if (done) break;
      const lines = (rest + value).split("\n");
      rest = lines.pop();
      for (const line of lines) answered(command, JSON.parse(line));
    }
  } catch (error) {
    const text = `${command} ${cell}: not sent, or no answer: use the STOP at the cell. ${error.message}.`;
    tell(text, "bad");
    answerOn(cell, "Not sent, or no answer: use the STOP at the cell.", "bad");
    warn("command", text);
  }
}

// A press counts, not its end: a stop does not wait for the finger to leave. Keys and screen readers make a click
// without a press.
export function listen() {
  document.addEventListener("pointerdown", (event) => {
    const pressed = event.target.closest("[data-command]");
    if (pressed && event.button === 0) send(pressed.dataset.command, pressed.dataset.cell);
  });
  document.addEventListener("click", (event) => {
    const pressed = event.target.closest("[data-command]");
    if (pressed && event.detail === 0) send(pressed.dataset.command, pressed.dataset.cell);
  });
}
