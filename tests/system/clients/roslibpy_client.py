"""An unmodified roslibpy client, in a process of its own.

Subscribe to /twin/joint_states, call /move_to.

Usage: roslibpy_client.py PORT. Prints one line of JSON.
"""

from __future__ import annotations

import json
import sys
import threading

import roslibpy

TARGET = (0.51, 0.16, 0.10)


def main() -> None:
    """Use the gateway as any rosbridge client would."""
    ros = roslibpy.Ros(host="127.0.0.1", port=int(sys.argv[1]))
    ros.run(timeout=10)
    states: list[dict[str, list[str]]] = []
    enough = threading.Event()

    def keep(message: dict[str, list[str]]) -> None:
        states.append(message)
        if len(states) >= 10:
            enough.set()

    topic = roslibpy.Topic(ros, "/twin/joint_states", "sensor_msgs/JointState")
    topic.subscribe(keep)
    assert enough.wait(10), f"only {len(states)} joint states came"
    service = roslibpy.Service(ros, "/move_to", "scara_msgs/MoveTo")
    x, y, z = TARGET
    answer = service.call(roslibpy.ServiceRequest({"x": x, "y": y, "z": z}), timeout=60)
    refused = service.call(roslibpy.ServiceRequest({"x": 0.9, "y": 0.0, "z": 0.0}), timeout=60)
    topic.unsubscribe()
    result = {
        "names": list(states[0]["name"]),
        "states": len(states),
        "success": answer["success"],
        "error": answer["error"],
        "refused": {"success": refused["success"], "message": refused["message"]},
        "target": TARGET,
    }
    print(json.dumps(result), flush=True)
    ros.terminate()


if __name__ == "__main__":
    main()
