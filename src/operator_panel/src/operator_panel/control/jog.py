"""The dead-man rule of jogging: something moves only while signs of a held button keep coming.

A press has a number. Signs of a press that was released, of one that has ended by itself, or of an
older one are ignored, so that a packet that arrives late cannot start a motion again. After the
last sign there is one explicit zero for each joint that moved, then silence.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from scara_config import Robot

Where = Callable[[], Mapping[str, float]]
"""Tells where the twin's joints are now [rad] or [m]; raises :class:`JogError` if it is unknown."""


class JogError(ValueError):
    """The press is wrong, or cannot go on; the text says why."""


class Held(Protocol):
    """What a held button moves, and which way. Immutable."""

    @property
    def what(self) -> str:
        """What is moved which way, whatever its speed."""

    def begun(self, where: Where) -> Held:
        """Return the motion that begins now, where the joints are."""

    def as_fast_as(self, other: Held) -> Held:
        """Return this motion with the speed of another one of the same ``what``."""

    def velocities(self, where: Where) -> dict[str, float]:
        """Return the joints' velocities now [rad/s] or [m/s].

        Raises:
            JogError: The motion cannot go on from here.
        """


@dataclass(frozen=True)
class JointHeld:
    """One joint at a velocity [rad/s] or [m/s]."""

    joint: str
    velocity: float

    @property
    def what(self) -> str:
        """The joint, and its direction."""
        return f"{self.joint} {'+' if self.velocity > 0.0 else '-'}"

    def begun(self, where: Where) -> JointHeld:
        """Return itself: it is the same everywhere."""
        return self

    def as_fast_as(self, other: Held) -> Held:
        """Return the other one."""
        return other

    def velocities(self, where: Where) -> dict[str, float]:
        """Return the joint's velocity."""
        return {self.joint: self.velocity}


@dataclass
class DeadMan:
    """One held button at most. Not thread-safe: its owner holds one lock.

    Args:
        robot: Joints and their largest speeds.
        limit_percent: Largest share of a joint's speed.
        timeout: Without a sign for so long everything stops [s].
    """

    robot: Robot
    limit_percent: float
    timeout: float
    _page: str = ""
    _press: int = 0
    # What the button asks for, and what moves: None until it has begun, and once it is over.
    _asked: Held | None = None
    _way: Held | None = None
    _moving: tuple[str, ...] = ()
    _seen: float = 0.0
    # By page, the newest press that has ended: a late sign of it begins nothing again.
    _ended: dict[str, int] = field(default_factory=dict)
    # Joints that get a velocity of 0 with the next look.
    _stopping: list[str] = field(default_factory=list)
    # Page, press and reason of what could not go on: its other signs are answered by the reason.
    _given_up: tuple[str, int, str] = ("", 0, "")

    @property
    def page(self) -> str:
        """The page whose button is held, or an empty text."""
        return self._page

    def hold(
        self, page: str, press: int, joint: str, direction: int, speed_percent: float, now: float
    ) -> None:
        """Take a sign of a held button that moves one joint.

        Args:
            page: Whose button it is.
            press: Number of the press, growing on each page.
            joint: Name of the joint.
            direction: 1 or -1.
            speed_percent: Share of the joint's speed.
            now: Monotonic time [s].

        Raises:
            JogError: Unknown joint, impossible direction or speed, or another page holds a button.
        """
        limits = {j.name: j.velocity for j in self.robot.twin_joints}
        if joint not in limits:
            raise JogError(f"unknown joint {joint!r}: there are {', '.join(limits)}")
        if direction not in (-1, 1):
            raise JogError(f"direction = {direction}: it is 1 or -1")
        if not 0.0 < speed_percent <= self.limit_percent:
            raise JogError(f"speed = {speed_percent:g} % is outside 0 to {self.limit_percent:g} %")
        velocity = direction * limits[joint] * speed_percent / 100.0
        self.hold_way(page, press, JointHeld(joint, velocity), now)

    def hold_way(self, page: str, press: int, way: Held, now: float) -> None:
        """Take a sign of a held button that moves ``way``.

        Raises:
            JogError: Another page holds a button, the press moves something else already, or it
                could not go on: a press that has ended does not begin again.
        """
        if self._page and page != self._page:
            raise JogError("another page's jog button is held")
        if (page, press) == self._given_up[:2]:
            raise JogError(self._given_up[2])
        if press <= self._ended.get(page, 0) or press < self._press:
            return
        if press == self._press and self._asked is not None and way.what != self._asked.what:
            raise JogError(f"{way.what}: this press moves {self._asked.what}")
        if press != self._press:
            self._stopping.extend(self._moving or self._begins())
            self._way, self._moving = None, ()
        self._page, self._press, self._asked, self._seen = page, press, way, now
        self._way = self._way and self._way.as_fast_as(way)

    def release(self, page: str, press: int | None = None) -> None:
        """End a press of ``page``, or whatever it holds; ignore later signs of that press."""
        if press is not None:
            self._ended[page] = max(press, self._ended.get(page, 0))
        if page == self._page and (press is None or press >= self._press):
            self._end()

    def stop(self) -> None:
        """End whatever is held: the mode or the operator has changed."""
        if self._page:
            self._end()

    def forget(self, page: str) -> None:
        """Drop a page that is gone for good."""
        self.release(page)
        self._ended.pop(page, None)

    def tick(self, now: float, where: Where = dict) -> dict[str, float]:
        """Return the velocities to send now [rad/s] or [m/s]; an empty answer is silence.

        Args:
            now: Monotonic time [s].
            where: Tells where the joints are, for what is not the same everywhere.
        """
        if self._page and now - self._seen > self.timeout:
            self._end()
        going = self._going(where) if self._asked is not None else {}
        velocities = dict.fromkeys(self._stopping, 0.0)
        self._stopping = []
        # A joint that stops and goes again at once keeps its velocity: what goes replaces the zero.
        return velocities | going

    def _going(self, where: Where) -> dict[str, float]:
        """Return the velocities of what is held; what cannot go on ends, and its press for good."""
        try:
            assert self._asked is not None
            if self._way is None:
                self._way = self._asked.begun(where)
            going = self._way.velocities(where)
        except JogError as error:
            self._given_up = (self._page, self._press, str(error))
            self._end()
            return {}
        self._stopping.extend(name for name in self._moving if name not in going)
        self._moving = tuple(going)
        return going

    def _end(self) -> None:
        self._ended[self._page] = max(self._press, self._ended.get(self._page, 0))
        self._stopping.extend(self._moving or self._begins())
        self._page, self._press, self._asked, self._way, self._moving = "", 0, None, None, ()

    def _begins(self) -> tuple[str, ...]:
        """Return what was held for less than a period: its zero may come before its motion."""
        return (self._asked.joint,) if isinstance(self._asked, JointHeld) else ()
