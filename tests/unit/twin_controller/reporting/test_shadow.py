"""The shadow says what is wanted, reported and who decides, now and for a while back."""

from __future__ import annotations

import json

import msgspec
import pytest
from harness.pair import HOME, SETUP, Pair, ramp, shifted
from scara_ros.shadow import Shadow
from twin_controller.reporting.shadow import ShadowError, ShadowMemory, shadow_of

AWAY = shifted(HOME, 20.0, -30.0, 40.0, 10.0)
OFFSET = 1.7e9


def shadow(pair: Pair) -> Shadow:
    """Return the pair's shadow now."""
    return shadow_of(SETUP, pair.state, pair.now, pair.now + OFFSET, 7, "abc")


def test_an_idle_pair_is_where_it_agreed_to_be(pair: Pair) -> None:
    """Nobody leads: the agreed positions are wanted of both, in deg and mm, and are there."""
    found = shadow(pair)
    home = [q / scale for q, scale in zip(HOME, SETUP.scale)]
    assert (found.authority.mode, found.authority.leader) == ("IDLE", "")
    assert (found.desired.of, found.desired.source, found.desired.target) == ("both", "agreed", {})
    for position in (found.desired.position, found.real.position, found.twin.position):
        assert position == pytest.approx(dict(zip(found.units, home)), abs=0.01)
    assert found.deviation.position == pytest.approx(dict.fromkeys(found.units, 0.0), abs=0.02)
    assert list(found.units.values()) == ["deg", "deg", "mm", "deg"]


def test_stamps_are_ros_time_at_which_a_side_was_so(pair: Pair) -> None:
    """Each side's age is the document's stamp minus the side's."""
    found = shadow(pair)
    assert found.real.stamp is not None and found.twin.stamp is not None
    assert found.stamp - found.real.stamp == pytest.approx(
        pair.now - pair.state.sides.real.last.time, abs=1e-6
    )
    assert found.stamp - found.twin.stamp == pytest.approx(
        pair.now - pair.state.sides.twin.last.time, abs=1e-6
    )


@pytest.mark.parametrize(("leader", "follower"), [("real", "twin"), ("twin", "real")])
def test_the_follower_is_wanted_where_its_leader_is_or_goes(
    pair: Pair, leader: str, follower: str
) -> None:
    """The twin at the robot's newest position, the robot where the twin is going to be."""
    begin = pair.start_program if leader == "real" else pair.move_twin
    begin(ramp(HOME, AWAY, 2.0))
    pair.run(1.0)
    found, desired = shadow(pair), shadow(pair).desired
    assert (found.authority.leader, desired.of, desired.source) == (leader, follower, leader)
    assert not found.real.standing_still
    if leader == "real":
        assert desired.position == pytest.approx(found.real.position, abs=0.2)
        return
    assert pair.state.follow.real is not None and pair.state.follow.real.last is not None
    wanted = SETUP.to_border(pair.state.follow.real.last.q)
    assert desired.position == pytest.approx(dict(zip(found.units, wanted)), abs=1e-4)


def test_a_document_is_json_even_while_nothing_is_known() -> None:
    """Unknown sides have no values and null stamps; infinities become null."""
    found = shadow_of(SETUP, Pair().state, 5.0, OFFSET)
    document = json.loads(msgspec.json.encode(found))
    assert document["real"]["position"] == {} and document["real"]["stamp"] is None
    assert document["links"]["real"]["age"] is None and not document["links"]["real"]["connected"]
    assert msgspec.json.decode(msgspec.json.encode(found), type=Shadow).real == found.real
    assert document["authority"]["mode"] == "OFFLINE"
    assert "rejected" not in document["links"]["real"], "the core does not count it"


def memory_of(pair: Pair, stamps: list[float]) -> ShadowMemory:
    """Return a memory of 2 s that was offered documents at ``stamps``."""
    memory = ShadowMemory(0.1, 2.0)
    base = shadow(pair)
    for stamp in stamps:
        if memory.due(stamp):
            memory.keep(msgspec.structs.replace(base, stamp=stamp, revision=memory.revision + 1))
    return memory


def test_a_document_is_kept_each_period_and_forgotten_after_the_duration(pair: Pair) -> None:
    """Offered every 10 ms, kept every 100 ms, for 2 s."""
    memory = memory_of(pair, [100.0 + 0.01 * k for k in range(500)])
    assert memory.revision == pytest.approx(50, abs=2)
    newest = memory.at(0.0)
    assert newest.revision == memory.revision
    assert memory.at(-1.9).stamp == pytest.approx(newest.stamp - 1.9, abs=0.11)
    with pytest.raises(
        ShadowError,
        match=r"is not remembered: the memory holds 102\.\d+ to 104\.\d+ s; older times are in the "
        r"bag",
    ):
        memory.at(101.0)


@pytest.mark.parametrize("time", [103.0, 103.05, 103.0999])
def test_the_document_of_a_time_is_the_last_one_before_it(pair: Pair, time: float) -> None:
    """What was true then, not what came after."""
    memory = memory_of(pair, [102.0, 103.0, 103.1, 103.2])
    assert memory.at(time).stamp == 103.0


def test_a_time_that_has_not_come_yet_is_refused(pair: Pair) -> None:
    """A shadow does not foretell."""
    with pytest.raises(ShadowError, match="is not remembered"):
        memory_of(pair, [102.0, 103.0]).at(110.0)


def test_an_empty_memory_says_so() -> None:
    """Before the first document."""
    with pytest.raises(ShadowError, match="nothing is remembered yet"):
        ShadowMemory(0.1, 2.0).at(0.0)


def test_a_clock_that_goes_back_does_not_stop_the_memory(pair: Pair) -> None:
    """Documents from after the new time are forgotten, new ones are kept."""
    memory = memory_of(pair, [100.0, 100.5, 101.0, 50.0, 50.1])
    assert memory.at(0.0).stamp == 50.1
    with pytest.raises(ShadowError):
        memory.at(100.5)
