"""Arrays that lie in shared memory already: sent by reference, given back with the last who holds them."""

from __future__ import annotations

import gc
import os
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from service.ipc import channel
from service.system import shared_memory
from service.system.shared_memory import LEAST, SharedArena, locate


def descriptors() -> int:
    gc.collect()
    return len(os.listdir("/proc/self/fd"))


def shelved() -> tuple[np.ndarray, np.ndarray]:
    large, small = np.arange(LEAST, dtype=np.uint8), np.arange(12.0).reshape(4, 3)
    shelf = SharedArena(large.nbytes, small.nbytes)
    return shelf.put(large), shelf.put(small, np.array([3, 0]))


def test_a_shelf_holds_what_is_put_there() -> None:
    large, small = shelved()
    assert np.array_equal(large, np.arange(LEAST, dtype=np.uint8))
    assert small.tolist() == [[9, 10, 11], [0, 1, 2]]
    found = locate(memoryview(small).cast("B"))
    assert found is not None and found[1] == LEAST
    assert locate(memoryview(np.zeros(9)).cast("B")) is None


def test_few_bytes_need_no_descriptor() -> None:
    before, array = descriptors(), np.arange(9)
    assert SharedArena(array.nbytes).put(array) is array
    assert descriptors() == before


def test_shelved_arrays_are_sent_without_a_copy() -> None:
    before = descriptors()
    large, small = shelved()
    other = np.arange(5)
    ours, theirs = channel.pair()
    with ours, theirs:
        encoded = channel.encode([large, other, small, other[:0]])
        assert sorted(os.fstat(each).st_size for each in encoded[1]) == [other.nbytes, LEAST + 128]
        channel.discard(channel.another(encoded))
        channel.discard(encoded)
        channel.send(ours, [large, other, small, other[:0]])
        received = channel.receive(theirs, wait=True)
    assert [a.tolist() for a in received[1:]] == [other.tolist(), small.tolist(), []]
    large[7] = 99  # seen on the other side: it is the same memory
    assert received[0][7] == 99 and not received[0].flags.writeable
    del large, small
    gc.collect()
    assert received[0][8] == 8
    del received
    assert descriptors() == before


def test_more_blocks_than_a_message_takes() -> None:
    before = descriptors()
    arrays = [shelved()[0] for _ in range(2 * channel.MOST)]
    ours, theirs = channel.pair()
    with ours, theirs:
        channel.send(ours, arrays)
        received = channel.receive(theirs, wait=True)
    assert all(np.array_equal(a, b) for a, b in zip(arrays, received, strict=True))
    del arrays, received
    assert descriptors() == before


def test_nothing_is_left_of_a_block() -> None:
    known = len(shared_memory._blocks)
    kept = shelved()
    assert len(shared_memory._blocks) == known + 1
    del kept
    gc.collect()
    assert len(shared_memory._blocks) == known


def test_blocks_may_come_and_go_while_others_look_for_theirs() -> None:
    """A thread that failed to look would leave its stream without another word."""
    kept = [shared_memory.block(LEAST) for _ in range(50)]
    usual = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(1) as other:
            coming = other.submit(lambda: [shared_memory.block(LEAST) and None for _ in range(2000)])
            looks = 0
            while not coming.done():
                assert locate(memoryview(kept[looks % len(kept)])) == (kept[looks % len(kept)], 0)
                looks += 1
            coming.result()
    finally:
        sys.setswitchinterval(usual)
    assert looks > 10
