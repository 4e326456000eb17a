import subprocess
import sys

import pytest

MAKE = "env = gymnasium.make('Clutter6D-Sparse-v1', split='sparse-test'); print(env.spec.id)"


@pytest.mark.parametrize(
    "imports",
    ["import clutter6d, gymnasium", "import gymnasium, clutter6d", "import gymnasium.vector; import clutter6d"],
)
def test_the_ids_are_known_in_whatever_order_the_packages_are_imported(imports):
    done = subprocess.run([sys.executable, "-W", "error", "-c", f"{imports}; {MAKE}"], capture_output=True, text=True)
    assert done.stdout == "Clutter6D-Sparse-v1\n", done.stderr


def test_importing_the_package_alone_loads_neither_gymnasium_nor_numpy():
    script = "import clutter6d, sys; sys.exit(bool({'gymnasium', 'numpy'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", script]).returncode == 0
