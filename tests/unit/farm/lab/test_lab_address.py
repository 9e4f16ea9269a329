"""A scheduler of the lab is of this machine, as long as nobody's name is proven."""

from __future__ import annotations

import pytest
from farm.lab.address import AddressError, is_secure, listened, scheduler_address


@pytest.mark.parametrize("text", ["127.0.0.1:9000", "tcp://127.0.0.1:9000", "localhost:9000"])
def test_this_machine_is_allowed(text: str) -> None:
    """However it is written."""
    assert scheduler_address(text).startswith("tcp://") and scheduler_address(text).endswith(
        ":9000"
    )


@pytest.mark.parametrize("host", ["0.0.0.0", "10.0.0.7", "farm.example"])
def test_no_other_is(host: str) -> None:
    """Also names: what they lead to may change."""
    with pytest.raises(AddressError, match="allowed is"):
        scheduler_address(f"{host}:8786")


@pytest.mark.parametrize("text", ["", ":8786", "127.0.0.1:0", "127.0.0.1:65536", "127.0.0.1:a/b"])
def test_what_is_no_address_is_told(text: str) -> None:
    """With an example of one."""
    with pytest.raises(AddressError, match="HOST:PORT, for example"):
        scheduler_address(text)


@pytest.mark.parametrize("text", ["tls://10.0.0.7", "tls://farm.example:8786", "tls://127.0.0.1"])
def test_others_are_by_tls(text: str) -> None:
    """Both sides show certificates there; on this machine too, if it is written so."""
    address = scheduler_address(text)
    assert is_secure(address) and address.endswith(":8786")
    assert not is_secure(scheduler_address("127.0.0.1"))


@pytest.mark.parametrize("host", ["", "0.0.0.0", "*", "10.0.0.7:8786", "tls://10.0.0.7"])
def test_a_scheduler_listens_where_others_reach_it(host: str) -> None:
    """Not anywhere: its address is in invitations."""
    assert listened("10.0.0.7") == "10.0.0.7"
    with pytest.raises(AddressError, match="at which other machines reach this one"):
        listened(host)
