"""Policies with known behaviour, and a scene set whose outcomes are known."""

from dataclasses import replace

import numpy as np

from clutter6d.eval.policy import PolicyOptions, identity_hash
from tests.scene_fixtures import BoxSceneSet, make_box_scene_set


class ScriptedPolicy:
    """Uses everything a policy may use: observation, states, memory of its slot."""

    name = "scripted"
    policy_hash = identity_hash("scripted")
    is_privileged = True
    needs_observation = True

    def __init__(self) -> None:
        self.memory: dict[int, int] = {}

    def begin(self, slots, episodes) -> None:
        self.memory |= dict.fromkeys(slots.tolist(), 0)

    def act(self, inputs) -> np.ndarray:
        for slot, step in zip(inputs.slots.tolist(), inputs.steps.tolist(), strict=True):
            assert self.memory[slot] == step
            self.memory[slot] += 1
        away = inputs.observation["object_points"][:, :, :3].mean(axis=1) - inputs.observation["hand_state"][:, :3]
        turn = 0.1 * np.sign(away[:, 1:2]) * np.ones((1, 7))
        return (turn * np.cos(inputs.states[:, 1:8])).astype(np.float32)


def make_scripted(options: PolicyOptions) -> ScriptedPolicy:
    return ScriptedPolicy()


def fails_to_start(options: PolicyOptions):
    raise TypeError("needs a teacher")


def not_a_policy(options: PolicyOptions) -> int:
    return 3


def scenes_with_known_outcomes() -> BoxSceneSet:
    """Pair 0's goal is where the target is; in pair 1 an obstacle starts beside the table."""
    made = make_box_scene_set(3)
    return replace(made, scenes=tuple(_with_known_outcomes(scene) for scene in made.scenes))


def _with_known_outcomes(scene):
    first, second = scene.goal_pairs
    falling = second.object_poses.copy()
    falling[3, :3] = (0.7, 0.0, 0.1)
    return replace(scene, goal_pairs=(replace(first, goal=first.initial), replace(second, object_poses=falling)))
