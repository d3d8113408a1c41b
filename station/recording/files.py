"""Which files a person means."""

from pathlib import Path


def files_of(path: Path) -> list[Path]:
    """The file that is named, or the MCAP files of the folder that is named, in the order of their names' numbers."""
    if path.is_dir():
        return sorted(path.glob("*.mcap"), key=lambda file: (len(file.name), file.name))
    return [path] if path.is_file() else []
