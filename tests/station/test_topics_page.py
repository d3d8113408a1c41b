"""The page about the topics keeps up with the table."""

from pathlib import Path

from schemas import topics
from station.topics_page import topics_page

PAGE = Path(__file__).parents[2] / "docs" / "topics.md"


def test_the_page_in_docs_is_up_to_date():
    assert PAGE.read_text() == topics_page(), "run: python -m station.topics_page docs/topics.md"


def test_every_topic_has_a_row_and_every_reader_an_arrow():
    page = topics_page()
    for topic in topics.TOPICS:
        assert f"| `{topic.name}` |" in page
    assert "detector -->|detector/detection| geolocator" in page
    assert "simulator -.->|truth| camera" in page
