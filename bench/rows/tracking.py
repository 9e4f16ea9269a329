"""Rows tracking, tracking_wrong_mass.

The twin's own loops along the article's route at 100 % speed, faster than real time.
"""

from __future__ import annotations

from bench.record import Beside, Goal, Record
from bench.room import Room
from bench.world.offline import offline_twin
from bench.world.route import PERIOD, Sender, tip_error_mm, with_positions, with_setpoints


def _error(
    room: Room,
    send: Sender,
    *,
    feed_forward: bool,
    mass_factor: float = 1.0,
    period: float = PERIOD,
) -> float:
    with offline_twin(
        room.robot, feed_forward=feed_forward, mass_factor=mass_factor, parts=False
    ) as (world, simulation):
        return tip_error_mm(room.robot, world, simulation, send, period)


def _plain(room: Room) -> tuple[float, float, float]:
    """Return the errors of plain PID.

    Positions at the physics rate, positions at 100 Hz, with velocities too.
    """
    return room.once(
        "plain_pid",
        lambda: (
            _error(room, with_positions, feed_forward=False, period=0.001),
            _error(room, with_positions, feed_forward=False),
            _error(room, with_setpoints, feed_forward=False),
        ),
    )


def _record(room: Room, name: str, ours: float, limit: float, measured: str) -> Record:
    each_step, slow, with_velocity = _plain(room)
    return Record(
        name,
        ours,
        each_step,
        "mm",
        (Goal("ratio", limit),),
        measured="largest distance of the tool from its set point at the same instant, P1 P2 P3 P1 "
        f"at 100 %; {measured}",
        against="the article's plain PID: the same gains without feed-forward, a new position at "
        "each physics step "
        "(its best case), integral of joint_3 large enough for its weight",
        statistic="max",
        beside=(
            Beside("ours / plain PID with positions at 100 Hz", ours / slow, ""),
            Beside(
                "ours / plain PID that also gets the set points' velocity", ours / with_velocity, ""
            ),
        ),
        note="the simulation is deterministic: one run",
    )


def tracking(room: Room) -> Record:
    """Computed torque with the right masses."""
    ours = _error(room, with_setpoints, feed_forward=True)
    return _record(
        room,
        "tracking",
        ours,
        0.01,
        "set points with velocity and acceleration every 10 ms, computed torque",
    )


def tracking_wrong_mass(room: Room) -> Record:
    """Computed torque from masses that are 20 % too small and too large; the worse of the two."""
    ours = max(
        _error(room, with_setpoints, feed_forward=True, mass_factor=factor) for factor in (0.8, 1.2)
    )
    return _record(
        room,
        "tracking_wrong_mass",
        ours,
        0.08,
        "masses of the model 20 % too small and too large: the worse",
    )
