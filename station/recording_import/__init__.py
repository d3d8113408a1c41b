"""Flights that other programs recorded: an autopilot's log and a video become a recording like our own."""
