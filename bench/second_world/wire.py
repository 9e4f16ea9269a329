"""Refused commands to the motion nodes with their gate: set points that they send all the same."""

from __future__ import annotations

import os
from pathlib import Path

import rospy
from harness.ros import Master, Ros
from harness.second_world.gated_nodes import GatedNodes, refused_targets
from harness.workspace import workspace_environment
from rich.console import Console

from bench.second_world.figure import Figure

LOT = 100


def measure(count: int, folder: Path, console: Console) -> list[Figure]:
    """Ask for ``count`` refused moves, half by the service, half as goals of the action."""
    targets = refused_targets(count)
    master = Master(folder / "master", workspace_environment())
    names = ("ROS_MASTER_URI", "ROS_HOME", "ROS_LOG_DIR")
    os.environ.update({name: master.env[name] for name in names})
    rospy.init_node("bench", disable_signals=True)
    ros = Ros(master, folder / "nodes", "wire")
    try:
        cell, wrong, judged = GatedNodes(ros, folder / "config"), list[str](), 0
        for begin in range(0, count, LOT):
            more, refused = cell.refuse(targets[begin : begin + LOT])
            wrong, judged = wrong + more, judged + refused
            sent = len(cell.setpoints)
            console.print(f"{begin + LOT} refused commands: {sent} set points")
    finally:
        ros.close()
        rospy.signal_shutdown("measured")
        master.close()
    (folder / "what_if_wire.txt").write_text("\n".join(wrong) + "\n", encoding="utf-8")
    note = f"{count} commands, half by service, half as goals; {judged} refused by the judge, "
    note += f"{len(wrong)} with another answer"
    return [Figure("refused commands, set points sent", "", 0.0, sent, note=note, always=True)]
