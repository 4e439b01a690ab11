"""How long a render will still take: by what its samples took of late, and how its noise has fallen so far."""

from __future__ import annotations

import pytest

from service.ipc.messages import StopRule
from service.worker.progress import EtaEstimate


def gone(
    samples: int, sample_s: float = 0.1, slow: float = 0.0, power: float | None = None, step: int = 1
) -> EtaEstimate:
    """As many samples, of which the first ten took `slow` more; noise .8 of one, falling by that power."""
    eta, elapsed_s = EtaEstimate(), 0.0
    for n in range(step, samples + 1, step):
        elapsed_s += step * sample_s + (slow if n <= 10 else 0.0)
        eta.passed(n, elapsed_s)
        if power is not None and n >= 2:
            eta.heard(n, 0.8 * n**-power)
    return eta


def test_it_is_that_of_the_first_limit() -> None:
    eta = gone(25)
    assert eta.eta_s(StopRule(100), 2.5) == pytest.approx(7.5)
    assert eta.eta_s(StopRule(100), 2.7) == pytest.approx(7.3)  # some of the next one is there
    assert eta.eta_s(StopRule(100, time_limit=5.0), 2.5) == pytest.approx(2.5)
    assert eta.eta_s(StopRule(20), 2.5) == 0
    assert eta.eta_s(StopRule(), 2.5) is None and eta.eta_s(StopRule(target_noise=0.1), 2.5) is None
    assert (
        EtaEstimate().eta_s(StopRule(100), 0.3) is None and EtaEstimate().eta_s(StopRule(time_limit=2.0), 0.5) == 1.5
    )


def test_what_was_slow_once_is_not_expected_again() -> None:
    eta = gone(100, slow=2.0)
    assert eta.eta_s(StopRule(400), 30.0) == pytest.approx(30.0)
    eta = gone(1000, sample_s=0.1)
    for n in range(1001, 2001):  # others came
        eta.passed(n, 100 + 0.3 * (n - 1000))
    assert eta.eta_s(StopRule(2500), 400.0) == pytest.approx(150, rel=0.1)  # as far back as ahead
    assert eta.eta_s(StopRule(4000), 400.0) == pytest.approx(400, rel=0.1)


@pytest.mark.parametrize("power", [0.5, 0.65, 0.8])
def test_noise_falls_as_it_has(power: float) -> None:
    """The target of 1600 samples, at 400 of them. By the root alone it is 1.9 times too long at a power of .8."""
    eta_s = gone(400, power=power).eta_s(StopRule(target_noise=0.8 * 1600**-power), 40.0)
    assert eta_s == pytest.approx(120, rel=0.2)


def test_noise_that_tells_nothing_yet() -> None:
    eta = gone(10)
    eta.heard(10, 0.2)
    assert eta.eta_s(StopRule(target_noise=0.1), 1.0) == pytest.approx(5.4)  # 36 samples as usual, so at 64
    assert eta.eta_s(StopRule(target_noise=0.5), 1.0) == pytest.approx(0.6)  # 16 there are to be
    eta.heard(16, 0.0)
    assert eta.eta_s(StopRule(target_noise=0.1), 1.5) == pytest.approx(0.1)
    rising = EtaEstimate()
    for n in (16, 32, 64):
        rising.passed(n, n / 10)
        rising.heard(n, 0.1 * n)
    assert 0 < (rising.eta_s(StopRule(target_noise=3.2), 6.4) or 0) < 6.4 * 4


def test_there_is_time_left_while_the_target_is_not_reached() -> None:
    """Though by the noise that was read last it should be, of fewer samples than there are by now."""
    eta = gone(100, power=0.5)
    for n in range(101, 131):
        eta.passed(n, n / 10)
    assert eta.eta_s(StopRule(target_noise=0.8 * 110**-0.5), 13.0) == pytest.approx(19.2 - 13)
    assert eta.eta_s(StopRule(target_noise=0.8 * 90**-0.5), 13.0) == pytest.approx(19.2 - 13)  # not judged yet


def test_it_goes_on_after_a_checkpoint() -> None:
    eta = EtaEstimate()
    eta.passed(5000, 50.0)
    assert eta.eta_s(StopRule(10000), 50.0) == pytest.approx(50)
    eta.passed(5001, 50.1)
    assert eta.eta_s(StopRule(10000), 50.1) == pytest.approx(50, rel=0.1)


def test_marks_stay_few() -> None:
    eta = EtaEstimate()
    for n in range(1, 200_000):
        eta.passed(n, n * 1e-3)
    assert len(eta._marks) < 250 and eta.eta_s(StopRule(400_000), 200.0) == pytest.approx(200, rel=0.01)
