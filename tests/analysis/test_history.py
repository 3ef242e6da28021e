from hypothesis import given
from hypothesis import strategies as st

from chaincor.analysis.history import Thinned


@given(st.integers(0, 500), st.integers(2, 20))
def test_thinned_is_an_even_choice_that_reaches_the_end(count, limit):
    thinned = Thinned(limit)
    items = [object() for _ in range(count)]
    for item in items:
        thinned.feed(item)
    kept = [items.index(item) for item in thinned.items()]
    assert len(kept) <= limit + 1
    expected = list(range(0, count, thinned.stride))
    if count and expected[-1] != count - 1:
        expected.append(count - 1)
    assert kept == expected
    # The stride is no larger than needed: with half the stride, the history would exceed the limit.
    assert thinned.stride == 1 or count > limit * thinned.stride // 2
