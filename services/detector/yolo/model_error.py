"""What is raised for a model that cannot be used; known without the extra `yolo`, too."""


class ModelError(ValueError):
    """A model that is missing or is none that the detector can use, in one line with the key and the remedy."""
