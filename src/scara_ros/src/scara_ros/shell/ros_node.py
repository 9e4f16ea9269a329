"""The shell of every node: its start, the folder of its configuration, its end if that is wrong."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path

import rospy
from scara_config import ConfigError, config_directory

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
