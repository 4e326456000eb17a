import threading

import pytest

from dapl_baselines.prefetching import prefetched


def test_items_come_in_order_from_another_thread_and_errors_come_too():
    made = list(prefetched(lambda item: (item, threading.get_ident()), range(20)))
    assert [item for item, _ in made] == list(range(20))
    assert threading.get_ident() not in {thread for _, thread in made}
    with pytest.raises(ZeroDivisionError):
        list(prefetched(lambda item: 1 // (item - 3), range(20)))


def test_who_stops_early_leaves_no_thread():
    before = threading.active_count()
    items = prefetched(lambda item: item, range(1000))
    assert next(items) == 0
    items.close()
    assert threading.active_count() == before
