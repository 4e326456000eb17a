import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from dapl_baselines.serving.wire import DTYPES, WireError, pack, unpack

numbers = st.sampled_from(sorted(DTYPES)).flatmap(
    lambda name: arrays(np.dtype(name), array_shapes(min_side=0, max_dims=3, max_side=3))
)


@settings(max_examples=20)
@given(st.dictionaries(st.text(max_size=8), numbers, max_size=3))
def test_arrays_come_back_as_they_were(values):
    found = unpack(pack(values))
    assert set(found) == set(values)
    for name, array in values.items():
        assert (found[name].dtype, found[name].shape) == (array.dtype, array.shape)
        assert found[name].tobytes() == array.tobytes()


def test_an_array_is_written_as_openpi_writes_it():
    """A map with four byte-string keys, as openpi's ``msgpack_numpy`` has it."""
    raw = msgpack.unpackb(pack({"a": np.array([[1.0, 2.0]], dtype=np.float32)}))
    data = np.array([1, 2], dtype="<f4").tobytes()
    assert raw == {"a": {b"__ndarray__": True, b"dtype": "<f4", b"shape": [1, 2], b"data": data}}


def test_an_array_that_is_not_in_order_in_memory_is_written_in_order():
    array = np.arange(12, dtype=np.float32).reshape(3, 4).T
    assert np.array_equal(unpack(pack(array)), array)


def test_plain_values_come_back():
    values = {"text": "a", "number": 1.5, "list": [1, None, True], "scalar": np.float32(0.5)}
    assert unpack(pack(values)) == {**values, "scalar": 0.5}


@pytest.mark.parametrize(
    "value", [np.array([object()]), np.array(["text"]), np.array([1j]), np.array([1], dtype=">f4"), object(), {1, 2}]
)
def test_what_is_no_number_cannot_be_sent(value):
    with pytest.raises(WireError, match="cannot be sent"):
        pack({"value": value})


def array_map(**changes):
    content = {"__ndarray__": True, "dtype": "<f4", "shape": [2], "data": bytes(8)} | changes
    return msgpack.packb({"a": {key.encode(): value for key, value in content.items()}})


HOSTILE = {
    "nothing": b"",
    "garbage": b"\xc1\xff\x00",
    "cut": pack({"a": np.zeros(100)})[:-1],
    "too much": pack({}) + b"\x00",
    "an array of 4 billion elements in 5 bytes": b"\xdd\xff\xff\xff\xff",
    "4 billion bytes in 5 bytes": b"\xc6\xff\xff\xff\xff",
    "nested too deeply": b"\x91" * 100_000 + b"\x90",
    "keys that are lists": b"\x81\x90\x01",
    "objects": array_map(dtype="|O"),
    "code as a type": array_map(dtype="__import__('os')"),
    "structures": array_map(dtype=[["a", "<f4"]]),
    "text elements": array_map(dtype="<U2"),
    "another byte order": array_map(dtype=">f4"),
    "too little data": array_map(data=bytes(7)),
    "too much data": array_map(data=bytes(9)),
    "data that is text": array_map(data="12345678"),
    "a negative shape": array_map(shape=[-2]),
    "a shape of fractions": array_map(shape=[2.0]),
    "a shape that is a number": array_map(shape=2),
    "a shape that overflows": array_map(shape=[2**62, 2**62]),
    "nothing, and more than memory": array_map(shape=[0, 2**63]),
    "too many axes": array_map(shape=[1] * 7 + [2, 1]),
    "a key too many": array_map(more=1),
    "text": "hello",
}


@pytest.mark.parametrize("name", HOSTILE)
def test_what_is_no_message_is_refused_in_one_line(name):
    with pytest.raises(WireError) as caught:
        unpack(HOSTILE[name])
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400
