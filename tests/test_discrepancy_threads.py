"""Work shared out over threads, within other such work too; what threads keep, and what they evaluate."""

import threading
import time

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from bench.discrepancy.numerics import threads
from bench.discrepancy.numerics.made_once import MadeOnce
from bench.discrepancy.numerics.threads import THREADS, in_threads
from bench.discrepancy.numerics.uniform_spline import uniform_spline
from bench.errors import ParameterError


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


def test_what_is_kept_is_made_once_whoever_asks_and_waits_for_no_other():
    kept, made, slow, other = MadeOnce[int](2), [], threading.Event(), threading.Event()

    def make() -> int:
        made.append(threading.get_ident())
        slow.wait(timeout=60)
        return 9

    found: list[int] = []
    asking = [threading.Thread(target=lambda: found.append(kept.get("slow", make))) for _ in range(3)]
    for thread in asking:
        thread.start()
    # one that is not being made is had meanwhile
    free = threading.Thread(target=lambda: (kept.get("quick", lambda: 1), other.set()))
    free.start()
    assert other.wait(timeout=60)
    slow.set()
    for thread in asking:
        thread.join()
    assert found == [9, 9, 9]
    assert len(made) == 1


def test_who_asks_for_several_makes_those_that_nobody_else_is_making():
    kept, begun, free = MadeOnce[int](4), threading.Event(), threading.Event()
    made: list[tuple[str, int]] = []

    def slowly(k: int) -> int:
        made.append(("slowly", k))
        begun.set()
        free.wait(timeout=60)
        return k

    def at_once(k: int) -> int:
        made.append(("at once", k))
        free.set()
        return k

    found: list[list[int]] = []
    slow = threading.Thread(target=lambda: found.append(kept.get_each("ab", slowly)))
    slow.start()
    assert begun.wait(timeout=60)
    assert kept.get_each("ab", at_once) == [0, 1]
    slow.join()
    assert found == [[0, 1]]
    assert made == [("slowly", 0), ("at once", 1)]


def test_of_what_is_kept_the_last_few_stay():
    kept = MadeOnce[int](2)
    assert [kept.get(key, lambda key=key: key) for key in (1, 2, 1, 3)] == [1, 2, 1, 3]
    assert kept.get(1, lambda: -1) == 1
    assert kept.get(2, lambda: -1) == -1


@pytest.mark.parametrize("n", [4, 5, 300])
def test_a_spline_of_equal_steps_is_that_of_scipy(n):
    samples, step = np.random.default_rng(n).normal(size=(n, 3)), 0.02
    at = np.linspace(-step, n * step, 57)
    exact = CubicSpline(step * np.arange(n), samples, axis=0)(at)
    np.testing.assert_allclose(uniform_spline(samples, step, at), exact.T, atol=1e-11 * np.abs(exact).max())
    np.testing.assert_allclose(
        uniform_spline(samples[:, 0], step, at), exact[:, 0], atol=1e-11 * np.abs(exact).max()
    )


def test_a_spline_through_three_samples_is_refused():
    with pytest.raises(ParameterError, match="4 at least"):
        uniform_spline(np.zeros(3), 1.0, np.zeros(1))
