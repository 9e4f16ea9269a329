"""The pendant page's own script: what is pressed while the page's line is lost."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import playwright
import pytest
from fanuc_emulator.pendant.pendant_view_io import WHILE_LOST

NODE = Path(playwright.__file__).parent / "driver" / "node"
# As much of a browser as the script asks for.
BROWSER = """
const heard = {}, on = (kind, act) => (heard[kind] = act);
const socket = { connected: true, io: { on }, sendBuffer: [] };
globalThis.document = { addEventListener: on };
globalThis.window = { socket };
const press = () => {
  let passes = true;
  heard.click({ preventDefault: () => {}, stopImmediatePropagation: () => (passes = false) });
  return passes;
};
"""
LOSS = """
const presses = [press()];
socket.connected = false;
presses.push(press());
socket.sendBuffer = [{ data: ["event", "a key"] }, { data: ["ack", 7] }];
heard["%s"]();
socket.connected = true;
presses.push(press());
console.log(JSON.stringify([presses, socket.sendBuffer.map((packet) => packet.data[0])]));
"""


@pytest.mark.parametrize("kind", ["reconnect_attempt", "open"])
def test_nothing_that_is_pressed_while_the_line_is_lost_is_done_later(kind: str) -> None:
    """It would start a program behind a STOP: what waits is forgotten, and no key counts."""
    script = BROWSER + WHILE_LOST + LOSS % kind
    words = [str(NODE), "--input-type=module", "-e", script]
    done = subprocess.run(words, capture_output=True, text=True, check=True, timeout=60.0)
    assert json.loads(done.stdout) == [[True, False, True], ["ack"]]
