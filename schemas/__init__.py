"""The contract between the processes: messages, topics, wire format, settings. Pure pydantic; imports nothing of ours."""
