"""The service ``twin_controller/shadow``: the pair, now or a minute ago, as one JSON document."""

from __future__ import annotations

import threading

import msgspec
import rospy

from scara_msgs.srv import Shadow, ShadowResponse
from twin_controller.core.setup import Setup
from twin_controller.core.state import CoreState
from twin_controller.reporting.shadow import ShadowError, ShadowMemory, shadow_of


class ShadowService:
    """Remembers from the engine's thread, answers from others."""

    def __init__(self, setup: Setup, configuration: str) -> None:
        """Start empty; ``configuration`` identifies the files in force."""
        self._setup, self._configuration = setup, configuration
        self._lock = threading.Lock()
        self._memory = ShadowMemory(
            setup.config.shadow.period_ms * 1e-3, setup.config.shadow.memory_s
        )
        self._newest: tuple[CoreState, float, float] | None = None

    def offer(self) -> rospy.Service:
        """Offer the service."""
        return rospy.Service("twin_controller/shadow", Shadow, self._answer)

    def remember(self, state: CoreState, now: float, stamp: float) -> None:
        """Take the newest state; a document of it is kept when one is due.

        Args:
            state: What the controller knows.
            now: Its time [s].
            stamp: ROS time [s].
        """
        with self._lock:
            self._newest = (state, now, stamp)
            if self._memory.due(stamp):
                self._memory.keep(
                    shadow_of(
                        self._setup,
                        state,
                        now,
                        stamp,
                        self._memory.revision + 1,
                        self._configuration,
                    )
                )

    def _answer(self, request: Shadow._request_class) -> ShadowResponse:
        with self._lock:
            try:
                if request.time == 0.0 and self._newest is not None:
                    shadow = shadow_of(
                        self._setup, *self._newest, self._memory.revision, self._configuration
                    )
                else:
                    shadow = self._memory.at(request.time)
            except ShadowError as error:
                return ShadowResponse(False, str(error), "")
        return ShadowResponse(True, "", msgspec.json.encode(shadow).decode())
