"""What the pendant command says to the robot over Modbus (pymodbus sync client)."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import pymodbus
from pymodbus.client import ModbusTcpClient
from scara_config.map_entries import MODE_BITS
from scara_config.modbus_map import Bit, ModbusMap, SignalWord

from fanuc_emulator.registers import Value, decode, encode
from fanuc_emulator.uop import with_panel

_POLL = 0.003
_CONFIRM = 1.0
_SEQUENCES = 32768


class PendantError(RuntimeError):
    """The robot cannot be reached, or refuses."""


class PendantLink:
    """Read and write named registers and signals, as a context manager.

    Args:
        host: The robot's address.
        port: TCP port of its Modbus server.
        layout: modbus_map.yaml.
    """

    def __init__(self, host: str, port: int, layout: ModbusMap) -> None:
        pymodbus.pymodbus_apply_logging_config("CRITICAL")
        self._name = f"{host}:{port}"
        self._layout = layout = with_panel(layout)
        self._low_first = layout.word_order == "low_first"
        # pymodbus would try three more times, each with this time-out, before it tells of a dead
        # robot.
        self._client: Any = ModbusTcpClient(host, port=port, timeout=1.0, retries=0)

    def __enter__(self) -> PendantLink:
        """Connect.

        Raises:
            PendantError: Nobody listens there.
        """
        if not self._client.connect():
            raise PendantError(f"no robot at {self._name}: is the emulator running?")
        return self

    def __exit__(self, *_: object) -> None:
        self._client.close()

    def read(self, name: str) -> Value:
        """Read one register of the map; one that this robot does not have is empty."""
        register, table = self._layout.find(name), self._layout.table_of(name)
        if register is None:
            return ""
        answer = self._call(f"read_{table}", register.offset, count=register.words)
        return decode(register, answer.registers[: register.words], self._low_first)

    def write(self, name: str, values: Sequence[float] | Sequence[int]) -> None:
        """Write one register of the map.

        Raises:
            PendantError: The robot has no such register.
        """
        register = self._layout.holding_registers.get(name)
        if register is None:
            raise PendantError(f"this robot's map has no register {name}")
        self._call("write_registers", register.offset, encode(register, values, self._low_first))

    def outputs(self) -> dict[str, bool]:
        """Read UO by name."""
        if self._layout.status_word is not None:
            return self._lit(self._layout.status_word)
        table = self._layout.discrete_inputs
        if not table:
            return {}
        first = min(bit.offset for bit in table.values())
        count = max(bit.offset for bit in table.values()) - first + 1
        bits = self._call("read_discrete_inputs", first, count=count).bits
        return {name: bool(bits[bit.offset - first]) for name, bit in table.items()}

    def signal(self, name: str) -> bool:
        """Read the level of one UI signal; one that this robot does not show is on."""
        if self._layout.command_word is not None:
            return (
                self._lit(self._layout.switches_word).get(name, True)
                if self._layout.switches_word
                else True
            )
        coil = self._layout.coils.get(name)
        return coil is None or bool(self._call("read_coils", coil.offset, count=1).bits[0])

    def set_signal(self, name: str, level: bool) -> None:
        """Set one UI signal.

        Raises:
            PendantError: The robot has no such signal.
        """
        word = self._layout.command_word
        if word is None:
            self._call("write_coil", self._coil(name).offset, level)
        else:
            codes = word.codes.get(name)
            self._command(name, None if codes is None else codes.high if level else codes.low)

    def pulse(self, name: str) -> None:
        """Switch one UI signal on and off again."""
        if self._layout.command_word is not None:
            codes = self._layout.command_word.codes.get(name)
            self._command(name, None if codes is None else codes.pulse)
            return
        self.set_signal(name, True)
        time.sleep(self._coil(name).pulse_ms * 1e-3)
        self.set_signal(name, False)

    def _coil(self, name: str) -> Bit:
        coil = self._layout.coils.get(name)
        if coil is None:
            raise PendantError(f"this robot has no command for {name}")
        return coil

    def _lit(self, word: SignalWord) -> dict[str, bool]:
        """Read signals that are bits of a register."""
        # The register is an int16, so with bit 15 on it reads as a negative number.
        bits = int(self.read(word.register)[0]) & 0xFFFF
        return {name: bool(bits >> bit & 1) for name, bit in word.bits.items()}

    def _command(self, name: str, code: int | None) -> None:
        """Write a numbered command and wait until the robot confirms it.

        Raises:
            PendantError: The robot has no such command, or does not confirm it.
        """
        word = self._layout.command_word
        if word is None or code is None:
            raise PendantError(f"this robot has no command for {name}")
        echo = int(self.read(word.echo)[0])
        sequence = (
            echo + 2 - echo % 2
        ) % _SEQUENCES or 2  # even: the twin controller's numbers are odd
        self._call(
            "write_registers",
            self._layout.holding_registers[word.register].offset,
            [code, sequence],
        )
        deadline = time.monotonic() + _CONFIRM
        while int(self.read(word.echo)[0]) != sequence:
            if time.monotonic() > deadline:
                raise PendantError(f"the robot did not confirm {name}")
            time.sleep(_POLL)

    def mode(self) -> str:
        """Return at what the mode switch stands; empty: this robot does not tell."""
        bits = self.read("mode_b0"), self.read("mode_b1")
        shown = tuple(int(each[0]) for each in bits if each)
        return next((mode for mode, lit in MODE_BITS.items() if lit == shown), "")

    def alarm(self) -> str:
        """Return the active alarm as the pendant shows it, or an empty text."""
        message = str(self.read("alarm_message"))
        # A map may have the message alone.
        told = (self.read("alarm_cause"), self.read("alarm_severity_text"))
        more = ", ".join(str(each) for each in told if each)
        return f"{message} ({more})" if message and more else message

    def _call(self, function: str, offset: int, *arguments: Any, **options: Any) -> Any:
        """Send one request and check its answer."""
        from pymodbus.exceptions import ModbusException

        try:
            answer = getattr(self._client, function)(
                offset, *arguments, device_id=self._layout.device_id, **options
            )
        except (ModbusException, OSError) as error:
            raise PendantError(f"lost the robot at {self._name}: {error}") from error
        if answer.isError():
            raise PendantError(
                f"the robot refuses {function} at {offset + 1}: exception {answer.exception_code}"
            )
        return answer
