"""One client's session: what it may do, what it is answered, what is counted."""

from __future__ import annotations

import json
import re
from typing import Any

import msgspec
import pytest
from harness.opponents.graph_and_clients import TAKES
from msgspec import UNSET
from rosbridge_gateway.config import Limits, Reserved, RoleRules
from rosbridge_gateway.protocol import packets
from rosbridge_gateway.protocol.packets import ServiceResponse, Status
from rosbridge_gateway.protocol.roles import Roles
from rosbridge_gateway.protocol.session import Request, Session, Wishes
from rosbridge_gateway.wire.outgoing import Form
from rosbridge_gateway.wire.png_io import pack, unpack

LIMITS = Limits(
    nesting=10,
    clients=2,
    topics_per_client=2,
    services_per_client=1,
    burst=1.0,
    calls=2,
    page_calls=1,
    waiting_answers=10,
    waiting_bytes=1 << 20,
    send_buffer_bytes=1024,
)
LOOKS = msgspec.structs.replace(TAKES, packet_bytes=2000, shortest_fragment=50)
NOTHING = Reserved(publish=[], shared=[], advertise_service=[])
ROLES = {
    "viewer": RoleRules(
        *("", None, 0, LOOKS),
        publish=[],
        subscribe=["/*"],
        call_service=["/rosapi/*", "why"],
        advertise_service=[],
    ),
    "operator": RoleRules(
        *("", None, 0, LOOKS),
        publish=["/*"],
        subscribe=["/*"],
        call_service=["/*"],
        advertise_service=["/*"],
    ),
}


def session(role: str = "operator") -> Session:
    """Return a session in namespace /cell."""
    return Session(
        role, Roles(ROLES, NOTHING, "/cell"), "/cell", LIMITS, LOOKS, now=0.0, read_png=unpack
    )


def say(to: Session, now: float = 0.0, **packet: Any) -> Request | packets.Packet | None:
    """Send a packet to a session."""
    return to.receive(json.dumps(packet).encode(), now)


@pytest.mark.parametrize(
    ("written", "resolved"),
    [("twin/joint_states", "/cell/twin/joint_states"), ("/clock",) * 2, ("/" + "x" * 254,) * 2],
)
def test_name_is_resolved_in_the_gateways_namespace(written: str, resolved: str) -> None:
    """Names without a leading slash are relative."""
    request = say(session(), op="subscribe", topic=written)
    assert isinstance(request, Request) and request.name == resolved


@pytest.mark.parametrize(
    "name", ["", "/", "a b", "~private", "a//b", "a/", "/ä", "a\n", "x" * 3 + "-", "a;b", "x" * 256]
)
def test_illegal_name_is_refused(name: str) -> None:
    """What ROS does not allow as a name does not reach it."""
    answer = say(session(), op="subscribe", id="1", topic=name)
    assert answer == Status(id="1", level="error", msg=f"{name[:80]!r} is no legal ROS name")


def test_bad_packet_is_answered_and_survived() -> None:
    """The session lives on, the refusal is counted."""
    client = session()
    answer = client.receive(b'{"op":"dance","id":"a"}', 0.0)
    assert isinstance(answer, Status)
    assert answer.level == "error"
    assert answer.id == "a"
    assert "dance" in answer.msg
    assert isinstance(say(client, op="subscribe", topic="t"), Request)
    assert (client.counters.received, client.counters.refused) == (2, 1)


@pytest.mark.parametrize(
    ("packet", "allowed"),
    [
        ({"op": "subscribe", "topic": "t"}, True),
        ({"op": "call_service", "service": "/rosapi/get_time"}, True),
        ({"op": "call_service", "service": "why"}, True),
        ({"op": "call_service", "service": "/why"}, False),
        ({"op": "call_service", "service": "move_to"}, False),
        ({"op": "publish", "topic": "motion_command", "msg": {}}, False),
        ({"op": "advertise", "topic": "motion_command", "type": "T"}, False),
        ({"op": "advertise_service", "service": "s", "type": "T"}, False),
    ],
)
def test_viewer_sees_but_moves_nothing(packet: dict[str, Any], allowed: bool) -> None:
    """Rights are patterns per role; what no pattern names is denied."""
    answer = say(session("viewer"), id="1", **packet)
    if allowed:
        assert isinstance(answer, Request)
    else:
        assert isinstance(answer, ServiceResponse if packet["op"] == "call_service" else Status)
        text = answer.values if isinstance(answer, ServiceResponse) else answer.msg
        assert text.startswith(f"role viewer may not {packet['op']} /") and answer.id == "1"


