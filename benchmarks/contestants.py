"""What is compared: ours in this process, a peer in processes of its own; all step for a while when told to."""

import json
import subprocess
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from environment_runs import EnvironmentRun
from peer_environments import PROGRAMS

from clutter6d.dataset.scenes import SceneCollection
from clutter6d.physics import CONTROL_STEP_S, PHYSICS_STEP_S

STEPS = 16


@dataclass(frozen=True, kw_only=True, slots=True)
class Rate:
    """Simulated seconds per wall second, of all cores together, and per processor second, of one core."""

    per_s: float
    per_processor_s: float


class Contestant(Protocol):
    """Something that steps for a while when told to.

    Attributes:
        name: In the table.
        version: Of the peer and its engine.
        objects: Objects of each scene.
        physics_step_s: Of its simulation.
    """

    name: str
    version: str
    objects: int
    physics_step_s: float

    def rate(self, seconds: float) -> Rate:
        """Step for so many seconds."""
        ...


@dataclass(frozen=True, kw_only=True, slots=True)
class Peer:
    """Another environment.

    Attributes:
        name: In the table.
        program: File that runs it.
        packages: What it needs, its own package first.
        job: What else its program is told.
    """

    name: str
    program: str
    packages: tuple[str, ...]
    job: Mapping[str, Any] = field(default_factory=dict)


class PeerRun:
    """A peer's processes, which stay ready between the rounds; close them at the end.

    Args:
        peer: Which one.
        python: The interpreter that has it.
        used: Cores, with one process on each.

    Raises:
        ChildProcessError: It does not run here; says its last line.
    """

    def __init__(self, peer: Peer, python: Path, used: Sequence[int]) -> None:
        self.name = peer.name
        self._complaints = tempfile.TemporaryFile("w+")  # noqa: SIM115 - as long as the processes
        self._processes: list[subprocess.Popen[str]] = []
        for number, core in enumerate(used):
            job = json.dumps(dict(peer.job) | {"cores": [core], "seed": number})
            command = [str(python), str(PROGRAMS / peer.program), job]
            self._processes.append(
                subprocess.Popen(
                    command, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._complaints
                )
            )
        about = list(map(self._answer, self._processes))
        self.version, self.objects = about[0]["version"], about[0]["objects"]
        self.physics_step_s = about[0]["physics_step_s"]

    def _answer(self, process: subprocess.Popen[str]) -> Any:
        line = process.stdout.readline() if process.stdout else ""
        if line:
            return json.loads(line)
        self._complaints.seek(0)
        said = self._complaints.read().strip().splitlines() or ["nothing"]
        self.close()
        raise ChildProcessError(f"{self.name} does not run here: {said[-1]}")

    def rate(self, seconds: float) -> Rate:
        """As :meth:`Contestant.rate`."""
        for process in self._processes:
            print(seconds, file=process.stdin, flush=True)
        spent = [self._answer(process) for process in self._processes]
        return Rate(
            per_s=sum(simulated / wall for simulated, wall, _ in spent),
            per_processor_s=sum(simulated for simulated, _, _ in spent) / sum(used for _, _, used in spent),
        )

    def close(self) -> None:
        """End the processes."""
        for process in self._processes:
            process.kill()
            process.communicate()
        self._complaints.close()


class OurRun:
    """Our vector environment, or its simulation alone.

    Args:
        name: In the table.
        scenes: What it simulates.
        envs: Environments.
        is_observed: Whether observations, rewards and outcomes are computed.
    """

    def __init__(self, name: str, scenes: SceneCollection, envs: int, *, is_observed: bool) -> None:
        self.name, self.objects = name, len(scenes.scenes[0].objects)
        self.version, self.physics_step_s = "ours", PHYSICS_STEP_S
        self._run = EnvironmentRun(scenes, envs, STEPS, 0)
        self._run.reset()
        self._simulated_s = envs * CONTROL_STEP_S
        self._step: Callable[[np.ndarray], object] = self._run.env.step if is_observed else self._run.step_unobserved
        self._step(self._run.actions[0])

    def rate(self, seconds: float) -> Rate:
        """As :meth:`Contestant.rate`; each time from the beginning of the episodes."""
        self._run.reset()
        steps, start, used = 0, time.perf_counter(), time.process_time()
        while time.perf_counter() - start < seconds:
            self._step(self._run.actions[steps % STEPS])
            steps += 1
        simulated = steps * self._simulated_s
        return Rate(
            per_s=simulated / (time.perf_counter() - start),
            per_processor_s=simulated / (time.process_time() - used),
        )

    def close(self) -> None:
        """Free the environment."""
        self._run.env.close()
