"""Join the farm with a machine of your own: a feeder that counts parts, in plain zenoh and JSON.

Start ``./cell farm``, then ``.venv/bin/python examples/join_the_farm.py``. It shows its state,
keeps a journal with numbers, answers for it, obeys STOP and PAUSE. It imports nothing of this
project: any language with zenoh does the same. The keys and messages: docs/operating/farm.md.
"""

import json
import sys
import threading
import time

import zenoh

CELL = "site/my_machine/feeder"
PORT = int(sys.argv[1]) if len(sys.argv) > 1 else 7447
journal: list[dict] = []  # one event a line; the number grows by 1 and never comes twice
halted = threading.Event()


def note(kind: str, stop: bool, text: str) -> None:
    """Write an event down; the desk asks for those that it has missed."""
    number = len(journal) + 1
    journal.append(
        {"number": number, "time": time.time(), "kind": kind, "stop": stop, "text": text}
    )


def answer_events(query: zenoh.Query) -> None:
    """Answer ``events?since=N``: the events after N, and how far the journal goes."""
    with query:
        since = int(query.parameters.get("since") or 0)
        told = {"first": 1 if journal else 0, "last": len(journal), "events": journal[since:][:500]}
        query.reply(f"{CELL}/events", json.dumps(told))


def answer_command(query: zenoh.Query) -> None:
    """Obey STOP and PAUSE, also late or twice; refuse all else with a reason."""
    with query:
        asked = json.loads(bytes(query.payload))
        good = asked["command"] in ("STOP", "PAUSE")
        if good:
            halted.set()
            note("decision", True, f"{asked['command']} by {asked['person']}@{asked['desk']}")
        text = "received" if good else "only STOP and PAUSE"
        query.reply(f"{CELL}/command", json.dumps({"accepted": good, "text": text}))


def state(sequence: int, parts: int) -> dict:
    """Return what the wall of cells shows; level 0 is good, 2 a warning, 3 bad."""
    stands = halted.is_set()
    return {
        "sequence": sequence,
        "stamp": time.time(),
        "revision": int(stands),
        "level": 2 if stands else 0,
        "mode": "stands" if stands else "feeds",
        "why": f"{parts} parts",
    }


def health() -> dict:
    """Return how far the journal goes; with it the desk finds what it has missed."""
    ends = {"first_event": 1 if journal else 0, "last_event": len(journal)}
    own = {"stamp": time.time(), "uptime_s": time.monotonic(), "cpu_percent": 0.0, "memory_mb": 0.0}
    return {**own, **ends, "dropped": 0}


config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", f'["tcp/127.0.0.1:{PORT}"]')
config.insert_json5("scouting/multicast/enabled", "false")
try:
    line = zenoh.open(config)
except zenoh.ZError:
    sys.exit(f"no desk answers at 127.0.0.1:{PORT}: start one first (./cell farm)")
with line as session:
    session.declare_queryable(f"{CELL}/events", answer_events)
    session.declare_queryable(f"{CELL}/command", answer_command)
    token = session.liveliness().declare_token(f"{CELL}/alive")
    note("start", False, "the feeder was started")
    print(f"{CELL} has joined; Ctrl-C ends it", flush=True)
    sequence = parts = 0
    while True:
        sequence += 1
        parts += not halted.is_set() and sequence % 5 == 0
        session.put(f"{CELL}/state", json.dumps(state(sequence, parts)))
        if sequence % 5 == 0:
            session.put(f"{CELL}/health", json.dumps(health()))
        time.sleep(0.2)