def test_unknown_role_may_do_nothing() -> None:
    """Denied by default."""
    answer = say(session(""), op="subscribe", topic="t")
    assert isinstance(answer, Status) and answer.msg == "role none may not subscribe /cell/t"


@pytest.mark.parametrize(
    ("op", "right"),
    [
        ("unsubscribe", "subscribe"),
        ("unadvertise", "publish"),
        ("unadvertise_service", "advertise_service"),
        ("service_response", "advertise_service"),
    ],
)
def test_each_operation_needs_a_right(op: str, right: str) -> None:
    """Whoever may not begin something may not end it or answer for it; no right is a denial."""
    none: dict[str, list[str]] = {
        "publish": [],
        "subscribe": [],
        "call_service": [],
        "advertise_service": [],
    }
    one, other = (RoleRules("", None, 0, LOOKS, **none | more) for more in ({right: ["/t"]}, {}))
    roles = Roles({"one": one, "none": other}, NOTHING, "/")
    assert roles.authorise("one", op, "/t") is None
    assert roles.authorise("one", op, "/u") == f"role one may not {op} /u"
    assert roles.authorise("none", op, "/t") == f"role none may not {op} /t"
    assert roles.authorise("one", "dance", "/t") == "role one may not dance /t"


def test_refused_call_is_answered_as_a_call() -> None:
    """A caller waits for a service_response, never for a status."""
    client = session("viewer")
    answer = say(client, op="call_service", id="c", service="move_to", args={})
    assert answer == ServiceResponse(
        id="c",
        service="move_to",
        result=False,
        values="role viewer may not call_service /cell/move_to",
    )


CALL = b'{"op":"call_service","id":"a","service":"/x",'


@pytest.mark.parametrize("level", ["error", "none"])
@pytest.mark.parametrize(
    ("data", "text", "packet_id", "service"),
    [
        (CALL + b'"args":5}', "Expected `object | array | null`, got `int`", "a", "/x"),
        (CALL + b'"timeout":-1}', ">= 0.0", "a", "/x"),
        (CALL + b'"args":{"x":NaN}}', "no valid JSON", "a", "/x"),
        (CALL + b'"args":{"x":1', "no valid JSON", "a", "/x"),
        (CALL + b'"args":' + b"[" * 10 + b"]" * 10 + b"}", "deeper than the allowed 10", "a", "/x"),
        (
            CALL + b'"args":' + b"[" * 900 + b"]" * 900 + b"}",
            "deeper than the allowed 10",
            "a",
            "/x",
        ),
        (CALL + b'"args":"' + b"y" * 2000 + b'"}', "longer than the allowed 2000", "a", "/x"),
        (
            b'{"args":"' + b"y" * 9000 + b'",' + CALL[1:-1] + b"}",
            "longer than the allowed 2000",
            "a",
            "/x",
        ),
        (b'{"op":"call_service","id":"a"}', "missing required field `service`", "a", ""),
        (b'{"op":"call_service","id":7,"service":5}', r"- at `\$.service`", 7, ""),
        (b'{"op":"call_service","id":1.5,"service":"/x"}', r"- at `\$.id`", UNSET, "/x"),
    ],
)
def test_malformed_call_is_answered_as_a_call(
    data: bytes, text: str, packet_id: str, service: str, level: str
) -> None:
    """Whoever calls gets an answer with a reason, also who wants no remarks."""
    client = session()
    say(client, op="set_level", level=level)
    answer = client.receive(data, 0.0)
    assert isinstance(answer, ServiceResponse) and (answer.id, answer.service, answer.result) == (
        packet_id,
        service,
        False,
    )
    assert re.search(text, answer.values) and client.counters.refused == 1


@pytest.mark.parametrize(
    ("packet", "text"),
    [
        ({"op": "unsubscribe", "topic": "t"}, "/cell/t is not subscribed"),
        ({"op": "unadvertise", "topic": "t"}, "/cell/t is not advertised"),
        ({"op": "unadvertise_service", "service": "s"}, "/cell/s is not advertised as a service"),
    ],
)
def test_what_makes_no_sense_is_refused(packet: dict[str, Any], text: str) -> None:
    """The reason says why."""
    answer = say(session(), **packet)
    assert isinstance(answer, Status) and answer.msg == text


