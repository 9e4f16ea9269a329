"""``/api/twin`` without a browser and without ROS: names, history, stream, schema, other sites."""

from __future__ import annotations

import asyncio
import json
from typing import Any

import msgspec
import pytest
from fastapi import FastAPI
from harness.page.pair import shadow_document
from jsonschema import Draft202012Validator
from operator_panel.door import Answer
from operator_panel.page.twin_api_io import MOST_PAIRS, TwinApi
from operator_panel.view.twin_schema import json_schema, openapi
from scara_ros.page.page_door import PageDoor
from scara_ros.page.page_guard_io import PageGuard
from scara_ros.shadow import Shadow
from starlette.testclient import TestClient

DASHBOARD = "http://dashboard:3000"
NOW = 100.0


class Memory:
    """The twin controller's memory: from 95 s to 100 s, or nobody."""

    def __init__(self) -> None:
        """Answer."""
        self.asked: list[float] = []
        self.silent = False

    async def __call__(self, time: float) -> Answer:
        """Answer as the service does."""
        self.asked.append(time)
        if self.silent:
            return Answer(False, "no answer within 3 s")
        at = time if time > 0.0 else NOW + time
        if at < 95.0:
            return Answer(False, "is not remembered", {"document": ""})
        return Answer(True, "", {"document": shadow_document(at)})


@pytest.fixture
def memory() -> Memory:
    """Give a memory."""
    return Memory()


@pytest.fixture
def client(memory: Memory) -> TestClient:
    """Give a client of a guarded page with one reader."""
    server = FastAPI()
    TwinApi(memory).offer(server)
    guarded = PageGuard(
        server,
        PageDoor("operator_panel", "127.0.0.1", 8080, "token"),
        stranger=lambda _: "",
        readable="/api/twin",
        readers=frozenset({DASHBOARD}),
    )
    return TestClient(guarded, base_url="http://127.0.0.1:8080")


def test_values_stand_under_their_joints_names(client: TestClient) -> None:
    """No place in a list has to be known."""
    pair = client.get("/api/twin").json()
    assert pair["real"]["position"] == {"joint_1": 1.0, "joint_3": 2.0}
    assert pair["real"]["velocity"] == {"joint_1": 0.0, "joint_3": None}
    assert pair["twin"]["position"] == {}
    assert pair["units"] == {"joint_1": "deg", "joint_3": "mm"}
    assert pair["links"] == {"real": {"connected": True}, "twin": {"connected": False}}


def test_the_document_is_passed_on_as_it_is(client: TestClient) -> None:
    """The stand-in's has the fields of the twin controller's own."""
    document = shadow_document(NOW)
    assert client.get("/api/twin").text == document
    assert msgspec.json.decode(document, type=Shadow).stamp == NOW


def test_head_answers_as_get_without_a_body(client: TestClient) -> None:
    """Monitors ask so."""
    for path in ("", "/history?seconds=1", "/schema.json", "/openapi.json", "/stream"):
        answer = client.head(f"/api/twin{path}")
        assert (answer.status_code, answer.content) == (200, b""), path


def test_history_is_oldest_first_and_ends_now(client: TestClient) -> None:
    """What is not remembered is left out."""
    pairs = client.get("/api/twin/history?seconds=2&step=0.5").json()["pairs"]
    assert [pair["stamp"] for pair in pairs] == [98.0, 98.5, 99.0, 99.5, 100.0]
    assert len(client.get("/api/twin/history?seconds=20&step=1").json()["pairs"]) == 6


@pytest.mark.parametrize(
    ("path", "status", "text"),
    [
        ("?time=noon", 400, "time = 'noon' is no number of seconds: 0 is now"),
        ("?at=1", 400, "unknown parameter at: there is time"),
        ("?time=-300", 404, "is not remembered"),
        ("/history?seconds=0", 400, "0 < step <= seconds"),
        ("/history?seconds=1000&step=0.1", 400, f"at most {MOST_PAIRS} documents"),
        ("/history?seconds=nan", 400, "seconds = 'nan' is no number"),
        ("/stream?rate=5", 400, "unknown parameter rate: there is none"),
    ],
)
def test_what_cannot_be_answered_is_said(
    client: TestClient, path: str, status: int, text: str
) -> None:
    """One JSON object with the reason."""
    answer = client.get(f"/api/twin{path}")
    assert answer.status_code == status and text in answer.json()["error"]


