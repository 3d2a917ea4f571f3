"""Work shared out over threads, within other such work too."""

import threading
import time

import pytest

from bench.discrepancy.numerics import threads
from bench.discrepancy.numerics.threads import THREADS, in_threads


def test_results_come_in_the_order_of_the_items_at_any_depth():
    def triangle(n):
        return sum(in_threads(lambda i: in_threads(lambda x: x + 1, [i])[0], range(n)))

    sizes = [5, 1, 0, 30, 2, 7]
    for _ in range(50):
        assert in_threads(triangle, sizes) == [n * (n + 1) // 2 for n in sizes]


def test_what_fails_is_raised_and_nothing_further_begun():
    begun = []

    def fail(i):
        begun.append(i)
        time.sleep(1e-3)
        raise ValueError(f"item {i}")

    with pytest.raises(ValueError, match="item"):
        in_threads(fail, range(100))
    assert len(begun) <= THREADS
    assert in_threads(abs, [-1, -2]) == [1, 2]  # the threads are free again


def test_a_failure_deep_within_leaves_no_work_behind():
    def deep(i):
        return in_threads(lambda k: 1 // (k - i), range(4))

    with pytest.raises(ZeroDivisionError):
        in_threads(deep, [9, 2, 9])
    assert threads._open == []


def test_who_waits_for_the_last_item_helps_within_it(monkeypatch):
    monkeypatch.setattr(threads, "THREADS", 2)  # on one core, too
    helped = set()

    def within(_):
        helped.add(threading.get_ident())
        time.sleep(2e-3)

    def item(long):
        in_threads(within, range(50 if long else 0))

    in_threads(item, [True, False])
    assert len(helped) > 1


def test_several_callers_share_the_threads():
    found = {}

    def call(name):
        found[name] = in_threads(lambda x: (time.sleep(1e-4), x * name)[1], range(50))

    callers = [threading.Thread(target=call, args=(name,)) for name in range(4)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join()
    assert found == {name: [x * name for x in range(50)] for name in range(4)}
