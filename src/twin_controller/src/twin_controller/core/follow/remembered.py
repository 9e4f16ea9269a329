"""Paths of programs that were seen before: where the real robot is going to be next.

A robot repeats its programs within hundredths of a degree. What it did from one rest to the next
is kept, by program and speed; while it does the same again, the twin is told how its motion goes
on. Place and velocity have to match at each sample. Where they do not, nothing is foretold until
the next rest: the twin then follows the newest sample alone, as on a first round.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise

import msgspec
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.joint_track import JointTrack

from twin_controller.core.events import Joints
from twin_controller.core.setup import Setup
from twin_controller.core.sides.side import Sides

replace = msgspec.structs.replace

REST = 0.005
"""A robot rests whose joints are all slower than this part of their largest speed."""
HOLE_S = 0.04
"""A path with a longer time between two samples is not kept [s]: a pause hid what was there."""
MOST_SAMPLES = 2000
"""Longer paths are not kept: about 20 s from one rest to the next."""
MOST_PATHS = 32
"""So many are kept; the ones not driven for longest go first."""
AHEAD_S, SPACING_S = 0.1, 0.025
"""How far the way on is foretold, and the time between its points [s]."""
PLACE, PLACE_S = 0.05, 1e-3
"""A place matches within so much [deg or mm], and what the joint does in this time [s]."""
VELOCITY = 0.02
"""A velocity matches within this part of the joint's largest."""
BEGIN_S = 0.06
"""While a motion begins, a path that does not match is not used, but not given up either [s]."""
MOST_SHIFT_S = 0.03
"""A motion may begin so much earlier or later in its path [s]: of rest nobody sees the end."""

Key = tuple[str, float]
"""Program and its speed with the override [percent]; the override alone where only that is told."""


class RememberedPath(msgspec.Struct, frozen=True):
    """What the robot did from one rest to the next; the time counts from the first point [s]."""

    key: Key
    points: tuple[JointMotion, ...]

    @property
    def begin(self) -> Joints:
        """Where it rested before."""
        return self.points[0].q

    @property
    def end(self) -> Joints:
        """Where it came to rest."""
        return self.points[-1].q

    @property
    def duration(self) -> float:
        """From rest to rest [s]."""
        return self.points[-1].time

    def at(self, t: float) -> JointMotion:
        """Return the motion at ``t`` [s]: between two points the quintic that meets both."""
        k = min(max(bisect_right(self.points, t, key=_time), 1), len(self.points) - 1)
        pair = self.points[k - 1 : k + 1]
        ends = Setpoints((), pair)
        still = (1.0,) * len(self.begin)
        track = JointTrack.from_checked(ends, extrapolation_limit=0.0, stop_accelerations=still)
        return track.at(min(t, self.duration))


def _time(point: JointMotion) -> float:
    return point.time


class Match(msgspec.Struct, frozen=True):
    """A path that the motion has kept to so far, and how much later the motion is in it [s]."""

    path: RememberedPath
    shift: float = 0.0
    # Place and velocity are those of the path.
    fits: bool = False


class RememberedMotion(msgspec.Struct, frozen=True):
    """The robot's motion since its last rest."""

    # As it began. None: it is not kept, for a part of it is missing or another program came.
    key: Key | None
    samples: tuple[JointMotion, ...]
    matches: tuple[Match, ...] = ()


class Remembered(msgspec.Struct, frozen=True):
    """Paths that were seen, the ones driven last at the end."""

    paths: tuple[RememberedPath, ...] = ()
    # None while the robot rests.
    motion: RememberedMotion | None = None


def note_sample(setup: Setup, remembered: Remembered, sides: Sides) -> Remembered:
    """Take the real robot's newest sample in, while it leads."""
    flags, sample = sides.real.flags, sides.real.last
    assert flags is not None
    motion = remembered.motion
    if _rests(setup, sample):
        paths = remembered.paths
        if motion is not None:
            paths = _kept(setup, paths, motion, sample)
        return Remembered(paths)
    # Only programs of the robot repeat themselves; a jog does not.
    speed = flags.override_percent if flags.speed_percent is None else flags.speed_percent
    key = (flags.program, speed) if flags.own_program else None
    if motion is None or sample.time - motion.samples[-1].time > AHEAD_S:
        motion = _begun(setup, remembered.paths, sides.real.history, key)
    elif sample.time > motion.samples[-1].time:
        motion = _gone_on(setup, motion, sample, key)
    return replace(remembered, motion=motion)


def way_on(
    setup: Setup, remembered: Remembered, sample: JointMotion
) -> tuple[Joints | None, tuple[JointMotion, ...]]:
    """Return how the motion goes on by the path that it keeps to.

    Returns:
        The acceleration at the sample, None if it is not known, and the points after it: none
        beyond the path's end.
    """
    motion = remembered.motion
    match = None
    if motion is not None:
        match = next((match for match in motion.matches if match.fits), None)
    if motion is None or match is None:
        return None, ()
    path, at = match.path, _time_in(motion, match, sample)
    here = path.at(at)
    off = tuple(a - b for a, b in zip(sample.q, here.q))
    points = []
    after = SPACING_S
    while after <= AHEAD_S and at + after <= path.duration:
        there = path.at(at + after)
        q = within(setup, [a + b for a, b in zip(there.q, off)], sample.q)
        points.append(JointMotion(q, there.qdot, _limited(setup, there), after))
        after += SPACING_S
    return _limited(setup, here), tuple(points)


