"""The MAVLink dialect, under one name. `development` is the one that has CURRENT_MODE."""

from typing import Any

from pymavlink.dialects.v20 import development

dialect: Any = development
"""pymavlink's generated module has no types."""

Message = Any
"""A MAVLink message of pymavlink."""
