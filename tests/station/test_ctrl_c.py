import os
import signal

import pytest

from station.ctrl_c import ctrl_c_noted


def test_it_is_noted_wherever_it_comes_and_given_way_to_where_one_looks():
    with ctrl_c_noted() as asked:
        asked.give_way()
        os.kill(os.getpid(), signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            asked.give_way()


def test_afterwards_it_is_what_it_was():
    before = signal.getsignal(signal.SIGINT)
    with ctrl_c_noted():
        assert signal.getsignal(signal.SIGINT) is not before
    assert signal.getsignal(signal.SIGINT) is before
