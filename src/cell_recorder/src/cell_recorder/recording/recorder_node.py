"""Node ``recorder``: one recording per run, on request, in parts that are whole bags.

Parameters: ``~config_dir`` (experiments.yaml, section recorder), ``~directory`` (the runs folder;
default: runs of the environment's CELL_ROOT, else of the working folder). It writes nowhere else.
When the folder is beyond ``runs_limit_mb``, the oldest recordings of no experiment are removed.
Services: ``recorder/start`` (scara_msgs/StartRecording), ``recorder/stop``
(scara_msgs/StopRecording). Publishes ``/diagnostics``. Subscribes while recording to all topics of
experiments.yaml, raw. All cells at a master share ``/diagnostics``, ``/tf`` and ``/tf_static``: of
these it keeps what nodes of its own namespace send.
"""

from __future__ import annotations

import threading
import time
from datetime import datetime
from pathlib import Path

import rospy
from scara_config import locate
from scara_config.loader import load_keys
from scara_ros.diagnostics_node import PERIOD_S, Diagnostics
from scara_ros.names import SHARED_TOPICS, folder_of
from scara_ros.pacing import Pace
from scara_ros.process.memory_io import keep_for_good
from scara_ros.shell.program_io import runs_folder
from scara_ros.shell.ros_node import is_own, starting
from scara_ros.starting.registration_node import wait_for_end

from cell_recorder.recording.bag_writer_io import BagWriter, BagWriterError
from cell_recorder.recording.recording import (
    RecorderSettings,
    RecordingStatus,
    RunsState,
    diagnose,
)
from cell_recorder.recording.runs_folder_io import BagPathError, bag_file, keep_limit
from scara_msgs.srv import (
    StartRecording,
    StartRecordingResponse,
    StopRecording,
    StopRecordingResponse,
)

BATCH = 1000  # our choice: messages that rospy may hold per connection; it is read out at once
CONNECT_DEADLINE_S = (
    3.0  # our choice: topics that are published already are connected before `start` answers
)
WATCH_PERIOD_S = 0.1  # our choice: how soon a change is shown
ROOM_PERIOD_S = 30.0  # our choice: a recording of all topics grows by 15 MB meanwhile