def test_topics_and_services_of_a_client_are_limited() -> None:
    """One client cannot fill the graph; what it has already may be repeated."""
    client = session()
    for topic in ("a", "b"):
        request = say(client, op="subscribe", topic=topic)
        assert isinstance(request, Request) and isinstance(request.packet, packets.Subscribe)
        client.subscribed(request.name, request.packet)
        client.advertised(f"/cell/{topic}", UNSET)
    client.provides("/cell/s", True)
    for packet, text in (
        ({"op": "subscribe", "topic": "c"}, "2 subscribed topics: allowed: 2"),
        ({"op": "advertise", "topic": "c", "type": "T"}, "2 advertised topics: allowed: 2"),
        (
            {"op": "advertise_service", "service": "r", "type": "T"},
            "1 advertised services: allowed: 1",
        ),
    ):
        answer = say(client, **packet)
        assert isinstance(answer, Status) and answer.msg == text
    assert isinstance(say(client, op="subscribe", topic="b"), Request)


def test_client_that_is_held_back_is_told_once_a_second() -> None:
    """A short wait needs no word; each is counted."""
    client = session()
    assert client.held_back(0.2, 0.0) is None
    remark = client.held_back(0.5, 0.1)
    assert isinstance(remark, Status) and remark.level == "error"
    assert remark.msg.startswith("your packets are read 0.5 s later: this connection took more")
    assert "roles.operator.takes in gateway.yaml" in remark.msg
    assert client.held_back(0.5, 1.0) is None and client.held_back(0.5, 1.1) is not None
    assert client.counters.held_back == 4 and client.counters.refused == 0


@pytest.mark.parametrize(
    ("level", "answered"), [("info", True), ("warning", True), ("error", True), ("none", False)]
)
def test_set_level_decides_which_remarks_come(level: str, answered: bool) -> None:
    """Errors are sent unless the client wants none; a remark of its own is heard in silence."""
    client = session()
    assert say(client, op="set_level", level=level) is None
    assert say(client, op="status", level="error", msg="x") is None
    assert (say(client, op="unsubscribe", topic="t") is not None) == answered


@pytest.mark.parametrize("level", ["info", "warning", "error", "none"])
def test_no_remark_comes_that_is_milder_than_the_level(level: str) -> None:
    """And each that is as severe, or more."""
    client, levels = session(), ("info", "warning", "error")
    say(client, op="set_level", level=level)
    heard = [each for each in levels if client.status(each, "x", "a") is not None]
    assert heard == list(levels[(*levels, "none").index(level) :])


def test_subscriptions_with_ids_end_one_by_one() -> None:
    """The topic is left when its last id goes; the most demanding wish counts."""
    client = session()
    client.subscribed("/t", packets.Subscribe(id="a", topic="t", throttle_rate=100))
    assert client.wishes("/t") == Wishes(0.1, 0, Form("t"))
    quick = packets.Subscribe(id="b", topic="/t", throttle_rate=20, queue_length=5)
    assert client.wishes("/t", quick) == Wishes(0.02, 5, Form("/t"))
    assert client.wishes("/t") == Wishes(0.1, 0, Form("t"))
    client.subscribed("/t", quick)
    assert client.wishes("/t") == Wishes(0.02, 5, Form("/t"))
    assert not client.unsubscribed("/t", "b")
    assert client.wishes("/t") == Wishes(0.1, 0, Form("t"))
    assert not client.unsubscribed("/t", "unknown")
    assert client.unsubscribed("/t", "a") and client.subscriptions == ()
    assert not client.unsubscribed("/t", "a")
    for packet_id in ("a", "b"):
        client.subscribed("/t", packets.Subscribe(id=packet_id, topic="t"))
    assert client.unsubscribed("/t", UNSET), "without an id all end"


@pytest.mark.parametrize(
    ("asked", "given"),
    [
        ([None], "none"),
        (["none", "png"], "png"),
        (["cbor", "png"], "cbor"),
        (["cbor-raw", "cbor", "none"], "cbor-raw"),
        (["bson"], "none"),
        (["bson", "png"], "png"),
    ],
)
def test_of_several_compressions_the_densest_counts(asked: list[str | None], given: str) -> None:
    """An unknown one is JSON; so it is with rosbridge_server."""
    client = session()
    for number, compression in enumerate(asked):
        packet = packets.Subscribe(id=number, topic="t", compression=compression)
        client.subscribed("/t", packet)
    assert client.wishes("/t").form.compression == given


