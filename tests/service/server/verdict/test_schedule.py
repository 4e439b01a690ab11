"""Which samples are taken for a verdict."""

from __future__ import annotations

from itertools import islice

import pytest

from service.server.verdict.comparison import of_one_document, of_two_documents, seeds_from


@pytest.mark.parametrize("samples", [1, 3, 8, 16, 100, 256, 5000])
def test_two_documents_take_up_to_their_samples_in_equal_groups(samples: int) -> None:
    groups = of_two_documents(samples, 7).groups
    assert 0.75 * samples < sum(group.samples for group in groups) <= samples
    assert len({group.samples for group in groups}) == 1 and len(groups) <= 16
    assert groups[0].seed == 7 and groups[0].look and groups[-1].look
    assert len({group.seed for group in groups}) == len(groups)


@pytest.mark.parametrize(("samples", "known", "looks"), [(64, 64, 1), (16, 64, 1), (256, 64, 3), (100, 64, 2)])
def test_one_document_begins_as_the_picture_was_made(samples: int, known: int, looks: int) -> None:
    schedule = of_one_document(samples, known, 3)
    assert (schedule.groups[0].seed, schedule.groups[0].samples) == (3, min(known, samples))
    assert sum(group.samples for group in schedule.groups) == samples
    assert schedule.looks == looks == len(schedule.groups)


def test_seeds_repeat_and_differ() -> None:
    first = list(islice(seeds_from(1), 1000))
    assert first == list(islice(seeds_from(1), 1000)) and len(set(first)) == 1000
    assert all(0 <= seed < 2**32 for seed in first) and len(set(first) & set(islice(seeds_from(2), 1000))) == 0
