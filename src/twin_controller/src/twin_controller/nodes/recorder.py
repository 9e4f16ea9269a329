"""Node ``recorder``: one bag per run, on request.

Parameters: ``~config_dir`` (experiments.yaml, section recorder), ``~directory`` (base of relative paths; default: the
environment's CELL_ROOT, else the working folder).
Services: ``recorder/start`` (scara_msgs/StartRecording), ``recorder/stop`` (scara_msgs/StopRecording).
Publishes ``/diagnostics``. Subscribes while recording to all topics of experiments.yaml, raw.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from datetime import datetime
from pathlib import Path

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from scara_config import ConfigError, config_directory, load, locate
from scara_ros.memory import keep_for_good
from scara_ros.nodes.starting import become_node

from scara_msgs.srv import StartRecording, StartRecordingResponse, StopRecording, StopRecordingResponse
from twin_controller.io.bag_writer import BagWriter, BagWriterError
from twin_controller.recording import Diagnosis, RecorderFile, RecorderSettings, RecordingStatus, bag_path, diagnose

BATCH = 1000  # our choice: messages that rospy may hold per connection; it is read out at once
CONNECT_DEADLINE_S = 3.0  # our choice: topics that are published already are connected before `start` answers
DIAGNOSTICS_PERIOD_S = 1.0  # REP-107
WATCH_PERIOD_S = 0.1  # our choice: how soon a change is shown


class Recorder:
    """Holds at most one recording and the subscriptions that feed it."""

    def __init__(self, settings: RecorderSettings, base: Path) -> None:
        """Offer the services."""
        self._settings = settings
        self._base = base
        self._lock = threading.Lock()
        self._writer: BagWriter | None = None
        self._last = RecordingStatus()
        self._subscribers: list[rospy.Subscriber] = []
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10, tcp_nodelay=True)
        self._services = [
            rospy.Service("recorder/start", StartRecording, self._start),
            rospy.Service("recorder/stop", StopRecording, self._stop),
        ]
        threading.Thread(target=self._watch, name="diagnostics", daemon=True).start()

    def close(self) -> None:
        """Finish a running recording."""
        self._stop(None)

    def _start(self, request: StartRecording._request_class) -> StartRecordingResponse:
        """Open the bag, subscribe, and answer once everything that is published already is connected."""
        with self._lock:
            if self._writer is not None:
                return StartRecordingResponse(False, "already recording", str(self._writer.path))
            if rospy.get_rostime().is_zero():
                return StartRecordingResponse(False, "use_sim_time is set but /clock is silent", "")
            path = Path(bag_path(request.path, self._base, datetime.now().strftime("%Y-%m-%d_%H-%M-%S")))
            try:
                self._writer = BagWriter(path, self._settings)
            except BagWriterError as error:
                return StartRecordingResponse(False, str(error), str(path))
            self._subscribe(self._writer)
            rospy.loginfo("recorder: recording %s", path)
            return StartRecordingResponse(True, "", str(path))

    def _stop(self, _: object) -> StopRecordingResponse:
        """Leave the topics, close the bag, answer when it is complete."""
        with self._lock:
            if self._writer is None:
                return StopRecordingResponse(False, "not recording", "", 0)
            for subscriber in self._subscribers:
                subscriber.unregister()
            self._subscribers = []
            writer, self._writer = self._writer, None
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
                writer.put(name, message._connection_header, message._buff, rospy.get_rostime().to_nsec())

            self._subscribers.append(rospy.Subscriber(name, rospy.AnyMsg, keep, queue_size=BATCH, tcp_nodelay=True))
        published = {name for name, _ in rospy.get_published_topics()}
        open_ones = [s for s in self._subscribers if s.resolved_name in published]
        deadline = time.monotonic() + CONNECT_DEADLINE_S
        while not all(s.get_num_connections() for s in open_ones) and time.monotonic() < deadline:
            time.sleep(0.01)
        for subscriber in open_ones:
            if not subscriber.get_num_connections():
                rospy.logwarn("recorder: %s is announced but its publisher does not answer", subscriber.resolved_name)

    def _watch(self) -> None:
        """Publish diagnostics each second and when the verdict changes."""
        shown: tuple[object, str] | None = None
        due = 0.0
        while not rospy.is_shutdown():
            writer = self._writer
            found = diagnose(writer.status if writer is not None else self._last)
            if time.monotonic() >= due or shown != (found.level, found.message):
                shown, due = (found.level, found.message), time.monotonic() + DIAGNOSTICS_PERIOD_S
                self._diagnostics.publish(_message(found))
            time.sleep(WATCH_PERIOD_S)


def _message(found: Diagnosis) -> DiagnosticArray:
    """Turn a diagnosis into its message."""
    values = [KeyValue(name, value) for name, value in found.values]
    status = DiagnosticStatus(int(found.level), rospy.resolve_name("recorder"), found.message, "bag", values)
    array = DiagnosticArray(status=[status])
    array.header.stamp = rospy.get_rostime()
    return array


def main() -> None:
    """Record on request until shut down."""
    become_node("recorder")
    try:
        folder = Path(rospy.get_param("~config_dir", "") or config_directory())
        settings = load(locate("experiments.yaml", folder), RecorderFile).recorder
    except ConfigError as error:
        rospy.logfatal("recorder: %s", error)
        sys.exit(2)
    base = Path(rospy.get_param("~directory", "") or os.environ.get("CELL_ROOT") or Path.cwd())
    recorder = Recorder(settings, base.resolve())
    rospy.on_shutdown(recorder.close)
    keep_for_good()
    rospy.spin()
