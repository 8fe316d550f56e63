"""The nearest binary descriptors in many images at once, against bits that are counted one by one."""

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor

from diffnav.matching.hamming import two_nearest_hamming
from diffnav.matching.hamming_block import HammingBlock


def nearest_by_counting(query: Tensor, own: Tensor) -> list[tuple[int, int]]:
    """(which, bits that differ) per query descriptor; of equally near ones the first; 0 and all bits without any."""
    found = []
    for row in query.tolist():
        best = (0, 8 * query.shape[1])
        for k, other in enumerate(own.tolist()):
            bits = sum((p ^ q).bit_count() for p, q in zip(row, other, strict=True))
            if k == 0 or bits < best[1]:
                best = k, bits
        found.append(best)
    return found


def check(query: Tensor, images: list[Tensor]) -> None:
    which, bits = HammingBlock(images).nearest(query)
    assert which.shape == bits.shape == (len(images), len(query))
    assert (which.dtype, bits.dtype) == (torch.int64, torch.float32)
    for own, places, differing in zip(images, which.tolist(), bits.tolist(), strict=True):
        assert list(zip(places, differing, strict=True)) == nearest_by_counting(query, own)


def drawn(seed: int, count: int, width: int, values: int = 256) -> Tensor:
    dice = torch.Generator().manual_seed(seed)
    return torch.randint(values, (count, width), dtype=torch.uint8, generator=dice)


@given(
    width=st.sampled_from([1, 4, 32, 61]),
    queries=st.integers(0, 6),
    lengths=st.lists(st.integers(0, 7), min_size=1, max_size=6),
    # Of two values there are ties everywhere.
    values=st.sampled_from([2, 3, 256]),
    seed=st.integers(0, 2**20),
)
def test_the_nearest_are_those_that_counting_finds(
    width: int, queries: int, lengths: list[int], values: int, seed: int
) -> None:
    images = [drawn(seed + 1 + k, count, width, values) for k, count in enumerate(lengths)]
    check(drawn(seed, queries, width, values), images)


@pytest.mark.parametrize("processor", ["AVX512", "AVX2", "DEFAULT"])
@pytest.mark.parametrize("width", [32, 61])
def test_every_processor_finds_the_same(processor: str, width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """AKAZE's 61 bytes are more bits than bfloat16 counts to; other processors take float32 at any width."""
    monkeypatch.setattr(torch.backends.cpu, "get_cpu_capability", lambda: processor)
    query, images = drawn(0, 20, width), [drawn(k, count, width) for k, count in ((1, 30), (2, 0), (3, 7))]
    # Near ones differ in few bits and far ones in nearly all: the ends of what has to be counted.
    images[0][3], images[0][4], images[2] = query[5], query[6] ^ 1, ~query[:7]
    check(query, images)


def test_identical_and_complementary_descriptors() -> None:
    for width in (1, 32, 61):
        query = drawn(4, 5, width)
        which, bits = HammingBlock([query, ~query[2:3], query.flip(0)]).nearest(query)
        assert which[0].tolist() == [0, 1, 2, 3, 4]
        assert which[2].tolist() == [4, 3, 2, 1, 0]
        assert bits[[0, 2]].abs().max() == 0
        # The only one there is, at all bits: what fills a shorter image up must not win.
        assert (which[1, 2].item(), bits[1, 2].item()) == (0, 8 * width)


def test_of_equally_near_ones_the_first_is_taken() -> None:
    query = torch.tensor([[0b0000]], dtype=torch.uint8)
    images = [torch.tensor(rows, dtype=torch.uint8)[:, None] for rows in ([3, 1, 2, 4], [8, 8], [7, 3, 5, 6])]
    which, bits = HammingBlock(images).nearest(query)
    assert which[:, 0].tolist() == [1, 0, 1]
    assert bits[:, 0].tolist() == [1, 1, 2]


def test_equal_to_one_image_after_the_other() -> None:
    """More images than one product takes, of different lengths, with descriptors that come twice."""
    query = drawn(0, 40, 32)
    images = [drawn(k, 1 + 7 * k % 50, 32) for k in range(1, 71)]
    images = [torch.cat([own, own, query[k % 40 :][:3] ^ 1]) for k, own in enumerate(images)]
    block = HammingBlock(images)
    which, bits = block.nearest(query)
    assert len(block) == 70
    for own, places, differing in zip(images, which, bits, strict=True):
        nearest, first, _ = two_nearest_hamming(query, own)
        assert torch.equal(places, nearest)
        assert torch.equal(differing, first)


def test_nothing_to_search_or_to_search_in() -> None:
    some, none = drawn(0, 3, 32), drawn(0, 0, 32)
    check(none, [some, none])
    check(some, [none, none])
    which, bits = HammingBlock([]).nearest(some)
    assert which.shape == bits.shape == (0, 3)
