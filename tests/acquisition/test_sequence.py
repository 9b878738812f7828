"""Counts of lost, duplicated and late records against counting over the complete list."""

from hypothesis import given
from hypothesis import strategies as st

from needleforce.acquisition.sources.reading_checks import LATE_WINDOW, Kind, SequenceCheck, Unwrapped

MS = 1_000_000


def fed(numbers, step=MS):
    check = SequenceCheck()
    kinds = [check.add(number, 10**18 + k * step) for k, number in enumerate(numbers)]
    check.close()
    return check, kinds


@st.composite
def streams(draw):
    """Numbers with losses, duplicates and exchanged places, all within the window for late records."""
    first = draw(st.integers(0, 2**33))
    steps = draw(st.lists(st.sampled_from([1, 1, 1, 1, 2, 5, 25]), min_size=1, max_size=150))
    numbers = [first + sum(steps[:k]) for k in range(len(steps))]
    duplicated = draw(st.lists(st.sampled_from(numbers), max_size=10))
    return draw(st.permutations(numbers + duplicated)) if len(steps) < 12 else shuffled(draw, numbers + duplicated)


def shuffled(draw, numbers):
    for _ in range(draw(st.integers(0, 20))):
        a, b = draw(st.integers(0, len(numbers) - 1)), draw(st.integers(0, len(numbers) - 1))
        numbers[a], numbers[b] = numbers[b], numbers[a]
    return numbers


@given(streams())
def test_every_record_is_counted(numbers):
    check, kinds = fed(numbers)
    unique = set(numbers)
    assert check.received == len(unique)
    assert check.duplicated == len(numbers) - len(unique)
    assert check.lost == max(unique) - min(unique) + 1 - len(unique)
    for k, (number, kind) in enumerate(zip(numbers, kinds)):
        before = numbers[:k]
        expected = Kind.DUPLICATED if number in before else Kind.LATE if before and number < max(before) else Kind.NEW
        assert kind is expected


@given(streams(), st.integers(1, 400))
def test_seconds_add_up_to_the_total(numbers, step_ms):
    check, _ = fed(numbers, step_ms * MS)
    for name in ("received", "lost", "duplicated", "late"):
        assert sum(getattr(second, name) for second in check.seconds) == getattr(check.total, name)
    numbers_of_seconds = [second.second for second in check.seconds]
    assert numbers_of_seconds == sorted(set(numbers_of_seconds))
    assert numbers_of_seconds[0] == 0


def test_a_loss_is_counted_in_its_second():
    check, _ = fed([k for k in range(3000) if k not in (1500, 1501)])
    assert [(s.second, s.lost) for s in check.seconds] == [(0, 0), (1, 2), (2, 0)]


@given(streams())
def test_unwrapping_restores_the_numbers(numbers):
    unwrapped = Unwrapped(1000.0)
    found = [unwrapped.next(number % 2**32, k * MS)[0] for k, number in enumerate(numbers)]
    assert [number - found[0] for number in found] == [number - numbers[0] for number in numbers]
    assert unwrapped.restart == 0


def test_numbers_after_a_restart_follow_the_host_clock():
    unwrapped = Unwrapped(1000.0)
    before = [unwrapped.next(2**32 - 2 + k & 0xFFFFFFFF, k * MS)[0] for k in range(100_000)]
    assert before == [2**32 - 2 + k for k in range(100_000)]
    assert unwrapped.next(1, (99_999 + 2000) * MS)[0] == before[-1] + 2000
    assert unwrapped.next(2, (99_999 + 2001) * MS)[0] == before[-1] + 2001
    assert unwrapped.restart == 1


def test_a_record_older_than_the_window_counts_as_duplicated():
    check, kinds = fed([0, 2, LATE_WINDOW + 1, 1, 3])
    assert kinds == [Kind.NEW, Kind.NEW, Kind.NEW, Kind.DUPLICATED, Kind.LATE]
    assert (check.received, check.lost) == (4, LATE_WINDOW + 2 - 4)
