"""One folder a process. Services never import each other: what one needs of another arrives as a message."""
