"""Messages per second of the mcap library."""

from __future__ import annotations

import time


class Writer:
    """Writes raw messages of one topic with the library's default settings."""

    def __init__(self, path: str, size: int, messages: int) -> None:
        """Take the file, the size of a message and how many make a round."""
        import mcap

        self._path, self._data, self._messages = path, bytes(size), messages
        self.version = f"mcap {mcap.__version__}"

    def round(self) -> list[float]:
        """Write a file and return messages per second."""
        from mcap.writer import Writer as File

        begun = time.perf_counter()
        with open(self._path, "wb") as stream:
            file = File(stream)
            file.start("ros1")
            schema = file.register_schema("sensor_msgs/JointState", "ros1msg", b"")
            channel = file.register_channel("/twin/joint_states", "ros1", schema)
            for number in range(self._messages):
                file.add_message(
                    channel, 1_700_000_000_000_000_000 + 5_000_000 * number, self._data, 0
                )
            file.finish()
        return [self._messages / (time.perf_counter() - begun)]
