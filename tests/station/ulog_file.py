"""Writes small ULog files by the format's description (PX4's developer guide), for the tests of what reads them."""

import struct
from pathlib import Path

FORMATS = {
    "vehicle_attitude": ("float[4] q",),
    "vehicle_global_position": ("double lat", "double lon", "float alt", "float alt_ellipsoid"),
    "vehicle_local_position": ("float vx", "float vy", "float vz"),
    "vehicle_angular_velocity": ("float[3] xyz",),
    "vehicle_status": ("uint8_t arming_state", "uint8_t nav_state", "bool failsafe"),
    "vehicle_land_detected": ("bool landed",),
    "home_position": ("double lat", "double lon", "float alt"),
    "battery_status": ("float remaining",),
    "vehicle_gps_position": ("uint64_t time_utc_usec", "uint8_t fix_type"),
    "gimbal_device_attitude_status": ("float[4] q", "uint16_t device_flags"),
}
CODES = {"double": "d", "float": "f", "uint8_t": "B", "bool": "?", "uint16_t": "H", "uint64_t": "Q"}


class UlogFile:
    """Rows are added by topic, in order of time; `write` makes the file."""

    def __init__(self, start_us: int = 0) -> None:
        self._start_us = start_us
        self._rows: list[tuple[int, str, tuple]] = []

    def add(self, topic: str, boot_us: int, *values: object) -> None:
        self._rows.append((boot_us, topic, values))

    def write(self, path: Path) -> Path:
        topics = sorted({topic for _, topic, _ in self._rows})
        data = b"ULog\x01\x12\x35" + bytes([1]) + struct.pack("<Q", self._start_us)
        data += self._message(b"B", bytes(40))
        for topic in topics:
            fields = ";".join(("uint64_t timestamp", *FORMATS[topic]))
            data += self._message(b"F", f"{topic}:{fields};".encode())
        for number, topic in enumerate(topics):
            data += self._message(b"A", struct.pack("<BH", 0, number) + topic.encode())
        for boot_us, topic, values in sorted(self._rows, key=lambda row: row[0]):
            packing = "<HQ" + "".join(self._code(field) for field in FORMATS[topic])
            data += self._message(b"D", struct.pack(packing, topics.index(topic), boot_us, *values))
        path.write_bytes(data)
        return path

    @staticmethod
    def _message(kind: bytes, body: bytes) -> bytes:
        return struct.pack("<H", len(body)) + kind + body

    @staticmethod
    def _code(field: str) -> str:
        kind = field.split(" ", maxsplit=1)[0]
        if "[" in kind:
            base, length = kind[:-1].split("[")
            return CODES[base] * int(length)
        return CODES[kind]
