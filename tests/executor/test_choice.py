"""What stands behind --executor."""

import pytest

from clutter6d.errors import InvalidValueError, MissingDependencyError, UnknownNameError
from clutter6d.executor import LOCAL, Executor, choice, parse_executor


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("local", LOCAL),
        ("ray", Executor(kind="ray")),
        ("ray:auto", Executor(kind="ray", address="auto")),
        ("ray:127.0.0.1:6379", Executor(kind="ray", address="127.0.0.1:6379")),
        ("ray:head.cluster.org:6379", Executor(kind="ray", address="head.cluster.org:6379")),
        ("ray:[::1]:6379", Executor(kind="ray", address="[::1]:6379")),
        ("ray:ray://head:10001", Executor(kind="ray", address="ray://head:10001")),
    ],
)
def test_an_executor_is_read(text: str, meant: Executor) -> None:
    assert parse_executor(text) == meant


@pytest.mark.parametrize("text", ["", "rey", "Ray", "dask:head:1", " local"])
def test_an_unknown_executor_is_refused(text: str) -> None:
    with pytest.raises(UnknownNameError, match="unknown executor"):
        parse_executor(text)


@pytest.mark.parametrize("text", ["ray:", "ray:head", "ray:head:port", "ray:http://head:6379", "local:4"])
def test_a_wrong_address_is_refused(text: str) -> None:
    with pytest.raises(InvalidValueError, match=f"executor '{text}'"):
        parse_executor(text)


def test_a_missing_ray_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(choice, "find_spec", lambda name: None)
    with pytest.raises(MissingDependencyError, match=r'pip install "clutter6d\[ray\]"'):
        parse_executor("ray")
