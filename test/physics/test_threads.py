"""Work side by side: results in order, errors reach the caller, and Ctrl-C blocks nothing."""

from contextlib import closing
import gc
import subprocess
import sys
import threading
import time
import weakref

import pytest

from disc_sim_ros.threads import Threads

# With `concurrent.futures.ThreadPoolExecutor` in place of `Threads`, ten runs of ten blocked or
# ended with "release unlocked lock" within 200 of these rounds.
INTERRUPTED = """
import random, signal
from disc_sim_ros.threads import Threads

signal.signal(signal.SIGALRM, signal.default_int_handler)
rng = random.Random(1)
interrupted = 0
for _ in range(1000):
    threads = Threads(2)
    try:
        signal.setitimer(signal.ITIMER_REAL, rng.uniform(1e-5, 1e-3))
        while True:
            threads.run([int] * 20)
    except KeyboardInterrupt:
        interrupted += 1
    assert threads.run([int] * 3) == [0] * 3
    threads.close()
print(interrupted)
"""


def test_ctrl_c_at_any_moment_leaves_the_threads_sound():
    done = subprocess.run(
        [sys.executable, '-c', INTERRUPTED],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.stdout, done.stderr) == ('1000\n', '')


@pytest.mark.parametrize('count', [1, 3])
def test_results_come_in_the_order_of_the_work(count):
    def late(i):
        time.sleep(0.002 * (i % 3))
        return i

    with closing(Threads(count)) as threads:
        assert threads.run((lambda i=i: late(i)) for i in range(20)) == list(range(20))
        assert threads.run([]) == []


@pytest.mark.parametrize('count', [1, 2])
def test_an_error_reaches_the_caller_after_the_end_of_what_runs(count):
    starts, ends = [], []

    def work(i):
        starts.append(i)
        if i == 1:
            raise ValueError('one')
        time.sleep(0.02)
        ends.append(i)

    with closing(Threads(count)) as threads:
        with pytest.raises(ValueError, match='one'):
            threads.run((lambda i=i: work(i)) for i in range(1000))
        assert len(starts) == len(ends) + 1 < 1000
        assert threads.run([int]) == [0]  # they work on


def test_threads_end_with_their_object():
    before = set(threading.enumerate())  # of other tests, some of which may end meanwhile
    threads = Threads(4)
    new = set(threading.enumerate()) - before
    assert len(new) == 4
    reference = weakref.ref(threads)
    del threads
    gc.collect()
    assert reference() is None
    for thread in new:
        thread.join(10.0)
        assert not thread.is_alive()


def test_no_more_threads_than_are_of_use():
    for wanted, most, count in ((4, 2, 2), (2, None, 2), (4, 0, 1)):
        with closing(Threads(wanted, most)) as threads:
            assert threads.count == count


def test_what_takes_long_is_left_to_itself_after_an_error():
    go_on = threading.Event()

    def fail():
        raise ValueError('none')

    with closing(Threads(2)) as threads, pytest.raises(ValueError, match='none'):
        threads.run([go_on.wait, fail], leave=True)
    go_on.set()
