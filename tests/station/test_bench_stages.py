from station.bench.stages import stages_row


def test_every_frame_of_a_hover_is_drawn_looked_at_and_located() -> None:
    assert stages_row(10.0, frames=5)[-1] == "5/5"
