"""How the stand-in's controller was set up: named files, and what differs for one run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from scara_config import ConfigError, load
from scara_config.profile import chosen_settings, settings_path
from scara_config.set_up.settings import DEFAULT

from fanuc_emulator.uop import UopRequest, UopSettings

Mode = Literal["AUTO", "T1", "T2"]
MODES: tuple[Mode, ...] = ("AUTO", "T1", "T2")
_REMOTE = (UopRequest.QUEUE, UopRequest.SELECT, UopRequest.START, UopRequest.START_FIRST)


class ControllerSettings(UopSettings, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A file of settings/: what stands on the robot's screens.

    Attributes:
        num_modbus: So many clients are served at once; a further one ends the connection that has
            been silent for longest. 0: nobody is.
        slots: ``factory``: $SNPX_ASG as delivered; ``kit``: as fanuc_kit prints it.
        programs: ``kit``: the stream and the background program are there; ``none``: they are not.
        mode: Of the switch at the controller. Nothing is started by a signal but in AUTO; in T1
            neither tool nor flange is faster than 250 mm/s.
        tp_enabled: The teach pendant's switch is on: nothing is started by a signal.
        remote: Remote/Local setup.
        rmt_master: Who starts: 0 the signals, 1 CRT, 2 a host computer, 3 nobody.
        select_mode: By which signals a program is chosen.
        rsr: Registration number of RSR1 to RSR8; 0: that RSR is disabled.
        job_base: Is added to it; the program is named RSR and four digits.
        user_frame, tool_frame: Numbers of those that are selected.
    """

    num_modbus: Annotated[int, Meta(ge=0, le=16)]
    slots: Literal["factory", "kit"]
    programs: Literal["none", "kit"]
    mode: Mode
    tp_enabled: bool
    remote: bool
    rmt_master: Annotated[int, Meta(ge=0, le=3)]
    select_mode: Literal["RSR", "PNS", "STYLE", "OTHER"]
    rsr: Annotated[tuple[int, ...], Meta(min_length=8, max_length=8)]
    job_base: Annotated[int, Meta(ge=0, le=9999)]
    user_frame: Annotated[int, Meta(ge=0, le=9)]
    tool_frame: Annotated[int, Meta(ge=0, le=10)]

    @property
    def local(self) -> str:
        """Say why nothing may be started by a signal from outside, or an empty text.

        Source:
            B-83284EN/09, section 3.8: the remote conditions.
        """
        if self.mode != "AUTO":
            return f"the mode is {self.mode}"
        if self.tp_enabled:
            return "the teach pendant is enabled"
        if not self.remote:
            return "Remote/Local setup is Local"
        return f"$RMT_MASTER is {self.rmt_master}" if self.rmt_master else ""

    def turned(self, mode: Mode) -> ControllerSettings:
        """Return the settings with the mode switch turned, and the teach pendant's.

        That one has to be on in T1 and T2, and off in AUTO, or an alarm stops the robot.
        """
        return msgspec.structs.replace(self, mode=mode, tp_enabled=mode != "AUTO")

    def refuses(self, request: UopRequest, number: int, stream: int) -> str:
        """Say why a signal may not start or select a program now, or an empty text.

        Args:
            request: What the signal asks for.
            number: Of the RSR.
            stream: The RSR of the stream program.
        """
        if request not in _REMOTE:
            return ""
        if self.local or request is not UopRequest.QUEUE:
            return self.local
        if self.select_mode != "RSR":
            return f"Program select mode is {self.select_mode}"
        registered = self.rsr[number - 1]
        if not registered:
            return f"RSR{number} is disabled"
        wanted = registered + self.job_base
        there = wanted == 100 + number and (number != stream or self.programs == "kit")
        return "" if there else f"there is no program RSR{wanted:04d}"


def load_settings(
    directory: Path | str | None = None, given: str | Mapping[str, object] | None = None
) -> ControllerSettings:
    """Read a file of settings/, and what differs from it.

    Args:
        directory: Folder with all YAML files.
        given: Fields that differ, also as text with the file's name in front: ``delivered,
            num_modbus: 3``; default: what ``SCARA_SETTINGS`` says. Without a name: ``ready``.

    Raises:
        ConfigError: There is no such file, or a setting is unknown or does not fit.
    """
    if given is None:
        given = chosen_settings()
    if isinstance(given, str):
        try:
            # In YAML's braces a bare name is a key without a value: that is how the file's name is
            # told.
            given = YAML(typ="safe").load("{" + given + "}")
        except YAMLError as error:
            raise ConfigError(f"settings {given!r}: are no YAML of the form key: value") from error
    assert not isinstance(given, str) and given is not None
    known = ControllerSettings.__struct_fields__
    names = [name for name, value in given.items() if value is None and name not in known]
    path = settings_path(directory, names[0] if names else DEFAULT)
    fields = msgspec.structs.asdict(load(path, ControllerSettings))
    for name in given:
        if name not in fields and name not in names[:1]:
            raise ConfigError(f"settings: {name}: unknown, allowed are {', '.join(fields)}")
    changed = {name: value for name, value in given.items() if name in fields}
    try:
        return msgspec.convert({**fields, **changed}, ControllerSettings)
    except msgspec.ValidationError as error:
        raise ConfigError(f"settings: {error}") from error
