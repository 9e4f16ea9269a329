"""Words of the messages are their constants; expressions for names fit the whole of a name."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

import msgspec
import pytest
from farm.config import Name as FarmName
from harness.sources import Module, modules
from harness.workspace import ROOT
from operator_panel.config import Origin
from scara_config.quantities import PersonName, VariableName
from scara_control.motion.commands import State
from twin_controller.core.control import ENDING
from twin_controller.core.lead.modes import Mode

from scara_msgs.msg import MotionState, PartEvent, TwinControllerState

OWN_WORDS = {
    "src/twin_controller/src/twin_controller/core/lead/modes.py",
    "src/scara_ros/src/scara_ros/page/page_words.py",
}
"""The core knows no message; its modes are compared with the constants below. The words of pages
are used by a desk without messages; farm/test_same_look.py compares them."""
ALSO_COMMANDS = {"ESTOP", "STANDSTILL"}
"""Words that are names of commands as well."""


def constants(kind: type) -> dict[str, str]:
    """Return the constants of a message by name."""
    return {name: value for name, value in vars(kind).items() if name.isupper()}


def written_out(module: Module, words: set[str]) -> Iterator[str]:
    """Yield where a module writes one of the words as text."""
    for node in module.nodes:
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
    kinds = (TwinControllerState, MotionState, PartEvent)
    values = [value for kind in kinds for value in constants(kind).values()]
    assert [value for value in values if not value.isidentifier()] == []


def test_the_services_name_all_commands_that_end_a_motion() -> None:
    """Who reads a line about stops learns of each of them."""
    folder = ROOT / "src" / "scara_msgs" / "srv" / "twin_controller"
    lines = [text for file in folder.glob("*.srv") for text in file.read_text().splitlines()]
    told = [text for text in lines if "PAUSE" in text]
    assert len(told) == 6
    assert [text for text in told if any(word not in text for word in ENDING)] == []


def test_modes_are_not_written_out() -> None:
    """Who compares a mode names the constant, so that a typing error is found."""
    words = set(constants(TwinControllerState).values()) - ALSO_COMMANDS
    judged = [module for module in modules() if module.relative not in OWN_WORDS]
    assert [text for module in judged for text in written_out(module, words)] == []


def test_the_stand_ins_part_events_are_the_messages() -> None:
    """The stand-in has words of its own, as it shares nothing with the twin; they are the same."""
    (module,) = (m for m in modules() if m.relative.endswith("gripping/cell_parts.py"))
    told = {
        node.args[0].value
        for node in module.nodes
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id == "Event"
        and isinstance(node.args[0], ast.Constant)
    }
    assert told == set(constants(PartEvent).values())


_EXPRESSIONS = {"match", "search", "compile", "fullmatch", "sub", "split", "findall", "finditer"}
_END = re.compile(r"(?<!\\)(?:\\\\)*\$")
"""A dollar sign that is not escaped."""


def expressions(module: Module) -> Iterator[tuple[int, str]]:
    """Yield line and text of each regular expression: of ``re``, of ``Meta``, and by its form."""
    for node in module.nodes:
        found: ast.expr | None = None
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            of_re = isinstance(node.func.value, ast.Name) and node.func.value.id == "re"
            if of_re and node.func.attr in _EXPRESSIONS and node.args:
                found = node.args[0]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            if node.func.id == "Meta":
                found = next((each.value for each in node.keywords if each.arg == "pattern"), None)
        elif isinstance(node, ast.Assign):
            found = node.value
            if not isinstance(found, ast.Constant) or not str(found.value).startswith("^"):
                continue
        parts = found.values if isinstance(found, ast.JoinedStr) else [found]
        for part in parts:
            if isinstance(part, ast.Constant) and isinstance(part.value, str):
                yield part.lineno, part.value


def test_no_expression_ends_before_a_line_end() -> None:
    """A dollar fits before a last line end too, so a name could hold one: fullmatch, or Z."""
    found = [
        f"{module.relative}:{line}: {text}"
        for module in modules()
        for line, text in expressions(module)
        if _END.search(re.sub(r"\[[^\]]*\]", "", text))
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        (PersonName, "ann"),
        (VariableName, "SCARA_TOKEN"),
        (FarmName, "machine-1"),
        (Origin, "http://localhost:80"),
    ],
)
def test_name_with_a_line_end_is_none(kind: object, name: str) -> None:
    """Whoever writes it into a file or a header says something else than was checked."""
    assert msgspec.convert(name, kind) == name
    with pytest.raises(msgspec.ValidationError, match="regex"):
        msgspec.convert(f"{name}\n", kind)
