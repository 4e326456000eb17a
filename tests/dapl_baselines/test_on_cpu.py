import platform
import resource

import pytest
import torch

from dapl_baselines.on_cpu import in_parts, is_on_cpu, keep_freed_memory


def test_parts_are_put_together_in_order():
    rows = torch.arange(22.0).reshape(11, 2)
    sizes: list[int] = []

    def double(part: torch.Tensor) -> torch.Tensor:
        sizes.append(len(part))
        return 2 * part

    assert torch.equal(in_parts(double, rows, 4), 2 * rows)
    assert sizes == [4, 4, 3]


def test_without_rows_there_is_one_part():
    assert in_parts(lambda part: part + 1, torch.zeros(0, 3), 4).shape == (0, 3)


def test_a_traced_tensor_counts_as_one_of_another_device():
    seen: list[bool] = []

    def look(tensor: torch.Tensor) -> torch.Tensor:
        seen.append(is_on_cpu(tensor))
        return tensor + 1

    look(torch.zeros(1))
    torch.export.export(type("Look", (torch.nn.Module,), {"forward": lambda _, x: look(x)})(), (torch.zeros(1),))
    assert seen[0]
    assert not any(seen[1:])
    assert len(seen) > 1


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other libraries have their own ways")
def test_memory_of_freed_tensors_is_not_given_back():
    keep_freed_memory()

    def pages_of_20_tensors() -> int:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
        for _ in range(20):
            torch.ones(2 << 20)
        return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

    pages_of_20_tensors()
    assert pages_of_20_tensors() < 2048, "one tensor has as many pages"
