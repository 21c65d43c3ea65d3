"""Gaps in the numbers of several publishers: counted in full once each has sent again."""

import numpy as np
import pytest

from disc_sim_ros.ros.recorder.sequences import Sequences


@pytest.mark.parametrize('publishers', [1, 2, 5])
@pytest.mark.parametrize('loss', [0.0, 0.1, 0.9])
def test_gaps_of_publishers_that_send_again_are_counted_in_full(publishers, loss):
    rng = np.random.default_rng([publishers, round(10 * loss)])
    for _ in range(50):
        sequences = Sequences()
        following = 2 * rng.permutation(500)[:publishers] + 1
        gaps = sum(sequences.gap(int(n), publishers) for n in following)
        following += 1
        missing = 0
        for _ in range(300):
            i = rng.integers(publishers)
            lost = int(rng.geometric(0.05)) if rng.random() < loss else 0
            missing += lost
            gaps += sequences.gap(int(following[i]) + lost, publishers)
            following[i] += lost + 1
            assert gaps <= missing
        for _ in range(publishers):  # those whose numbers others took show the rest of the gap
            gaps += sum(sequences.gap(int(n), publishers) for n in following)
            following += 1
        assert gaps == missing


def test_a_publisher_that_is_not_heard_hides_a_gap_but_makes_none():
    """One stays silent at 100; the other, at 50, misses 60 to 119."""
    sequences = Sequences()
    assert [sequences.gap(n, 2) for n in (50, 99)] == [0, 0]
    assert [sequences.gap(n, 2) for n in range(51, 60)] == [0] * 9
    assert sequences.gap(120, 2) == 20  # of at least 20, as far as anyone can tell
    assert sequences.gap(100, 2) == 40  # now it is known


def test_no_loss_is_no_gap_even_where_first_messages_look_like_the_next_of_another():
    rng = np.random.default_rng(1)
    for _ in range(500):
        sequences = Sequences()
        following = rng.integers(1, 5, 3)
        for _ in range(30):
            i = rng.integers(3)
            assert sequences.gap(int(following[i]), 3) == 0
            following[i] += 1


def test_first_messages_tell_of_no_gap():
    sequences = Sequences()
    assert sequences.gap(7, 2) == 0
    assert sequences.gap(70, 2) == 0
    sequences.forget()
    assert sequences.gap(8000, 1) == 0
