"""The number of threads, which results never depend on."""

import pytest

from mirrorbake import InvalidArgument, ThreadLimit, thread_count


def test_a_limit_holds_to_the_end_of_its_block() -> None:
    before = thread_count()
    with ThreadLimit(1) as limit:
        assert thread_count() == 1
        with ThreadLimit(0):
            assert thread_count() == 1
    assert thread_count() == before
    del limit


def test_an_error_in_the_block_ends_the_limit_too() -> None:
    before = thread_count()
    with pytest.raises(RuntimeError, match="inside"), ThreadLimit(1):
        raise RuntimeError("inside")
    assert thread_count() == before


@pytest.mark.parametrize("threads", [-1, 1025])
def test_limits_out_of_range_are_refused(threads: int) -> None:
    with pytest.raises(InvalidArgument, match=str(threads)):
        ThreadLimit(threads)
