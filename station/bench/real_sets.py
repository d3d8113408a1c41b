"""The real pictures that lie beside the repository, and what their README says is in them (OpenCV 5.0's defaults unless it says otherwise)."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from alight.markers.charuco import Charuco
from services.camera.files import IMAGE_SUFFIXES, VIDEO_SUFFIXES

TUTORIAL_BOARD = Charuco(columns=5, rows=7, square_m=0.04, marker_m=0.02, family="6x6_250", legacy=True)
"""Of the ChArUco pictures of OpenCV's tutorials."""


@dataclass(frozen=True)
class RealSet:
    """Some files of one folder that hold the same markers."""

    pattern: str
    """Files below the folder of all real pictures."""
    family: str
    ids: frozenset[int]
    """All that are there; what else is found is false."""
    counts: Mapping[str, str] = field(default_factory=dict)
    """What the README counts, by the beginning of the file's name; `` for all others."""
    mirrored: bool = False
    dictionary: str = ""
    """Own dictionary beside the files, instead of a family."""
    board: Charuco | None = None

    def files(self, data: Path) -> list[Path]:
        """The images and videos, sorted."""
        return sorted(
            file for file in data.glob(self.pattern) if file.suffix.lower() in IMAGE_SUFFIXES | VIDEO_SUFFIXES
        )

    def readme(self, file: Path) -> str:
        """The README's count for a file."""
        named = (count for start, count in self.counts.items() if start and file.name.startswith(start))
        return next(named, self.counts.get("", "-"))


_TUTORIAL_IDS = frozenset((23, 40, 62, 98, 124, 203))
_NONE: frozenset[int] = frozenset()

SETS: tuple[RealSet, ...] = (
    RealSet(
        "apriltag_upstream/*",
        "apriltag_36h11",
        frozenset({0}),
        {"33369": "13 [AprilTag: 12]", "34085": "15 [AprilTag: 25]", "34139": "14 [AprilTag: 10]"},
    ),
    RealSet(
        "duckietown_multiple/test_image_multiple_*",
        "apriltag_36h11",
        frozenset({22, 24, 58, 85, 144, 198}),
        {"": "3 to 6"},
    ),
    RealSet("duckietown_multiple/test_image.png", "apriltag_36h11", frozenset({60, 82, 318, 328, 387}), {"": "3 to 6"}),
    RealSet(
        "tello_mirror_flight_day/video_2023-07-31_10-14-37.mp4",
        "apriltag_36h11",
        frozenset({3}),
        {"": "9 [AprilTag: 10]"},
        mirrored=True,
    ),
    RealSet("tello_mirror_flight_day/video_2023-07-31_10-14-37.mp4", "apriltag_36h11", _NONE, {"": "0"}),
    RealSet("tello_mirror_flight_day/*hflip.mp4", "apriltag_36h11", frozenset({3}), {"": "9"}),
    RealSet("tello_mirror_flight_day/stills/*", "apriltag_36h11", _NONE, {"": "0"}),
    RealSet("tello_mirror_flight_day/stills/*", "apriltag_36h11", _NONE, {"": "0"}, mirrored=True),
    RealSet("opencv_aruco_tutorials/singlemarkersoriginal.jpg", "6x6_250", _TUTORIAL_IDS, {"": "6"}),
    RealSet("opencv_aruco_tutorials/img_0*", "6x6_250", frozenset(range(17)), {"": "17"}, board=TUTORIAL_BOARD),
    RealSet("opencv_aruco_tutorials/chocclusion*", "6x6_250", frozenset(range(17)), {"": "13"}, board=TUTORIAL_BOARD),
    RealSet(
        "opencv_aruco_tutorials/gboriginal.jpg",
        "6x6_250",
        frozenset(range(35)),
        {"": "35"},
        dictionary="tutorial_dict.yml",
    ),
    RealSet("opencv_aruco_tutorials/gboriginal.jpg", "6x6_250", _NONE, {"": "0"}),
    RealSet("ubiquity_raspicam/403.jpg", "5x5_1000", frozenset({403}), {"": "1"}),
    RealSet("ubiquity_raspicam/*_*", "5x5_1000", frozenset({1}), {"": "1"}),
    RealSet("tello_front_gridboard/[0-9]*", "6x6_1000", frozenset(range(35)), {"": "30 to 35"}),
    RealSet("tello_front_gridboard/mirrored_*", "6x6_1000", _NONE, {"": "0"}),
    RealSet(
        "tello_front_gridboard/mirrored_*",
        "6x6_1000",
        frozenset(range(35)),
        {"mirrored_509": "35", "mirrored_2593": "7", "mirrored_3432": "0"},
        mirrored=True,
    ),
    RealSet("phone_6markers_video/ar.mp4", "6x6_250", _TUTORIAL_IDS, {"": "3109"}),
    RealSet("phone_6markers_video/ar.mp4", "5x5_1000", _NONE, {"": "0"}),
    RealSet("phone_6markers_video/chessboard_9x6/*", "5x5_1000", _NONE, {"": "0"}),
    RealSet("bottomcam_chessboard_*/*", "5x5_1000", _NONE, {"": "0"}),
    RealSet("bottomcam_chessboard_*/*", "apriltag_36h11", _NONE, {"": "0"}),
)
