"""Ours beside other environments of a robot and objects, in one run on one machine, on as many cores.

What is counted is simulated seconds of one robot with its objects, per wall second and core, at ten actions a second.
Peers run as one process for each core, all at once (Genesis uses one core on CPUs; each of its processes is a batch),
ours as one process on all. The peers live in environments of their own, made in the cache folder on first use.

Ours is compared twice: on frozen scenes, and on as many objects as the peer has, with one convex part each as there.

    python benchmarks/peers.py [--seconds 4] [--rounds 3] [--envs 64] [--peers robosuite,genesis,panda-gym] [--record]
"""

import argparse
import os
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing
from pathlib import Path

from bars import bar
from tables import Report, add_record_option

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from contestants import OurRun, Peer, PeerRun, Rate
from generated_scenes import FirstScenes, box_scenes
from peer_environments import peer_python

from clutter6d.dataset.scenes import load_split

WANTED_FACTOR = 15.0
WANTED_PEER = "robosuite"


def known_peers(envs: int) -> dict[str, list[Peer]]:
    """All peers, by the name that ``--peers`` takes; Genesis at its default physics step, and at ours."""
    genesis = [
        Peer(
            name=f"Genesis: Panda, boxes, {envs} environments",
            program="genesis_boxes.py",
            packages=("genesis-world==1.4.5", "torch==2.13.0"),
            job={"environments": envs, "objects": 4, "physics_step_s": step_s},
        )
        for step_s in (0.01, 0.005)
    ]
    robosuite = Peer(
        name="robosuite: PickPlace, Panda",
        program="robosuite_pick_place.py",
        packages=("robosuite==1.5.2", "mujoco==3.4.0"),
    )
    panda_gym = Peer(name="panda-gym: PandaStackJoints", program="panda_gym_stack.py", packages=("panda-gym==3.0.7",))
    return {"robosuite": [robosuite], "genesis": genesis, "panda-gym": [panda_gym]}


def our_runs(envs: int) -> Iterator[OurRun]:
    """Ours on frozen scenes with and without observations, and with boxes, as many as the peers have objects."""
    sparse = FirstScenes(load_split("sparse-train"), envs)
    yield OurRun("ours: sparse, point clouds", sparse, envs, is_observed=True)
    yield OurRun("ours: sparse, simulation only", sparse, envs, is_observed=False)
    for objects in (4, 2):
        scenes = box_scenes(objects, min(envs, 16))
        yield OurRun(f"ours: {objects} boxes, point clouds", scenes, envs, is_observed=True)
    yield OurRun("ours: 4 boxes, simulation only", box_scenes(4, min(envs, 16)), envs, is_observed=False)


def start_peers(names: Sequence[str], envs: int, stack: ExitStack) -> dict[str, list[PeerRun]]:
    """The peers that run here, ready."""
    used = sorted(os.sched_getaffinity(0))
    found: dict[str, list[PeerRun]] = defaultdict(list)
    known = known_peers(envs)
    wanted = [(name, peer) for name in names for peer in known[name]]
    for name, peer in bar(wanted, "starting the peers"):
        python = peer_python(peer.packages)
        if python is None:
            continue
        try:
            found[name].append(stack.enter_context(closing(PeerRun(peer, python, used))))
        except ChildProcessError as error:
            print(error, file=sys.stderr)
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; exit code 1 if ours, on as many objects, is not fifteen times as fast as robosuite."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--envs", type=int, default=64)
    parser.add_argument("--peers", default="robosuite,genesis,panda-gym", help="comma-separated; empty for none")
    add_record_option(parser)
    options = parser.parse_args(arguments)
    names = [name for name in options.peers.split(",") if name]
    report = Report("peers")
    with ExitStack() as stack:
        ours = [stack.enter_context(closing(run)) for run in our_runs(options.envs)]
        peers = start_peers(names, options.envs, stack)
        everyone = [*ours, *(run for several in peers.values() for run in several)]
        turns = [run for _ in range(options.rounds) for run in everyone]
        rates: dict[int, list[Rate]] = {id(run): [] for run in everyone}
        for run in bar(turns, "in turns"):
            rates[id(run)].append(run.rate(options.seconds))
    used = len(os.sched_getaffinity(0))
    best = {key: max(rate.per_s for rate in found) / used for key, found in rates.items()}
    busy = {key: max(rate.per_processor_s for rate in found) for key, found in rates.items()}
    report.say(
        f"{used} cores; the best of {options.rounds} rounds of {options.seconds:g} s in turns; "
        f"ours with {options.envs} environments. Simulated seconds per wall second and core, and per processor second; "
        "how many times as fast ours is on frozen scenes, and on boxes, as many as the peer has objects."
    )
    report.head("environment", "objects", "physics step", "per s and core", "per processor s", "frozen", "alike")
    frozen, alike = best[id(ours[0])], {run.objects: best[id(run)] for run in ours if "boxes, point" in run.name}
    for run in everyone:
        rate = best[id(run)]
        factors = ("", "") if run in ours else (f"{frozen / rate:.1f}", f"{alike[run.objects] / rate:.1f}")
        speeds = (f"{rate:,.1f}", f"{busy[id(run)]:,.1f}")
        report.row(run.name, f"{run.objects}", f"{1000 * run.physics_step_s:g} ms", *speeds, *factors)
    versions = dict.fromkeys(run.version for run in everyone if run not in ours)
    report.say("", f"Versions: {'; '.join(versions)}." if versions else "No peer ran.")
    report.keep(options.record)
    wanted = [alike[run.objects] / best[id(run)] for run in peers.get(WANTED_PEER, ())]
    return 0 if all(factor >= WANTED_FACTOR for factor in wanted) else 1


if __name__ == "__main__":
    sys.exit(main())
