import pytest

from alight.markers.family import FamilyError, dictionary, dictionary_from_file, families, marker_cells


def test_families_are_spelled_as_in_the_settings() -> None:
    assert {"5x5_1000", "6x6_250", "apriltag_36h11", "aruco_original"} <= set(families())


def test_a_family_is_found_in_any_case() -> None:
    assert dictionary("AprilTag_36h11").markerSize == 6


def test_the_papers_marker_has_a_black_border_of_one_cell_around_five_by_five() -> None:
    cells = marker_cells("5x5_1000", 68)
    assert cells.shape == (7, 7)
    border = cells.copy()
    border[1:-1, 1:-1] = 0
    assert border.sum() == 0
    assert 0 < cells.sum() < 25


@pytest.mark.parametrize(
    ("family", "number", "says"),
    [
        ("aprltag_36h11", 68, "did you mean apriltag_36h11"),
        ("5x5_1000", 1000, "0 to 999"),
        ("5x5_1000", -1, "0 to 999"),
    ],
)
def test_what_does_not_exist_is_refused_with_a_remedy(family: str, number: int, says: str) -> None:
    with pytest.raises(FamilyError, match=says):
        marker_cells(family, number)


def test_a_dictionary_of_ones_own_is_read_from_opencvs_yaml(tmp_path) -> None:
    path = tmp_path / "own.yml"
    path.write_text('%YAML:1.0\nnmarkers: 1\nmarkersize: 4\nmarker_0: "1010010111000011"\n')
    assert dictionary_from_file(path).markerSize == 4


def test_a_file_without_a_dictionary_is_refused(tmp_path) -> None:
    path = tmp_path / "other.yml"
    path.write_text("%YAML:1.0\nnothing: 1\n")
    with pytest.raises(FamilyError, match="holds no dictionary"):
        dictionary_from_file(path)
    with pytest.raises(FamilyError, match="cannot be read"):
        dictionary_from_file(tmp_path / "missing.yml")