def test_silent_controller_is_unavailable(client: TestClient, memory: Memory) -> None:
    """HTTP 503, with the reason."""
    memory.silent = True
    for path in ("", "/history"):
        answer = client.get(f"/api/twin{path}")
        assert (answer.status_code, answer.json()) == (503, {"error": "no answer within 3 s"})


def test_streams_share_one_question_and_tell_a_refusal(memory: Memory) -> None:
    """Ten times a second by the clock; whoever joins within a period gets the same event."""
    now = 0.0

    async def scene() -> list[bytes]:
        nonlocal now
        api = TwinApi(memory, lambda: now)
        events = [await api._newest(), await api._newest()]
        now = 0.1
        events.append(await api._newest())
        memory.silent, now = True, 0.2
        return [*events, await api._newest()]

    one, same, later, refused = asyncio.run(scene())
    assert one == same == later and memory.asked == [0.0, 0.0, 0.0]
    assert one.startswith(b"data: {") and one.endswith(b"}\n\n") and one.count(b"\n") == 2
    assert refused == b'event: refused\ndata: {"error":"no answer within 3 s"}\n\n'


def test_stream_goes_on_until_its_client_goes(memory: Memory) -> None:
    """A place is free again then."""

    async def scene() -> tuple[list[bytes], int, int]:
        api = TwinApi(memory)
        events = api._events()
        got = [await anext(events) for _ in range(3)]
        open_ones = api._streams
        await events.aclose()  # type: ignore[attr-defined]
        return got, open_ones, api._streams

    got, during, after = asyncio.run(scene())
    assert (len(got), during, after) == (3, 1, 0)


def test_site_that_is_named_may_read_and_no_more(client: TestClient) -> None:
    """CORS for the configured origins; another site, path or method is refused as before."""
    answer = client.get("/api/twin", headers={"Origin": DASHBOARD, "Sec-Fetch-Site": "cross-site"})
    assert answer.status_code == 200
    assert answer.headers["access-control-allow-origin"] == DASHBOARD
    assert "Origin" in answer.headers["vary"]
    assert client.options("/api/twin", headers={"Origin": DASHBOARD}).status_code == 204
    assert client.get("/api/twin", headers={"Origin": "http://evil.example"}).status_code == 403
    assert client.get("/events.csv", headers={"Origin": DASHBOARD}).status_code == 403
    assert client.post("/api/twin", headers={"Origin": DASHBOARD}).status_code == 403
    host = {"Origin": DASHBOARD, "Host": "evil.example"}
    assert client.get("/api/twin", headers=host).status_code == 403
    plain = client.get("/api/twin")
    assert "access-control-allow-origin" not in plain.headers


def references(tree: Any) -> list[str]:
    """Return all references of a schema."""
    if isinstance(tree, dict):
        own = [tree["$ref"]] if "$ref" in tree else []
        return own + [text for value in tree.values() for text in references(value)]
    return [text for item in tree for text in references(item)] if isinstance(tree, list) else []


def test_schema_and_openapi_describe_the_shadow_document(client: TestClient) -> None:
    """Each reference leads somewhere; required are the fields that are always there."""
    schema = client.get("/api/twin/schema.json").json()
    assert schema == json_schema()
    document_keys = set(json.loads(shadow_document(1.0)))
    assert set(schema["$defs"]["Shadow"]["required"]) == document_keys
    described = client.get("/api/twin/openapi.json").json()
    assert described == openapi() and described["openapi"].startswith("3.1")
    for root in (schema, described):
        for text in references(root):
            place: Any = root
            for part in text.removeprefix("#/").split("/"):
                place = place[part]
            assert place
    assert set(described["paths"]) == {"/api/twin", "/api/twin/history", "/api/twin/stream"}


@pytest.mark.parametrize(
    ("path", "route", "status"),
    [
        ("", "", 200),
        ("?time=-300", "", 404),
        ("?time=noon", "", 400),
        ("/history?seconds=2", "/history", 200),
        ("/history?step=0", "/history", 400),
    ],
)
def test_each_answer_is_what_openapi_says(
    client: TestClient, path: str, route: str, status: int
) -> None:
    """Refusals too; a program that was generated from it reads them all."""
    described = client.get("/api/twin/openapi.json").json()
    answers = described["paths"][f"/api/twin{route}"]["get"]["responses"]
    schema = answers[str(status)]["content"]["application/json"]["schema"]
    answer = client.get(f"/api/twin{path}")
    assert answer.status_code == client.head(f"/api/twin{path}").status_code == status
    assert set(described["paths"][f"/api/twin{route}"]["head"]["responses"]) == set(answers)
    Draft202012Validator({**schema, "components": described["components"]}).validate(answer.json())
