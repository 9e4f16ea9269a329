"""Names that are reserved: the rule, and that the shipped list holds all of the cell's names."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import pytest
from harness.opponents.graph_and_clients import SHIPPED, TAKES
from harness.workspace import ROOT
from rosbridge_gateway.config import Reserved, RoleRules
from rosbridge_gateway.protocol.roles import HIDDEN, Roles, taken, with_person, without_token

COMMANDS = {"motion_command", "joint_vel_controller/command"}
COMMANDS |= {"twin/joint_1_velocity_controller/command"}
"""What nodes of the cell publish and an operator may publish too."""
SHARED = COMMANDS | {"joint_trajectory_action/goal", "people/nearest"}
BESIDES = {
    "publish": {"/clock", "/tf", "/tf_static", "/diagnostics", "/rosout"},
    "advertise_service": {"/rosapi/get_time", "simulator/set_logger_level"},
}
"""Names that ROS gives to nodes of a cell, in no table of the document."""


def with_all_rights(**changes: list[str]) -> RoleRules:
    """Return a role that may do everything but what is reserved."""
    rights = ("publish", "subscribe", "call_service", "advertise_service")
    return RoleRules("", None, 0, TAKES, **{right: ["/*"] for right in rights} | changes)


ROLES = Roles(
    {"all": with_all_rights(), "owner": with_all_rights(publish=["/*", "lamp/state"])},
    Reserved(publish=["lamp/*", "/clock"], shared=["lamp/*_command"], advertise_service=["lamp/*"]),
    "/cell",
)


@pytest.mark.parametrize(
    ("role", "op", "name", "refused"),
    [
        ("all", "publish", "/cell/lamp/state", True),
        ("all", "advertise", "/cell/lamp/state", True),
        ("all", "publish", "/clock", True),
        ("all", "advertise_service", "/cell/lamp/switch", True),
        ("all", "publish", "/cell/lamp/on_command", False),
        ("all", "advertise_service", "/cell/lamp/on_command", True),
        ("all", "publish", "/cell/clock", False),
        ("all", "publish", "/lamp/state", False),
        ("all", "publish", "/cell/lamps", False),
        ("all", "subscribe", "/cell/lamp/state", False),
        ("all", "call_service", "/cell/lamp/switch", False),
        ("owner", "publish", "/cell/lamp/state", False),
        ("owner", "publish", "/cell/lamp/colour", True),
        ("owner", "advertise_service", "/cell/lamp/state", True),
    ],
)
def test_reserved_name_is_for_a_role_that_names_it_outright(
    role: str, op: str, name: str, refused: bool
) -> None:
    """A pattern with * reaches no reserved name; to hear and to call is not concerned."""
    reason = ROLES.authorise(role, op, name)
    assert (reason is not None) == refused
    if refused:
        assert re.fullmatch(f"{name} is (published|offered) by the cell's own nodes only", reason)


def test_nodes_that_have_a_name_are_told() -> None:
    """At most three of them."""
    assert taken("/t", "published", []) is None
    assert taken("/t", "published", ["/b", "/a"]) == "/t is published by /a, /b already"
    nodes = [f"/n{k}" for k in range(9)]
    assert taken("/t", "offered", nodes) == "/t is offered by /n0, /n1, /n2 and 6 more already"


def documented(kind: str) -> Iterator[str]:
    """Yield the names that docs/interfaces.md gives to the cell's nodes as ``kind``."""
    text = (ROOT / "docs" / "interfaces.md").read_text(encoding="utf-8")
    for row in re.findall(r"^\| (`.*)$", text, re.MULTILINE):
        names, _, direction, *_ = row.split("|")
        if direction.strip().startswith(kind):
            for name in re.findall(r"`([^`]+)`", names):
                yield re.sub(r"<\w+>", "joint_1", name.replace("...", "twin/joint_1"))


@pytest.mark.parametrize(("kind", "op"), [("out", "publish"), ("service", "advertise_service")])
def test_all_that_the_cells_nodes_publish_and_offer_is_reserved(kind: str, op: str) -> None:
    """A name that is missing here could be taken while its node is not up."""
    roles = Roles(SHIPPED.roles, SHIPPED.reserved, "/cell")
    names = set(documented(kind)) | BESIDES[op]
    assert len(names) > 10 + len(BESIDES[op])
    free = {
        name
        for name in names
        if roles.authorise("operator", op, name if name[0] == "/" else f"/cell/{name}") is None
    }
    assert free == (COMMANDS if op == "publish" else set())
    several = {n for n in SHARED if roles.is_exempt("operator", "publish", f"/cell/{n}")}
    assert several == SHARED, "given by several"


PROOF = {"person": "fitter", "token": "fitters-own"}


@pytest.mark.parametrize(
    ("args", "after"),
    [
        (None, {**PROOF, "session": "gateway 3"}),
        ({"session": "mine"}, {**PROOF, "session": "gateway 3"}),
        ({"person": "foreman", "token": "x"}, {"person": "foreman", "token": "x"}),
        (["HOME"], ["HOME"]),
    ],
)
def test_what_a_call_of_a_person_becomes(args: Any, after: Any) -> None:
    """A client may prove another person itself; a list has no names to fill in."""
    assert with_person(args, "fitter", "fitters-own", 3) == after
    assert with_person(args, "", "", 3) == args


def test_arguments_without_a_token_are_shown_as_they_are() -> None:
    """Nothing else is hidden."""
    assert without_token({"x": 1}) == {"x": 1}
    assert without_token(["a"]) == ["a"]


def test_a_token_in_a_list_of_arguments_is_hidden() -> None:
    """No field has a name there: only the command, and what is no text, is shown."""
    shown = without_token(["TAKE", "anna", "SECRET", "", 3.0, True])
    assert shown == ["TAKE", HIDDEN, HIDDEN, "", 3.0, True]
