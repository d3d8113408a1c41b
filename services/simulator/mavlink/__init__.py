"""The autopilot's MAVLink side: links, streams, telemetry, commands, setpoints and parameters."""
