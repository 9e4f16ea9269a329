"""The shell of every node: its start, its configuration, its end if that is wrong, its cell."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import rospy
from scara_config import ConfigError, config_directory

from scara_ros.names import frame_in, is_of_cell
from scara_ros.shell.program_io import WRONG
from scara_ros.starting.starting_node import become_node


@contextlib.contextmanager
def starting(name: str, *errors: type[Exception]) -> Iterator[Path]:
    """Become the node ``name``, then read its configuration in the body of this context.

    Args:
        name: Without ``__name:=``, which counts before it.
        errors: What ends the node like a ConfigError.

    Yields:
        The folder of its YAML files.

    Raises:
        SystemExit: See ``become_node`` and ``refusing``.
    """
    become_node(name)
    with refusing(*errors):
        yield config_folder()


@contextlib.contextmanager
def refusing(*errors: type[Exception]) -> Iterator[None]:
    """End this node with one line where the body raises a ConfigError or one of ``errors``.

    Raises:
        SystemExit: It did; the code is 2.
    """
    kinds: tuple[type[Exception], ...] = (ConfigError, *errors)
    try:
        yield
    except kinds as error:
        rospy.logfatal("%s: %s", rospy.get_name().rpartition("/")[2], error)
        sys.exit(WRONG)


def config_folder() -> Path:
    """Return the folder of this node's YAML files.

    Raises:
        ConfigError: No parameter names it, and ROS cannot find the package scara_config.
    """
    return Path(rospy.get_param("~config_dir", "") or config_directory())


def own_frame(frame: str) -> str:
    """Return a frame as it is called on ``/tf``, in the namespace of this node."""
    return frame_in(frame, rospy.get_namespace())


def is_own(message: Any) -> bool:
    """Return whether a received message comes from a node of this node's cell."""
    return is_of_cell(message._connection_header.get("callerid", ""), rospy.get_namespace())
