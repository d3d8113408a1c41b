"""The parameters of the autopilot: PX4's names and default values."""

from collections.abc import Mapping

DEFAULTS: dict[str, float | int] = {
    "CAL_ACC0_ID": 1310988,
    "CAL_GYRO0_ID": 1310988,
    "CAL_MAG0_ID": 197388,
    "COM_DISARM_LAND": 2.0,
    "COM_DISARM_PRFLT": 10.0,
    "COM_DL_LOSS_T": 10,
    "COM_FAIL_ACT_T": 5.0,
    "COM_OBL_RC_ACT": 0,
    "COM_OF_LOSS_T": 1.0,
    "COM_SPOOLUP_TIME": 1.0,
    "LNDMC_Z_VEL_MAX": 0.25,
    "MAV_SYS_ID": 1,
    "MAV_TYPE": 2,
    "MC_PITCHRATE_D": 0.003,
    "MC_PITCHRATE_I": 0.2,
    "MC_PITCHRATE_P": 0.15,
    "MC_PITCH_P": 4.0,
    "MC_ROLLRATE_D": 0.003,
    "MC_ROLLRATE_I": 0.2,
    "MC_ROLLRATE_MAX": 220.0,
    "MC_ROLLRATE_P": 0.15,
    "MC_ROLL_P": 4.0,
    "MC_YAWRATE_I": 0.1,
    "MC_YAWRATE_MAX": 200.0,
    "MC_YAWRATE_P": 0.2,
    "MC_YAW_P": 2.8,
    "MIS_TAKEOFF_ALT": 2.5,
    "MNT_MODE_IN": -1,
    "MPC_ACC_DOWN_MAX": 3.0,
    "MPC_ACC_HOR": 3.0,
    "MPC_ACC_UP_MAX": 4.0,
    "MPC_JERK_AUTO": 4.0,
    "MPC_LAND_ALT1": 10.0,
    "MPC_LAND_ALT2": 5.0,
    "MPC_LAND_ALT3": 1.0,
    "MPC_LAND_CRWL": 0.3,
    "MPC_LAND_SPEED": 0.7,
    "MPC_THR_HOVER": 0.5,
    "MPC_THR_MAX": 1.0,
    "MPC_THR_MIN": 0.12,
    "MPC_THR_XY_MARG": 0.3,
    "MPC_TILTMAX_AIR": 45.0,
    "MPC_TKO_RAMP_T": 3.0,
    "MPC_TKO_SPEED": 1.5,
    "MPC_VEL_MANUAL": 10.0,
    "MPC_XY_CRUISE": 5.0,
    "MPC_XY_ERR_MAX": 2.0,
    "MPC_XY_P": 0.95,
    "MPC_XY_VEL_D_ACC": 0.2,
    "MPC_XY_VEL_I_ACC": 0.4,
    "MPC_XY_VEL_MAX": 12.0,
    "MPC_XY_VEL_P_ACC": 1.8,
    "MPC_YAWRAUTO_ACC": 20.0,
    "MPC_YAWRAUTO_MAX": 60.0,
    "MPC_Z_P": 1.0,
    "MPC_Z_VEL_D_ACC": 0.0,
    "MPC_Z_VEL_I_ACC": 2.0,
    "MPC_Z_VEL_MAX_DN": 1.5,
    "MPC_Z_VEL_MAX_UP": 3.0,
    "MPC_Z_VEL_P_ACC": 4.0,
    "MPC_Z_V_AUTO_DN": 1.5,
    "MPC_Z_V_AUTO_UP": 3.0,
    "NAV_DLL_ACT": 0,
    "NAV_MC_ALT_RAD": 0.8,
    "NAV_RCL_ACT": 2,
    "RTL_DESCEND_ALT": 10.0,
    "RTL_RETURN_ALT": 30.0,
    "SYS_AUTOSTART": 10040,
    "SYS_HAS_GPS": 1,
}
"""Integers are PX4's INT32 parameters, floats its FLOAT ones."""


class Parameters:
    """The parameters and their values now."""

    def __init__(self, changed: Mapping[str, float]) -> None:
        self._values = dict(DEFAULTS)
        self.names = tuple(sorted(DEFAULTS))
        """In the order of their index on the wire."""
        self.version = 0
        """Counts the changes, so that who keeps a copy knows when to take a new one."""
        for name, value in changed.items():
            if name not in DEFAULTS:
                raise ValueError(
                    f"simulator.parameters: the embedded autopilot has no parameter {name}; it has {', '.join(self.names)}"
                )
            self.set(name, value)

    def __getitem__(self, name: str) -> float | int:
        return self._values[name]

    def __contains__(self, name: str) -> bool:
        return name in self._values

    def is_integer(self, name: str) -> bool:
        """Whether it is an INT32 parameter."""
        return isinstance(DEFAULTS[name], int)

    def set(self, name: str, value: float) -> None:
        """Change one that exists; an INT32 parameter takes the whole part."""
        self._values[name] = int(value) if self.is_integer(name) else float(value)
        self.version += 1
