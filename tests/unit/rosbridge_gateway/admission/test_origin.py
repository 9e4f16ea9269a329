"""Origins: compared by scheme, host and port, never as text."""

from __future__ import annotations

import pytest
from harness.opponents.graph_and_clients import SHIPPED
from rosbridge_gateway.admission.origin import Origin, OriginError, is_allowed
from rosbridge_gateway.config import origin_patterns


@pytest.mark.parametrize(
    "header",
    [
        "http://localhost",
        "http://localhost:8080",
        "http://LOCALHOST:8080",
        "https://127.0.0.1:443",
        "https://localhost",
    ],
)
def test_page_of_this_machine_may_connect(header: str) -> None:
    """The shipped list, any port."""
    assert is_allowed(header, origin_patterns(SHIPPED))


@pytest.mark.parametrize(
    "header",
    [
        "http://localhost:80.evil.example",
        "http://localhost:80@evil.example",
        "http://localhost.evil.example:80",
        "http://localhost:*",
        "http://localhost:",
        "http://localhost:0",
        "http://localhost:65536",
        "http://localhost:80/",
        "http://localhost:80 ",
        "http://localhost:80\n",
        "http://localhost:80 http://evil.example",
        "http://user@localhost",
        "http://127.0.0.1.evil.example",
        "http://127.1:80",
        "ws://localhost:80",
        "file://somewhere",
        "file:///",
        "file:",
        "NULL",
        "null:80",
        "null://null",
        "",
        "http://evil.example",
    ],
)
def test_other_page_may_not_connect(header: str) -> None:
    """Neither what only looks like it, nor what is no origin at all."""
    assert not is_allowed(header, origin_patterns(SHIPPED))


def test_page_opened_from_a_file_may_connect_where_the_list_says_so() -> None:
    """It counts for itself."""
    assert is_allowed("file://", origin_patterns(SHIPPED))
    assert is_allowed("file://", [Origin.pattern("file://")])
    web = [Origin.pattern("http://localhost:*"), Origin.pattern("https://localhost:*")]
    assert not is_allowed("file://", web)


def test_null_is_no_origin_and_no_pattern() -> None:
    """A frame that any web site has sandboxed has it; who allows it in the file is told so."""
    assert not is_allowed("null", origin_patterns(SHIPPED))
    with pytest.raises(OriginError, match="null is no origin: a frame of any web site can have it"):
        Origin.pattern("null")


def test_pattern_without_a_port_means_the_one_of_its_scheme() -> None:
    """A browser leaves it away too."""
    patterns = [Origin.pattern("https://cell.example"), Origin.pattern("http://[::1]:8080")]
    assert is_allowed("https://cell.example:443", patterns)
    assert is_allowed("http://[::1]:8080", patterns)
    assert not is_allowed("https://cell.example:8443", patterns)
    assert not is_allowed("http://cell.example", patterns)


@pytest.mark.parametrize(
    "text", ["*", "http://*", "localhost", "http://localhost:8*", "http://localhost/", ""]
)
def test_pattern_that_is_none_is_refused(text: str) -> None:
    """No text may let in more than it seems to."""
    with pytest.raises(OriginError, match=r"allowed: scheme://host, scheme://host:port"):
        Origin.pattern(text)
