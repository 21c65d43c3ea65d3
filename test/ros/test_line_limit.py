"""LineLimit: bursts pass, floods are counted."""

from disc_sim_ros.ros.line_limit import LineLimit


def test_a_burst_passes_and_the_rest_is_counted():
    limit = LineLimit(burst=3, period=1.0)
    assert [limit.admit(str(k), 0.0) for k in range(5)] == ['0', '1', '2', None, None]
    assert limit.admit('5', 0.5) is None
    assert limit.admit('6', 1.0) == '6 (3 such lines left out before it)'
    assert limit.admit('7', 1.0) is None
    assert limit.admit('8', 2.5) == '8 (1 such lines left out before it)'


def test_a_pause_brings_the_whole_burst_back_and_no_more():
    limit = LineLimit(burst=2, period=1.0)
    assert [limit.admit('a', t) for t in (0.0, 0.0, 0.0)] == ['a', 'a', None]
    assert limit.admit('b', 100.0) == 'b (1 such lines left out before it)'
    assert [limit.admit('c', 100.0) for _ in range(2)] == ['c', None]


def test_one_a_period_is_never_left_out():
    limit = LineLimit(burst=1, period=1.0)
    assert all(limit.admit('x', float(k)) == 'x' for k in range(50))