class Recorder:
    """Holds at most one recording and the subscriptions that feed it."""

    def __init__(self, settings: RecorderSettings, runs: Path) -> None:
        """Offer the services; write below ``runs`` only, a resolved path."""
        self._settings = settings
        self._runs = runs
        self._runs_state = RunsState(limit_mb=settings.runs_limit_mb)
        self._lock = threading.Lock()
        self._writer: BagWriter | None = None
        self._last = RecordingStatus()
        self._subscribers: list[rospy.Subscriber] = []
        self._diagnostics = Diagnostics("bag")
        self._services = [
            rospy.Service("recorder/start", StartRecording, self._start),
            rospy.Service("recorder/stop", StopRecording, self._stop),
        ]
        threading.Thread(target=self._watch, name="diagnostics", daemon=True).start()
        threading.Thread(target=self._make_room, name="room", daemon=True).start()

    def close(self) -> None:
        """Finish a running recording."""
        self._stop(None)

    def _start(self, request: StartRecording._request_class) -> StartRecordingResponse:
        """Open the bag, subscribe, and answer once all that is published is connected."""
        with self._lock:
            if (writer := self._writer) is not None:
                if writer.status.active:
                    return StartRecordingResponse(False, "already recording", str(writer.path))
                # It has ended by itself, as /diagnostics says: nobody has to stop it first.
                self._finish(writer)
            if rospy.get_rostime().is_zero():
                return StartRecordingResponse(False, "use_sim_time is set but /clock is silent", "")
            stamp = datetime.now().strftime("%Y-%m-%d_%H-%M-%S")
            try:
                folder = folder_of(stamp, rospy.get_namespace())
                path = bag_file(self._runs, request.path, folder)
                self._writer = BagWriter(path, self._settings)
            except (BagPathError, BagWriterError) as error:
                rospy.logwarn("recorder: refused: %s", error)
                return StartRecordingResponse(False, str(error), request.path)
            self._subscribe(self._writer)
            rospy.loginfo("recorder: recording %s", path)
            return StartRecordingResponse(True, "", str(path))

    def _stop(self, _: object) -> StopRecordingResponse:
        """Leave the topics, close the bag, answer when it is complete."""
        with self._lock:
            if self._writer is None:
                return StopRecordingResponse(False, "not recording", "", 0)
            return self._finish(self._writer)

    def _finish(self, writer: BagWriter) -> StopRecordingResponse:
        """Leave the topics and close the bag; the lock is held."""
        for subscriber in self._subscribers:
            subscriber.unregister()
        self._subscribers = []
        self._writer = None
        try:
            self._last = writer.close()
        except BagWriterError as error:
            self._last = writer.status
            return StopRecordingResponse(False, str(error), str(writer.path), self._last.messages)
        failure = self._last.failure
        rospy.loginfo("recorder: %d messages in %s %s", self._last.messages, writer.path, failure)
        return StopRecordingResponse(not failure, failure, str(writer.path), self._last.messages)

    def _subscribe(self, writer: BagWriter) -> None:
        """Subscribe to all topics, those too that nobody publishes yet."""
        for topic in self._settings.topics:
            name = rospy.resolve_name(topic)

            def keep(message: rospy.AnyMsg, name: str = name) -> None:
                if name in SHARED_TOPICS and not is_own(message):
                    return
                writer.put(
                    name, message._connection_header, message._buff, rospy.get_rostime().to_nsec()
                )

            self._subscribers.append(
                rospy.Subscriber(name, rospy.AnyMsg, keep, queue_size=BATCH, tcp_nodelay=True)
            )
        published = {name for name, _ in rospy.get_published_topics()}
        open_ones = [s for s in self._subscribers if s.resolved_name in published]
        deadline = time.monotonic() + CONNECT_DEADLINE_S
        while not all(s.get_num_connections() for s in open_ones) and time.monotonic() < deadline:
            time.sleep(0.01)
        for subscriber in open_ones:
            if not subscriber.get_num_connections():
                rospy.logwarn(
                    "recorder: %s is announced but its publisher does not answer",
                    subscriber.resolved_name,
                )

    def _watch(self) -> None:
        """Publish diagnostics each second and when the verdict changes."""
        pace = Pace(PERIOD_S)
        while not rospy.is_shutdown():
            writer = self._writer
            status = writer.status if writer is not None else self._last
            found = diagnose(status, self._runs_state, rospy.resolve_name("recorder"))
            if pace.is_due(time.monotonic(), (found.level, found.message)):
                self._diagnostics.publish(found)
            time.sleep(WATCH_PERIOD_S)

    def _make_room(self) -> None:
        """Keep the runs folder within its limit; say what was removed."""
        while not rospy.is_shutdown():
            writer = self._writer
            busy = writer.path if writer is not None else None
            self._runs_state, removed = keep_limit(self._runs, self._runs_state, time.time(), busy)
            for recording in removed:
                rospy.logwarn(
                    "recorder: removed %s (%.0f MB, of no experiment): the runs folder had grown "
                    "beyond runs_limit_mb = %g",
                    recording.path,
                    recording.size / 1e6,
                    self._settings.runs_limit_mb,
                )
            time.sleep(ROOM_PERIOD_S)


def main() -> None:
    """Record on request until shut down."""
    with starting("recorder") as folder:
        # The other sections of the file belong to twin_experiments.
        (settings,) = load_keys(locate("experiments.yaml", folder), {"recorder": RecorderSettings})
    recorder = Recorder(settings, runs_folder(rospy.get_param("~directory", "")).resolve())
    rospy.on_shutdown(recorder.close)
    rospy.loginfo("recorder is ready")
    keep_for_good()
    wait_for_end()
