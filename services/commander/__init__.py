"""The commander: the only service that commands the vehicle."""
