"""Policies that do what a policy must not, each a factory for ``--policy tests.bad_inputs.policies:...``."""

from dataclasses import dataclass

import numpy as np

from clutter6d.eval.policy import PolicyOptions, identity_hash


@dataclass(kw_only=True)
class Wrong:
    """Zeros, until its act goes wrong at the second step."""

    name: object = "wrong"
    policy_hash: str = identity_hash("wrong")
    is_privileged: bool = False
    needs_observation: bool = False
    kind: str = ""

    def begin(self, slots, episodes) -> None:
        if self.kind == "fails-to-begin":
            raise KeyError("no memory of this scene")

    def act(self, inputs):
        actions = np.zeros((len(inputs.slots), 7), dtype=np.float32)
        if not (inputs.steps >= 1).any():
            return actions
        if self.kind == "fails-to-act":
            raise ZeroDivisionError("division\nby zero")
        if self.kind == "nan":
            actions[0, 3] = np.nan
        wrong = {"six": actions[:, :6], "double": actions.astype(np.float64), "list": actions.tolist(), "none": None}
        return wrong.get(self.kind, actions)


def gives_nan(options: PolicyOptions) -> Wrong:
    return Wrong(kind="nan")


def gives_six_joints(options: PolicyOptions) -> Wrong:
    return Wrong(kind="six")


def gives_doubles(options: PolicyOptions) -> Wrong:
    return Wrong(kind="double")


def gives_a_list(options: PolicyOptions) -> Wrong:
    return Wrong(kind="list")


def gives_nothing(options: PolicyOptions) -> Wrong:
    return Wrong(kind="none")


def fails_to_act(options: PolicyOptions) -> Wrong:
    return Wrong(kind="fails-to-act")


def fails_to_begin(options: PolicyOptions) -> Wrong:
    return Wrong(kind="fails-to-begin")


def is_nameless(options: PolicyOptions) -> Wrong:
    return Wrong(name=None)


def is_three(options: PolicyOptions) -> int:
    return 3


def is_a_class(options: PolicyOptions) -> type[Wrong]:
    return Wrong


def raises(options: PolicyOptions) -> Wrong:
    raise RuntimeError("the teacher's weights\nare gone")


def takes_nothing() -> Wrong:
    return Wrong()


not_a_factory = 3
