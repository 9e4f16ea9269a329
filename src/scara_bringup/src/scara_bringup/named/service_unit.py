"""The service unit of a cell, for systemd: it brings the cell back after a reboot or a crash; pure.

A cell that comes back aligns its twin and waits: nothing that was under way is gone on with.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

RETRY_S = 15
"""Our choice: a machine that has just started has no processor free for some seconds."""
STOP_S = 60
"""Our choice: a cell ends within seconds; its last recording may need some more."""
WRONG_CONFIGURATION = 2
"""Exit code of a cell that cannot start as it is: another try changes nothing."""


@dataclass(frozen=True)
class Service:
    """What a unit is to start.

    Attributes:
        name: Of the cell.
        root: The workspace, in which ``cell`` is.
        options: Further options of ``./cell up``.
        user: Who runs it, of a unit of the whole machine; empty: a unit of one person.
    """

    name: str
    root: Path
    options: tuple[str, ...] = ()
    user: str = ""

    @property
    def file(self) -> str:
        """The unit's file.

        Example:
            >>> Service("milk_2", Path("/cell")).file
            'cell-milk_2.service'
        """
        return f"cell-{self.name}.service"


def unit_text(service: Service) -> str:
    """Return the unit's file.

    Args:
        service: What it is to start; its path and options are quoted for systemd.
    """
    words = [str(service.root / "cell"), "up", "--name", service.name, "--no-browser"]
    start = " ".join(map(quoted, [*words, *service.options]))
    user = f"User={service.user}\n" if service.user else ""
    wanted_by = "multi-user.target" if service.user else "default.target"
    return f"""\
# Written by ./cell install {service.name}: write it again rather than change it.
[Unit]
Description=Cell {service.name}: robot, twin and what belongs to them
After=network.target
StartLimitIntervalSec=0

[Service]
Type=exec
{user}WorkingDirectory={str(service.root).replace("%", "%%")}
ExecStart={start}
Restart=on-failure
RestartSec={RETRY_S}
RestartPreventExitStatus={WRONG_CONFIGURATION}
# Only the cell itself is asked to end: it ends its nodes in their order.
KillMode=mixed
KillSignal=SIGTERM
SuccessExitStatus=130 143
TimeoutStopSec={STOP_S}

[Install]
WantedBy={wanted_by}
"""


def quoted(word: str) -> str:
    """Return a word as a command line of systemd takes it.

    Example:
        >>> quoted("up"), quoted("50% $x"), quoted("")
        ('up', '"50%% $$x"', '""')
    """
    plain = word.replace("\\", "\\\\").replace('"', '\\"').replace("%", "%%").replace("$", "$$")
    return plain if plain == word and " " not in word and word else f'"{plain}"'
