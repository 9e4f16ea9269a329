"""The door of a page: no other site, no other name, no cookie that was not made here."""

from __future__ import annotations

import pytest
from scara_ros.page.page_door import EARLY_S, SESSION_S, PageDoor, Visit, is_known_host

DOOR = PageDoor("operator_panel", "127.0.0.1", 8080, "token-of-the-tests")
HOST = "127.0.0.1:8080"
NOW = 1_700_000_000


@pytest.mark.parametrize(
    ("header", "told", "known"),
    [
        ("127.0.0.1:8080", "127.0.0.1", True),
        ("127.0.0.1", "127.0.0.1", True),
        ("127.4.5.6:8080", "127.0.0.1", True),
        ("LocalHost:8080", "127.0.0.1", True),
        ("localhost:9999", "127.0.0.1", True),
        ("[::1]:8080", "127.0.0.1", True),
        ("192.168.1.5:8080", "192.168.1.5", True),
        ("cell.example:8080", "cell.example", True),
        ("192.168.1.5:8080", "0.0.0.0", True),
        ("[fe80::1]:8080", "::", True),
        ("192.168.1.5:8080", "127.0.0.1", False),
        ("evil.example:8080", "127.0.0.1", False),
        ("evil.example", "0.0.0.0", False),
        ("127.0.0.1.evil.example", "127.0.0.1", False),
        ("localhost.evil.example:8080", "127.0.0.1", False),
        ("localhost:80.evil.example", "127.0.0.1", False),
        ("localhost@evil.example", "127.0.0.1", False),
        ("localhost.", "127.0.0.1", False),
        ("", "127.0.0.1", False),
        ("127.0.0.1:", "127.0.0.1", False),
    ],
)
def test_only_names_of_this_machine_are_served(header: str, told: str, known: bool) -> None:
    """A name that a foreign name server points here (DNS rebinding) is none of them."""
    assert is_known_host(header, told) is known
    assert (PageDoor("p", told, 8080, "t").refusal(Visit((header,))) == "") is known


@pytest.mark.parametrize("hosts", [(), (HOST, HOST), (HOST, "evil.example")])
def test_exactly_one_host_is_named(hosts: tuple[str, ...]) -> None:
    """Two readers of a request could take two of them."""
    assert "not served under that name" in DOOR.refusal(Visit(hosts))


@pytest.mark.parametrize(
    ("host", "origin", "passes"),
    [
        (HOST, "", True),
        (HOST, "http://127.0.0.1:8080", True),
        ("localhost:8080", "http://LOCALHOST:8080", True),
        ("localhost:9000", "http://localhost:9000", True),
        (HOST, "http://127.0.0.1:9999", False),
        (HOST, "http://localhost:8080", False),
        (HOST, "https://127.0.0.1:8080", False),
        (HOST, "http://127.0.0.1:8080.evil.example", False),
        (HOST, "http://127.0.0.1:8080, http://evil.example", False),
        (HOST, "http://evil.example", False),
        (HOST, "null", False),
    ],
)
def test_origin_is_the_page_itself(host: str, origin: str, passes: bool) -> None:
    """Another page of this machine is another site; what has no origin is no browser."""
    assert (DOOR.refusal(Visit((host,), origin=origin)) == "") is passes


@pytest.mark.parametrize(
    ("site", "mode", "destination", "passes"),
    [
        ("same-origin", "cors", "empty", True),
        ("none", "navigate", "document", True),
        ("cross-site", "navigate", "document", True),
        ("cross-site", "navigate", "iframe", False),
        ("same-site", "navigate", "iframe", False),
        ("same-site", "no-cors", "image", False),
        ("cross-site", "no-cors", "script", False),
        ("cross-site", "websocket", "websocket", False),
    ],
)
def test_other_sites_open_the_page_and_do_not_embed_it(
    site: str, mode: str, destination: str, passes: bool
) -> None:
    """A link is the person's own click; a picture, a script or a frame is not."""
    visit = Visit((HOST,), site=site, mode=mode, destination=destination)
    assert (DOOR.refusal(visit) == "") is passes


def known(cookies: str, now: int = NOW, door: PageDoor = DOOR) -> bool:
    """Return whether somebody with these cookies is known."""
    return door.knows(Visit((HOST,), cookies=cookies), now)


def test_cookie_is_drawn_and_holds_no_token() -> None:
    """Two visits have two cookies; neither tells the token."""
    cookies = {DOOR.session("abc", NOW), DOOR.session("abd", NOW)}
    assert len(cookies) == 2
    for cookie in cookies:
        assert known(f"other=1; operator_panel_8080={cookie}; last=2")
        assert "token" not in cookie


@pytest.mark.parametrize("age", [-EARLY_S - 1, SESSION_S + 1])
def test_cookie_ends(age: int) -> None:
    """After a shift, or when it comes from the future."""
    cookie = f"{DOOR.cookie}={DOOR.session('abc', NOW)}"
    assert not known(cookie, NOW + age) and known(cookie, NOW + min(age, SESSION_S - 1) % SESSION_S)


@pytest.mark.parametrize(
    "door",
    [
        PageDoor("operator_panel", "127.0.0.1", 8081, "token-of-the-tests"),
        PageDoor("pendant_page", "127.0.0.1", 8080, "token-of-the-tests"),
        PageDoor("operator_panel", "127.0.0.1", 8080, "token-of-tomorrow"),
    ],
)
def test_cookie_opens_its_own_page_alone(door: PageDoor) -> None:
    """Cookies know no ports; this one does, and it ends with the token it came from."""
    assert not known(f"{DOOR.cookie}={door.session('abc', NOW)}")


@pytest.mark.parametrize(
    "cookies",
    [
        "",
        "operator_panel_8080=",
        "operator_panel_8080=token-of-the-tests",
        f"operator_panel_8080={NOW}.abc.",
        f"operator_panel_8080={NOW}.abc.{'0' * 64}",
        f"operator_panel_8080={DOOR.session('abc', NOW)}0",
        f"operator_panel_8080={DOOR.session('abc', NOW)}.x",
        f"operator_panel_8080=\N{SUPERSCRIPT TWO}.abc.{'0' * 64}",
        f"operator_panel_8081={DOOR.session('abc', NOW)}",
    ],
)
def test_made_up_cookie_is_nobody(cookies: str) -> None:
    """The token itself is no cookie either."""
    assert not known(cookies)


@pytest.mark.parametrize(
    ("token", "fits"),
    [
        ("token-of-the-tests", True),
        ("token-of-the-test", False),
        ("", False),
        (None, False),
        ("s\N{LATIN SMALL LETTER E WITH ACUTE}", False),
    ],
)
def test_only_the_token_fits(token: str | None, fits: bool) -> None:
    """Whatever a browser sends."""
    assert DOOR.brings_token(Visit((HOST,), token=token)) is fits
