"""What is printed: marker families and their codes."""
