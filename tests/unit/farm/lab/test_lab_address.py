"""A scheduler of the lab is of this machine, as long as nobody's name is proven."""

from __future__ import annotations

import pytest
from farm.lab.address import AddressError, scheduler_address


@pytest.mark.parametrize("text", ["127.0.0.1:9000", "tcp://127.0.0.1:9000", "localhost:9000"])
def test_this_machine_is_allowed(text: str) -> None:
    """However it is written."""
    assert scheduler_address(text).startswith("tcp://") and scheduler_address(text).endswith(
        ":9000"
    )


@pytest.mark.parametrize("host", ["0.0.0.0", "10.0.0.7", "farm.example", "tls://127.0.0.1"])
def test_no_other_is(host: str) -> None:
    """Also names: what they lead to may change."""
    with pytest.raises(AddressError, match="allowed is"):
        scheduler_address(f"{host}:8786")


@pytest.mark.parametrize("text", ["", ":8786", "127.0.0.1:0", "127.0.0.1:65536", "127.0.0.1:a/b"])
def test_what_is_no_address_is_told(text: str) -> None:
    """With an example of one."""
    with pytest.raises(AddressError, match="HOST:PORT, for example"):
        scheduler_address(text)