def within(setup: Setup, wanted: Sequence[float], here: Joints) -> Joints:
    """Return positions within the joints' limits, or no further beyond them than ``here``.

    What lies beyond a limit by a reading's noise alone would be refused.
    """
    rows = zip(wanted, setup.lower, setup.upper, here)
    return tuple([min(max(q, min(low, at)), max(high, at)) for q, low, high, at in rows])


def _rests(setup: Setup, sample: JointMotion) -> bool:
    return all(abs(v) <= REST * most for v, most in zip(sample.qdot, setup.velocity))


def _begun(
    setup: Setup, paths: tuple[RememberedPath, ...], history: Sequence[JointMotion], key: Key | None
) -> RememberedMotion:
    """Begin with the robot's last rest: who leads is known only when the robot has moved a bit."""
    first = len(history) - 1
    while first > 0 and not _rests(setup, history[first]):
        first -= 1
    samples = tuple(history[first:])
    whole = _rests(setup, samples[0]) and not _has_hole(samples)
    if key is None or not whole:
        return RememberedMotion(None, samples)
    begin = samples[0].q
    alike = [
        path for path in reversed(paths) if path.key == key and _same(setup, path.begin, begin)
    ]
    motion = RememberedMotion(key, samples[:2], tuple(Match(path) for path in alike))
    for sample in samples[2:]:
        motion = _gone_on(setup, motion, sample, key)
    return motion


def _gone_on(
    setup: Setup, motion: RememberedMotion, sample: JointMotion, key: Key | None
) -> RememberedMotion:
    """Let the motion go on by one sample; what it no longer keeps to is dropped."""
    # Its speed may change on the way: places and velocities tell whether that is as before.
    if motion.key is None or key is None or key[0] != motion.key[0]:
        return RememberedMotion(None, (sample,))
    found = [_matched(setup, motion, match, sample) for match in motion.matches]
    matches = tuple(match for match in found if match is not None)
    whole = len(motion.samples) < MOST_SAMPLES
    if not whole and not matches:
        return RememberedMotion(None, (sample,))
    # A path that is too long to be kept may still be one that is known.
    samples = (*motion.samples, sample) if whole else (motion.samples[0], sample)
    return RememberedMotion(motion.key, samples, matches)


def _matched(
    setup: Setup, motion: RememberedMotion, match: Match, sample: JointMotion
) -> Match | None:
    """Return where in a path the motion is now, or None if it has left it."""
    at = _time_in(motion, match, sample)
    there = match.path.at(at)
    # The shift along the path that brings the place nearest: one step of Gauss and Newton. Slow
    # joints say little about it.
    weights = [1.0 / (most * most) for most in setup.velocity]
    way = sum(
        w * v * (a - b) for w, v, a, b in zip(weights, there.qdot, sample.q, there.q, strict=True)
    )
    speed = sum(w * v * v for w, v in zip(weights, there.qdot))
    shift = match.shift + way / (speed + REST)
    moved = replace(match, shift=min(max(shift, -MOST_SHIFT_S), MOST_SHIFT_S))
    fits = _fits(setup, match.path.at(_time_in(motion, moved, sample)), sample)
    begins = sample.time - motion.samples[0].time <= BEGIN_S
    if not fits and not begins:
        return None
    return replace(moved, fits=fits)


def _fits(setup: Setup, there: JointMotion, sample: JointMotion) -> bool:
    """Return whether a sample is what the path shows."""
    for k, most in enumerate(setup.velocity):
        place = PLACE * setup.scale[k] + PLACE_S * abs(there.qdot[k])
        if abs(sample.q[k] - there.q[k]) > place:
            return False
        if abs(sample.qdot[k] - there.qdot[k]) > VELOCITY * most:
            return False
    return True


def _time_in(motion: RememberedMotion, match: Match, sample: JointMotion) -> float:
    return sample.time - motion.samples[0].time + match.shift


def _kept(
    setup: Setup, paths: tuple[RememberedPath, ...], motion: RememberedMotion, rest: JointMotion
) -> tuple[RememberedPath, ...]:
    """Keep the path of a motion that came to rest, instead of what it repeated."""
    samples = (*motion.samples, rest)
    if motion.key is None or len(samples) < 4 or _has_hole(samples):
        return paths
    begin, end = samples[0].q, rest.q
    others = [
        path
        for path in paths
        if path.key != motion.key
        or not _same(setup, path.begin, begin)
        or not _same(setup, path.end, end)
    ]
    made = RememberedPath(motion.key, _points(samples))
    return (*others, made)[-MOST_PATHS:]


def _same(setup: Setup, a: Joints, b: Joints) -> bool:
    return all(abs(x - y) <= PLACE * scale for x, y, scale in zip(a, b, setup.scale))


def _has_hole(samples: Sequence[JointMotion]) -> bool:
    return any(after.time - before.time > HOLE_S for before, after in pairwise(samples))


def _points(samples: Sequence[JointMotion]) -> tuple[JointMotion, ...]:
    """Return samples as a path; accelerations are what the velocities around show."""
    start, still = samples[0].time, (0.0,) * len(samples[0].q)
    middle = [
        tuple((b - a) / (after.time - before.time) for a, b in zip(before.qdot, after.qdot))
        for before, after in zip(samples, samples[2:])
    ]
    return tuple(
        JointMotion(sample.q, sample.qdot, qddot, sample.time - start)
        for sample, qddot in zip(samples, (still, *middle, still), strict=True)
    )


def _limited(setup: Setup, motion: JointMotion) -> Joints:
    """Return the acceleration within the robot's limits: a difference of readings is noisy."""
    return tuple(
        math.copysign(min(abs(a), most), a) for a, most in zip(motion.qddot, setup.acceleration)
    )
