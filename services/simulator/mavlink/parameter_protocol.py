"""PARAM_REQUEST_READ, PARAM_REQUEST_LIST and PARAM_SET. Integers travel bytewise in the float field, as PX4 sends them."""

import struct

from services.simulator.autopilot.parameters import Parameters
from services.simulator.mavlink.dialect import Message, dialect

NO_INDEX = 65535


class ParameterProtocol:
    """Answers what is asked of the parameters; what does not exist gets no answer."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters

    def read(self, message: Message) -> list[Message]:
        """One by its index, or by its name if the index is -1."""
        names = self._parameters.names
        if message.param_index >= 0:
            return [self._value(names[message.param_index])] if message.param_index < len(names) else []
        return [self._value(message.param_id)] if message.param_id in self._parameters else []

    def read_all(self) -> list[Message]:
        """All of them."""
        return [self._value(name) for name in self._parameters.names]

    def set(self, message: Message) -> list[Message]:
        """Change one and confirm it; a value of the wrong type or no number changes nothing."""
        name = message.param_id
        if name not in self._parameters:
            return []
        integer = self._parameters.is_integer(name)
        if (message.param_type == dialect.MAV_PARAM_TYPE_REAL32) == integer:
            return [self._value(name)]
        value = message.param_value
        if integer:
            self._parameters.set(name, struct.unpack("<i", struct.pack("<f", value))[0])
        elif abs(value) < 1e9:
            self._parameters.set(name, value)
        return [self._value(name)]

    def _value(self, name: str) -> Message:
        value, names = self._parameters[name], self._parameters.names
        if self._parameters.is_integer(name):
            kind, value = dialect.MAV_PARAM_TYPE_INT32, struct.unpack("<f", struct.pack("<i", int(value)))[0]
        else:
            kind = dialect.MAV_PARAM_TYPE_REAL32
        return dialect.MAVLink_param_value_message(name.encode(), value, kind, len(names), names.index(name))
