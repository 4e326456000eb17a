"""The speed measurements run, in the smallest setting, and say what they are meant to say; nothing is timed here."""

import subprocess
import sys
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"


def run(script: str, *options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(BENCHMARKS / f"{script}.py"), *options]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def rows(done: subprocess.CompletedProcess[str]) -> dict[str, list[str]]:
    """The cells of all table rows, by the first one."""
    lines = [line.strip("| ").split("|") for line in done.stdout.splitlines() if line.startswith("|")]
    return {first.strip(): [cell.strip() for cell in cells] for first, *cells in lines}


def test_the_environment_follows_the_bare_engine(tmp_path: Path) -> None:
    done = run("step_speed", "--envs", "2", "--steps", "2", "--rounds", "1", "--tracks", "sparse", "--record", tmp_path)
    assert done.returncode in (0, 1), done.stderr
    assert float(rows(done)["sparse"][2]) > 0
    assert "MuJoCo" in done.stdout.splitlines()[0]
    assert (tmp_path / "step_speed.md").read_text().strip() in done.stdout


def test_a_free_setting_changes_no_bit() -> None:
    done = run("physics_profile", "--tasks", "2", "--rounds", "1", "--only", "persistent")
    assert done.returncode == 0, done.stderr
    cells = rows(done)["memory: a persistent batch"]
    assert cells[3:5] == ["100%", "100%"]
    assert float(cells[-1]) > 30, "the scripted push moves the target"


@pytest.mark.slow
def test_settings_that_matter_change_outcomes() -> None:
    done = run("physics_profile", "--tasks", "3", "--rounds", "1", "--only", "condim 1")
    assert rows(done)["contacts: condim 1 (no friction)"][4] == "0%"


@pytest.mark.slow
def test_objects_can_be_given_fewer_parts() -> None:
    done = run("physics_profile", "--tasks", "2", "--rounds", "1", "--only", "at most 1 ")
    assert done.returncode == 0, done.stderr
    assert float(rows(done)["parts: at most 1 an object"][0]) > 0


@pytest.mark.slow
def test_costs_are_told_by_objects_and_by_environments() -> None:
    done = run("scaling", "--objects", "16", "--scenes", "1", "--envs", "2", "--seconds", "0")
    assert done.returncode == 0, done.stderr
    assert {"16", "2"} <= rows(done).keys()


@pytest.mark.slow
def test_ours_is_measured_without_any_peer() -> None:
    done = run("peers", "--peers", "", "--envs", "2", "--rounds", "1", "--seconds", "0.1")
    assert done.returncode == 0, done.stderr
    assert float(rows(done)["ours: 2 boxes, point clouds"][2]) > 0


def test_a_peer_that_does_not_run_here_is_left_out_with_its_reason(tmp_path: Path) -> None:
    sys.path.insert(0, str(BENCHMARKS))
    try:
        from contestants import Peer, PeerRun

        peer = Peer(name="nobody", program="no_such_program.py", packages=())
        with pytest.raises(ChildProcessError, match=r"nobody does not run here: .*no_such_program"):
            PeerRun(peer, Path(sys.executable), [0])
    finally:
        sys.path.remove(str(BENCHMARKS))


@pytest.mark.slow
def test_the_encoder_is_measured_beside_its_matrix_products() -> None:
    done = run("encoder_throughput", "--batches", "2", "--rounds", "1", "--threads", "1")
    assert done.returncode == 0, done.stderr
    for name in ("2, float32", "2, bfloat16"):
        rate, products, whole, ratio, share = rows(done)[name]
        assert float(rate) == pytest.approx(2000 / float(whole), rel=0.05)
        assert float(ratio) == pytest.approx(float(whole) / float(products), rel=0.05)
        assert 0 < float(share.rstrip("%")) < 100
