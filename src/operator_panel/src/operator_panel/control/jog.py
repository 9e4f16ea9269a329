"""The dead-man rule of jogging: a joint moves only while signs of a held button keep coming.

A press has a number. Signs of a press that was released, or of an older one, are ignored, so that
a packet that arrives late cannot start a motion again. After the last sign there is one explicit
zero, then silence.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from scara_config import Robot


class JogError(ValueError):
    """The press is wrong; the text says why."""


@dataclass
class DeadMan:
    """One held button at most. Not thread-safe: its owner holds one lock.

    Args:
        robot: Joints and their largest speeds.
        limit_percent: Largest share of a joint's speed.
        timeout: Without a sign for so long the joint stops [s].
    """

    robot: Robot
    limit_percent: float
    timeout: float
    _page: str = ""
    _press: int = 0
    _joint: str = ""
    _velocity: float = 0.0
    _seen: float = 0.0
    _ended: dict[str, int] = field(default_factory=dict)
    _stopping: list[str] = field(default_factory=list)

    @property
    def page(self) -> str:
        """The page whose button is held, or an empty text."""
        return self._page

    def hold(
        self, page: str, press: int, joint: str, direction: int, speed_percent: float, now: float
    ) -> None:
        """Take a sign of a held button.

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
        if self._page and page != self._page:
            raise JogError("another page's jog button is held")
        if press <= self._ended.get(page, 0) or press < self._press:
            return
        if joint != self._joint and self._joint:
            self._stopping.append(self._joint)
        self._page, self._press, self._joint, self._seen = page, press, joint, now
        self._velocity = direction * limits[joint] * speed_percent / 100.0

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

    def tick(self, now: float) -> dict[str, float]:
        """Return the velocities to send now [rad/s] or [m/s]; an empty answer is silence."""
        if self._page and now - self._seen > self.timeout:
            self._end()
        velocities = dict.fromkeys(self._stopping, 0.0)
        self._stopping = []
        if self._joint:
            velocities[self._joint] = self._velocity
        return velocities

    def _end(self) -> None:
        self._ended[self._page] = max(self._press, self._ended.get(self._page, 0))
        if self._joint:
            self._stopping.append(self._joint)
        self._page, self._joint, self._velocity, self._press = "", "", 0.0, 0
