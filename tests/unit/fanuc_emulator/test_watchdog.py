"""The heartbeat watchdog, as a table of events."""

import pytest
from fanuc_emulator.watchdog import Watchdog, WatchdogState

DISARMED, ARMED, EXPIRED = WatchdogState.DISARMED, WatchdogState.ARMED, WatchdogState.EXPIRED


@pytest.mark.parametrize(
    ("beats", "now", "state"),
    [
        ([], 10_000, DISARMED),
        ([(0, 0)], 10_000, DISARMED),
        ([(5, 0)], 120, ARMED),
        ([(5, 0)], 121, EXPIRED),
        ([(5, 0), (5, 100)], 121, EXPIRED),
        ([(5, 0), (6, 100)], 220, ARMED),
        ([(5, 0), (6, 100)], 221, EXPIRED),
        ([(5, 0), (0, 50)], 10_000, DISARMED),
        ([(5, 0), (0, 50), (5, 60)], 180, ARMED),
        ([(32767, 0), (1, 100)], 200, ARMED),
    ],
)
def test_only_a_change_keeps_it_awake_and_zero_disarms(
    beats: list[tuple[int, int]], now: int, state: WatchdogState
) -> None:
    """The first change that is not 0 arms it, a value that stays ends it, 0 is a farewell."""
    watchdog = Watchdog(120)
    for value, at in beats:
        watchdog.beat(value, at)
    assert watchdog.expires(now) is (state is EXPIRED)
    assert watchdog.state is state


def test_expired_stays_until_reset_and_tells_it_once() -> None:
    """A client that comes back undoes no alarm; after the reset the next change arms again."""
    watchdog = Watchdog(120)
    watchdog.beat(1, 0)
    assert watchdog.expires(200)
    assert not watchdog.expires(300)
    watchdog.beat(2, 301)
    watchdog.beat(0, 302)
    assert watchdog.state is EXPIRED
    watchdog.reset()
    assert watchdog.state is DISARMED
    watchdog.beat(3, 400)
    assert watchdog.state is ARMED
