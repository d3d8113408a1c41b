from station.bench.bare_hop import bare_hop


def test_every_message_is_timed_on_its_way() -> None:
    hop = bare_hop(messages=5)
    assert 0.0 < hop.p50_ms <= hop.p99_ms
