"""Web pages that mean no good: no other client of the gateway feels them."""

from __future__ import annotations

import pytest
from harness.faults.rows import Row, check
from harness.opponents.hostile_pages import beside_pages
from harness.opponents.running_gateway import RunningGateway

P99_S, WORST_S = 0.04, 0.1
"""Loose: a machine of half the usual speed took 22 ms. Who is held up waits much longer."""
TIMES = 2.0
"""An answer takes no more than so many times as long as one without a gateway at that moment."""


@pytest.mark.parametrize("seconds", [4.0, pytest.param(60.0, marks=pytest.mark.thorough)])
def test_eight_hostile_pages_keep_no_other_client_waiting(
    gateway: RunningGateway, seconds: float
) -> None:
    """Whatever they send and ask, another client's question is answered at once."""

    def measure() -> list[Row]:
        answers = beside_pages(gateway.port, seconds)
        limits = [max(*pair) for pair in zip((P99_S, WORST_S), (TIMES * t for t in answers.plain))]
        fault = f"gateway: eight hostile pages for {seconds:g} s"
        return [
            Row(fault, "MB that they sent", 1.0, answers.sent / 1e6, at_least=True),
            Row(fault, "another client's answer, p99 [s]", limits[0], answers.p99),
            Row(fault, "another client's answer, worst [s]", limits[1], answers.worst),
        ]

    check(measure)
    assert gateway.node.poll() is None
    assert "error" not in gateway.node.output
