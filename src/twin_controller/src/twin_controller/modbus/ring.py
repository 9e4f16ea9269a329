"""The ring of set points ahead as words: where each number stands, and until when it counts."""

from __future__ import annotations

import math
from collections.abc import Iterator

from scara_config.modbus_map import RING_NUMBERS, ModbusMap

from twin_controller.core.actions import RobotSetpoint, StreamAhead
from twin_controller.modbus.blocks import MOST_WRITTEN
from twin_controller.registers import RegisterCodec
from twin_controller.robot_sample import CLOCK_WRAP_MS

EMPTY = -1
"""The time of a place that holds no set point."""


class RingCodec:
    """Make the requests that fill the ring; it remembers what stands in each place.

    Args:
        layout: modbus_map.yaml.
        codec: Encodes values.
    """

    def __init__(self, layout: ModbusMap, codec: RegisterCodec) -> None:
        self._codec, self._places = codec, layout.ring_places
        # The set point in each place; None: it is free.
        self._points: list[RobotSetpoint | None] = [None] * self._places

    def empty(self) -> None:
        """Forget what stands there."""
        self._points = [None] * self._places

    def setpoints(self, ahead: StreamAhead) -> Iterator[tuple[int, list[int]]]:
        """Yield offset and words of the requests that write the set points.

        Neighbouring places go in one request, as far as it may carry them. A place is free until
        all of them are written; nothing changes where one set point is refused.

        Raises:
            SetpointError: A joint is outside its range.
        """
        points = {(point.number - 1) % self._places: point for point in ahead.points}
        rows = {place: self._codec.encode_positions(point.q) for place, point in points.items()}
        for place in points:
            self._points[place] = None
        run: list[int] = []
        words: list[int] = []
        for place, row in sorted(rows.items()):
            if run and (place != run[-1] + 1 or len(words) + len(row) > MOST_WRITTEN):
                yield self._codec.place_offset(run[0]), words
                run, words = [], []
            run.append(place)
            words = words + row
        if run:
            yield self._codec.place_offset(run[0]), words
        for place, point in points.items():
            self._points[place] = point

    def times(self, ahead: StreamAhead, heartbeat: int) -> tuple[int, list[int]]:
        """Return offset and words of the request that makes them count.

        Args:
            ahead: The newest number, and the speed of the stream program; below 1 % it is 1 %.
            heartbeat: R[1], 0..32767.
        """
        times = [EMPTY] * self._places
        for place, point in enumerate(self._points):
            # Only the last ones up to the newest count.
            if point is not None and (ahead.newest - point.number) % RING_NUMBERS < self._places:
                times[place] = point.clock_ms % CLOCK_WRAP_MS
        speed = max(1, math.floor(ahead.speed_percent))
        return self._codec.encode_ring(heartbeat, speed, ahead.newest, times)
