"""Settings of the camera service."""

from typing import Annotated, Literal

from pydantic import Field

from schemas.frame import MAX_SIDE_PX
from schemas.settings.live_camera import LiveCamera
from schemas.settings.section import Section

Coefficient = Annotated[float, Field(ge=-100.0, le=100.0)]
RowTime = Annotated[float, Field(ge=-1e-3, le=1e-3)]
GreyLevel = Annotated[float, Field(ge=0.0, le=255.0)]


class Calibration(Section):
    """The camera as it is believed to be. The default is the paper's (Section 4.1)."""

    width_px: int = Field(default=640, gt=0, le=MAX_SIDE_PX)
    """Width of the pictures that these numbers belong to, pixels."""
    height_px: int = Field(default=480, gt=0, le=MAX_SIDE_PX)
    """Height of the pictures that these numbers belong to, pixels."""
    fx_px: float = Field(default=293.35, gt=0.0)
    """Focal length along image x, pixels."""
    fy_px: float = Field(default=293.31, gt=0.0)
    """Focal length along image y, pixels."""
    cx_px: float = 319.64
    """Principal point, image x, pixels; the centre of the upper left pixel is (0, 0)."""
    cy_px: float = 239.64
    """Principal point, image y, pixels."""
    distortion: tuple[Coefficient, Coefficient, Coefficient, Coefficient, Coefficient] = (
        16.44e-4,
        35.89e-4,
        6.35e-4,
        -6.35e-4,
        100.7e-4,
    )
    """k1, k2, p1, p2, k3 of OpenCV's model, dimensionless."""
    row_time_s: RowTime = 0.0
    """Rolling shutter: from the exposure of one row to that of the row below it, seconds; 0 if all rows are exposed at once, negative if
    the lowest row is first (a camera that is mounted upside down)."""
    source: str = Field(default="", max_length=500)
    """Where the numbers come from, for people."""


class Board(Section):
    """What the simulated pad looks like beyond its marker, which stands in the section `pad`."""

    margin: float = Field(default=0.15, ge=0.0, le=5.0)
    """Width of the white board beyond each edge of the marker, as a part of the marker's side."""
    black_level: GreyLevel = 28.0
    """Brightness of the ink, grey levels."""
    white_level: GreyLevel = 218.0
    """Brightness of the board, grey levels."""


class Optics(Section):
    """What the simulated lens and sensor do to the light."""

    lens_blur_px: float = Field(default=0.6, ge=0.0, le=10.0)
    """Standard deviation of the lens's blur beyond the area of a pixel, pixels. The pad is never drawn sharper than 0.35."""
    exposure_s: float = Field(default=0.004, ge=0.0, le=0.1)
    """Exposure time, seconds; what moves meanwhile is smeared."""
    row_time_s: RowTime = 0.0
    """The sensor's true row time, seconds; the one that is believed is `camera.calibration.row_time_s`."""
    noise_level: float = Field(default=3.0, ge=0.0, le=60.0)
    """Standard deviation of each pixel's noise, grey levels."""
    vignetting: float = Field(default=0.0, ge=0.0, le=1.0)
    """Darkening from 0 (none) to 1 (with the fourth power of the cosine of the ray's angle)."""


class Sunlight(Section):
    """Sun over the simulated pad: a mirror-like highlight and the edge of a shadow, both off by default."""

    azimuth_deg: float = Field(default=160.0, ge=-360.0, le=360.0)
    """Where the sun stands, degrees from north, clockwise."""
    elevation_deg: float = Field(default=60.0, ge=0.0, le=90.0)
    """Its height above the horizon, degrees."""
    glare_level: GreyLevel = 0.0
    """Brightness that the highlight adds in its middle, grey levels; 0 for none."""
    glare_width_deg: float = Field(default=8.0, gt=0.0, le=90.0)
    """Standard deviation of the highlight, degrees of the viewing direction."""
    shadow_depth: float = Field(default=0.0, ge=0.0, le=1.0)
    """How much of the light is missing in the shadow; 0 for no shadow."""
    shadow_azimuth_deg: float = Field(default=70.0, ge=-360.0, le=360.0)
    """The shadow lies on this side of its edge, degrees from north, clockwise."""
    shadow_offset_m: float = Field(default=0.0, ge=-1e3, le=1e3)
    """Where the edge crosses the line through the pad's centre in that direction, metres."""
    shadow_edge_m: float = Field(default=0.02, gt=0.0, le=10.0)
    """Width of the half-shadow, metres."""


class CameraFaults(Section):
    """What goes wrong with single pictures of a simulated camera, at random; all off by default."""

    drop_fraction: float = Field(default=0.0, ge=0.0, le=1.0)
    """Part of the frames that never leave the camera."""
    jump_fraction: float = Field(default=0.0, ge=0.0, le=1.0)
    """Part of the pictures that come shifted in their frame (torn transfer, a stabilisation that slips): gross outliers."""
    jump_px: float = Field(default=60.0, ge=1.0, le=500.0)
    """How far such a picture is shifted at most, in any direction, pixels; at least half of it."""


class Simulated(Section):
    """The source `simulated`: pictures rendered from the ground truth. Its installation errors stand in `simulator.installation`."""

    delay_s: float = Field(default=0.0, ge=0.0, le=1.0)
    """From the frame's stamp until it leaves the camera: readout and transfer, seconds."""
    ground: Literal["textured", "plain"] = "textured"
    """What the pad lies on. `plain` is one shade of grey: a drawing takes half as long, for hosts too slow to draw every frame, but it
    hides from a detector what could be mistaken for a pad."""
    board: Board = Board()
    optics: Optics = Optics()
    sunlight: Sunlight = Sunlight()
    faults: CameraFaults = CameraFaults()


class Files(Section):
    """The source `files`: images and videos, one after the other."""

    paths: tuple[str, ...] = ()
    """Files, directories and patterns with * and ?, in order; a directory is taken in the order of its names."""
    loop: bool = False
    """Begin again at the end."""
    mirrored: bool = False
    """The pictures are mirror images (a mirror in front of the lens): flip them left to right."""


class CameraSettings(Section):
    """Where frames come from, and the camera's calibration."""

    source: Literal["simulated", "files", "device", "stream"] = "simulated"
    """`simulated` renders what the ground truth says; `files` plays images or videos; `device` reads a V4L2 camera; `stream` one from
    the network."""
    rate_hz: float = Field(default=30.0, gt=0.0, le=240.0)
    """Frames a second. A simulated camera cannot be quicker than `simulator.truth_hz`."""
    calibration_file: str = ""
    """TOML file with the keys of `calibration` (or OpenCV's YAML); empty for the section below."""
    calibration: Calibration = Calibration()
    """The calibration, where no file is named."""
    simulated: Simulated = Simulated()
    files: Files = Files()
    live: LiveCamera = LiveCamera()
