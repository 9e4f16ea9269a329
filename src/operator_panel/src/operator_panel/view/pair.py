"""The pair as programs without ROS read it: each joint's values under its name, and the schema."""

from __future__ import annotations

from typing import Any

import msgspec

Values = dict[str, float | None]
"""By joint, in the joint's unit; empty while unknown."""


class Authority(msgspec.Struct, frozen=True):
    """Who decides, and why."""

    mode: str
    leader: str
    why: str
    alarm: str


class Desired(msgspec.Struct, frozen=True):
    """What is wanted, of whom, and who says so."""

    of: str
    source: str
    position: Values
    target: Values


class Reported(msgspec.Struct, frozen=True):
    """What one side last said of itself; ``stamp`` [s] is when it was true."""

    position: Values
    velocity: Values
    stamp: float | None
    standing_still: bool


class Deviation(msgspec.Struct, frozen=True):
    """How far the sides are apart at the same instant.

    Attributes:
        position: Real - twin by joint.
        tool_mm: Distance of the tools, nothing removed [mm].
        path_mm: Of the real tool from the twin's path, lag removed [mm].
        lag: So late the follower is on its way [s]; null: nobody follows.
        follower_lag: So late the real robot does its set points [s].
        diverged: The pair came apart.
    """

    position: Values
    tool_mm: float | None
    path_mm: float
    lag: float | None
    follower_lag: float | None
    diverged: bool


class Speed(msgspec.Struct, frozen=True):
    """Program speed [percent]."""

    requested: float | None
    applied: float | None
    limited: bool
    reason: str


class Pair(msgspec.Struct, frozen=True):
    """The pair at ``stamp`` [s]; ``units`` are deg or mm, by joint; ``links`` by side."""

    stamp: float
    revision: int
    decision: int
    configuration: str
    units: dict[str, str]
    authority: Authority
    desired: Desired
    real: Reported
    twin: Reported
    deviation: Deviation
    speed: Speed
    links: dict[str, dict[str, Any]]


class PairHistory(msgspec.Struct, frozen=True):
    """The pair at several times, oldest first."""

    pairs: list[Pair]


class Refusal(msgspec.Struct, frozen=True):
    """Why there is no answer."""

    error: str


def named(document: str | bytes) -> Pair:
    """Return the twin controller's document with names in place of positions in lists.

    Args:
        document: What ``twin_controller/shadow`` answers.

    Raises:
        msgspec.ValidationError: It is another document.
    """
    tree = msgspec.json.decode(document, type=dict[str, Any])
    joints = tree.pop("names", [])
    tree["units"] = dict(zip(joints, tree.get("units", [])))
    for part, key in _LISTS:
        content = tree.get(part, {})
        content[key] = dict(zip(joints, content.get(key, [])))
    tree["links"] = {link.pop("name"): link for link in tree.get("links", [])}
    return msgspec.convert(tree, Pair)


_LISTS = (
    ("desired", "position"),
    ("desired", "target"),
    ("real", "position"),
    ("real", "velocity"),
    ("twin", "position"),
    ("twin", "velocity"),
    ("deviation", "position"),
)


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of the document (draft 2020-12)."""
    schema = msgspec.json.schema(Pair)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def openapi() -> dict[str, Any]:
    """Return the OpenAPI 3.1 description of all routes below ``/api/twin``."""
    _, schemas = msgspec.json.schema_components(
        [Pair, PairHistory, Refusal], ref_template="#/components/schemas/{name}"
    )

    def route(summary: str, kind: str, schema: str, *parameters: tuple[str, float, str]) -> Any:
        answer = {"schema": {"$ref": f"#/components/schemas/{schema}"}}
        refusal = {"application/json": {"schema": {"$ref": "#/components/schemas/Refusal"}}}
        asked = {
            "summary": summary,
            "parameters": [
                {
                    "name": name,
                    "in": "query",
                    "description": text,
                    "schema": {"type": "number", "default": default},
                }
                for name, default, text in parameters
            ],
        }
        answers: dict[str, Any] = {
            "200": {"description": summary, "content": {kind: answer}},
            "400": {"description": "A parameter is wrong.", "content": refusal},
            "404": {"description": "That time is not remembered.", "content": refusal},
            "503": {"description": "The controller is silent.", "content": refusal},
        }
        heads = {status: {"description": one["description"]} for status, one in answers.items()}
        return {"get": {**asked, "responses": answers}, "head": {**asked, "responses": heads}}

    json = "application/json"
    return {
        "openapi": "3.1.0",
        "info": {"title": "The pair of robots, read only", "version": "1"},
        "paths": {
            "/api/twin": route(
                "The pair at a time",
                json,
                "Pair",
                ("time", 0.0, "0: now; negative: so many seconds ago; else ROS time [s]."),
            ),
            "/api/twin/history": route(
                "The pair at several times, oldest first",
                json,
                "PairHistory",
                ("seconds", 10.0, "How far back [s]."),
                ("step", 0.5, "From one to the next [s]."),
            ),
            "/api/twin/stream": route(
                "The pair ten times a second, as server-sent events",
                "text/event-stream",
                "Pair",
            ),
        },
        "components": {"schemas": schemas},
    }
