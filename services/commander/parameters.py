"""The autopilot's parameters that decide whether a landing is safe: read, never written."""

import struct
from collections.abc import Mapping
from typing import Any

from alight.runtime.clock import nanoseconds
from services.commander.dialect import mavlink

WANTED = ("NAV_DLL_ACT", "COM_OF_LOSS_T", "COM_OBL_RC_ACT", "COM_DISARM_LAND", "MPC_LAND_SPEED", "MPC_XY_VEL_MAX")
"""PX4 parameters, in the order of asking."""
WATCHED = ("NAV_DLL_ACT", "COM_OBL_RC_ACT")
"""Asked for also when they are known: they may be changed in flight, and the announcement of that may be lost or go to another link."""
ASK_AGAIN_S = 1.0
QUICK_ROUNDS = 5
"""So often it is asked at that pace; on a link that loses packets each of them may be lost."""
ASK_SLOWLY_S = 10.0
"""From then on: an autopilot that does not have a parameter says nothing, and one that could not answer must be asked again."""

ROUNDS_TO_COMPLAIN = 2
"""An answer takes some hundredths of a second, so by the second round one has failed to come."""

_INTEGERS = {
    mavlink.MAV_PARAM_TYPE_UINT8: "<B",
    mavlink.MAV_PARAM_TYPE_INT8: "<b",
    mavlink.MAV_PARAM_TYPE_UINT16: "<H",
    mavlink.MAV_PARAM_TYPE_INT16: "<h",
    mavlink.MAV_PARAM_TYPE_UINT32: "<I",
    mavlink.MAV_PARAM_TYPE_INT32: "<i",
}


class Parameters:
    """Asks for each wanted parameter until it is known, however long that takes, and follows what the autopilot says later."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget all and ask anew."""
        self.values: dict[str, float] = {}
        """Known values by name."""
        self._rounds = 0
        self._next_ns = 0

    def take(self, message: Any) -> None:
        """Take a PARAM_VALUE. PX4 sends an integer as its bytes in the place of the float."""
        if message.param_id not in WANTED:
            return
        layout = _INTEGERS.get(message.param_type)
        value = message.param_value
        if layout is not None:
            value = struct.unpack(layout, struct.pack("<f", value)[: struct.calcsize(layout)])[0]
        self.values[message.param_id] = float(value)

    def due(self, now_ns: int, system: int, component: int) -> list[Any]:
        """The PARAM_REQUEST_READ messages to send now."""
        if now_ns < self._next_ns:
            return []
        self._rounds += 1
        quick = self._rounds < QUICK_ROUNDS
        self._next_ns = now_ns + nanoseconds(ASK_AGAIN_S if quick else ASK_SLOWLY_S)
        asked = [name for name in WANTED if name not in self.values or (not quick and name in WATCHED)]
        return [
            mavlink.MAVLink_param_request_read_message(system, component, name.encode("ascii"), -1) for name in asked
        ]

    def complaints(self) -> tuple[str, ...]:
        """What is not known though it was asked for more than once, in words with the consequence.

        A landing is not refused for it: a simulation or another autopilot may not have the parameter.
        """
        if self._rounds < ROUNDS_TO_COMPLAIN or "COM_OBL_RC_ACT" in self.values:
            return ()
        return (
            "COM_OBL_RC_ACT is not known, the autopilot does not answer: what it does when setpoints stop is not known either, and if it "
            "terminates the flight (6) or disarms in the air (7) a landing is not refused; look it up before the flight",
        )


def complaints_about(values: Mapping[str, float], heartbeat_as_gcs: bool) -> tuple[str, ...]:
    """What makes a landing less safe than it should be, in words with the remedy."""
    found: list[str] = []
    if values.get("COM_OF_LOSS_T", 1.0) > 3.0:
        found.append(f"COM_OF_LOSS_T is {values['COM_OF_LOSS_T']:g} s: a lost commander is noticed late; set 1")
    if values.get("MPC_LAND_SPEED", 0.7) > 1.2:
        found.append(f"MPC_LAND_SPEED is {values['MPC_LAND_SPEED']:g} m/s: a hard touchdown in landing mode; set 0.7")
    if values.get("COM_DISARM_LAND", 2.0) < 0.0:
        found.append("COM_DISARM_LAND is off: the motors do not stop by themselves after a landing; set 2")
    if heartbeat_as_gcs and values.get("NAV_DLL_ACT", 0.0) > 0.0:
        found.append(
            "NAV_DLL_ACT is set, but the commander passes for a ground station and hides its loss: "
            "set commander.link.heartbeat = onboard_controller"
        )
    return (*found, *([refusal] if (refusal := forbids_offboard(values)) else []))


def forbids_offboard(values: Mapping[str, float]) -> str | None:
    """Why setpoints must not be flown with these parameters; None if they may."""
    action = values.get("COM_OBL_RC_ACT", 0.0)
    if action in (6.0, 7.0):
        what = "terminates the flight" if action == 6.0 else "disarms in the air"
        return f"COM_OBL_RC_ACT is {action:g}: the autopilot {what} when setpoints stop; set 5 (hold) or 0 (return)"
    return None