def test_smallest_fragment_size_counts() -> None:
    """No piece is longer than any of the client's ids can take."""
    client = session()
    for number, size in enumerate((None, 500, 100)):
        client.subscribed("/t", packets.Subscribe(id=number, topic="t", fragment_size=size))
    assert client.wishes("/t").form.fragment_size == 100
    client.subscribed("/t", packets.Subscribe(id="tiny", topic="t", fragment_size=1))
    assert client.wishes("/t").form.fragment_size == 50, "as short as the role allows"


def test_unknown_compression_is_a_warning_for_who_wants_warnings() -> None:
    """The messages come as JSON."""
    client, packet = session(), packets.Subscribe(id="s", topic="t", compression="bson")
    assert client.remark(packet) is None
    say(client, op="set_level", level="warning")
    text = "compression 'bson' is not known, JSON is sent: allowed: none, png, cbor, cbor-raw"
    assert client.remark(packet) == Status(id="s", level="warning", msg=text)
    assert client.remark(packets.Subscribe(topic="t", compression="cbor-raw")) is None


PUBLISH = {"op": "publish", "topic": "t", "msg": {"data": "\u00e4" * 20}}


def pieces(text: str, size: int, **more: Any) -> list[dict[str, Any]]:
    """Return the fragments of a text."""
    parts = [text[start : start + size] for start in range(0, len(text), size)]
    return [
        {"op": "fragment", "id": "f", "num": n, "total": len(parts), "data": part, **more}
        for n, part in enumerate(parts)
    ]


def test_packet_in_fragments_is_judged_when_all_are_there() -> None:
    """In any order; it is the same request as in one piece."""
    client = session()
    whole = say(client, **PUBLISH)
    assert isinstance(whole, Request)
    parts = pieces(json.dumps(PUBLISH, ensure_ascii=False), 7)
    for part in reversed(parts[1:]):
        assert say(client, **part) is None
    assert say(client, **parts[0]) == whole
    assert client.counters.refused == 0


def test_packet_as_an_image_is_judged_as_its_text() -> None:
    """Also when the image came in fragments."""
    client = session()
    whole = say(client, **PUBLISH)
    image = {"op": "png", "data": pack(json.dumps(PUBLISH).encode())}
    assert say(client, **image) == whole
    answers = [say(client, **part) for part in pieces(json.dumps(image), 50)]
    assert answers[-1] == whole and set(map(str, answers[:-1])) == {"None"}


@pytest.mark.parametrize(
    ("packet", "text"),
    [
        ({"op": "png", "data": "x"}, "data is no PNG image in base64"),
        ({"op": "png", "data": "AAAA"}, "data is no PNG image in base64"),
        ({"op": "png", "data": pack(b"x" * 5000)}, "an image of .* bytes: allowed: 2000"),
        ({"op": "png", "data": pack(b"no json")}, "packet is no valid JSON"),
        ({"op": "png", "data": pack(b'{"op":"png","data":""}')}, "png inside png"),
        (pieces('{"op":"fragment","id":1,"num":0,"total":1,"data":""}', 90)[0], "fragment inside"),
        ({"op": "fragment", "data": "", "num": 0, "total": 1}, "a fragment needs an id"),
        ({"op": "fragment", "id": 1, "data": "", "num": 3, "total": 2}, "3 of 2: allowed: 0..1 of"),
        ({"op": "fragment", "id": 1, "data": "", "num": 0, "total": 0}, "does not fit rosbridge"),
    ],
)
def test_wrapping_that_holds_no_packet_is_refused(packet: dict[str, Any], text: str) -> None:
    """The session lives on."""
    client = session()
    answer = say(client, **packet)
    assert isinstance(answer, Status) and answer.level == "error"
    assert re.search(text, answer.msg), answer
    assert client.counters.refused == 1 and isinstance(say(client, **PUBLISH), Request)


def test_call_in_fragments_that_does_not_fit_is_answered_as_a_call() -> None:
    """Its sender waits."""
    client = session()
    call = {"op": "call_service", "id": "c", "service": "s", "args": 5}
    answers = [say(client, **part) for part in pieces(json.dumps(call), 30)]
    assert isinstance(answers[-1], ServiceResponse) and answers[-1].id == "c"


def test_advertisements_end_one_by_one_or_all() -> None:
    """The publisher is closed when no id is left."""
    client = session()
    client.advertised("/t", "a")
    client.advertised("/t", "b")
    assert client.is_advertised("/t") and not client.unadvertised("/t", "a")
    assert client.unadvertised("/t", UNSET) and client.advertisements == ()
