"""Modes, motion states and part events are constants of the messages that carry them."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from harness.sources import Module, modules
from scara_control.motion.states import State
from twin_controller.core.lead.modes import Mode

from scara_msgs.msg import MotionState, PartEvent, TwinControllerState

OWN_WORDS = {
    "src/twin_controller/src/twin_controller/core/lead/modes.py",
}
"""The core knows no message; its modes are compared with the constants below."""
ALSO_COMMANDS = {"ESTOP"}
"""Words that are names of commands as well."""


def constants(kind: type) -> dict[str, str]:
    """Return the constants of a message by name."""
    return {name: value for name, value in vars(kind).items() if name.isupper()}


def written_out(module: Module, words: set[str]) -> Iterator[str]:
    """Yield where a module writes one of the words as text."""
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Constant) and node.value in words:
            yield f"{module.relative}:{node.lineno}: {node.value!r}"


def test_the_cores_modes_are_the_messages() -> None:
    """By name and value, none more and none less."""
    assert {mode.name: mode.value for mode in Mode} == constants(TwinControllerState)


def test_the_motion_states_are_the_messages() -> None:
    """By name and value, none more and none less."""
    assert {state.name: state.value for state in State} == constants(MotionState)


def test_no_constant_swallows_a_comment() -> None:
    """A string constant takes the rest of its line, the comment too."""
    values = [
        value
        for kind in (TwinControllerState, MotionState, PartEvent)
        for value in constants(kind).values()
    ]
    assert [value for value in values if not value.isidentifier()] == []


def test_modes_are_not_written_out() -> None:
    """Who compares a mode names the constant, so that a typing error is found."""
    words = set(constants(TwinControllerState).values()) - ALSO_COMMANDS
    found = [
        text
        for module in modules()
        if module.relative not in OWN_WORDS
        for text in written_out(module, words)
    ]
    assert found == []


def test_the_stand_ins_part_events_are_the_messages() -> None:
    """The stand-in has words of its own, as it shares nothing with the twin; they are the same."""
    (module,) = (m for m in modules() if m.relative.endswith("gripping/cell_parts.py"))
    told = {
        node.args[0].value
        for node in ast.walk(module.tree)
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id == "Event"
        and isinstance(node.args[0], ast.Constant)
    }
    assert told == set(constants(PartEvent).values())
