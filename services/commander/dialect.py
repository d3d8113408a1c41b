"""The MAVLink dialect, in one place: `development`, since `common` lacks CURRENT_MODE."""

from pymavlink.dialects.v20 import development as mavlink

__all__ = ["mavlink"]
