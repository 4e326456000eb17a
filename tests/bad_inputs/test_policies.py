"""Policies and checkpoints that are not there, not what they should be, or dangerous."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

pytest.importorskip("torch")

import torch

from tests.bad_inputs import checkpoints
from tests.bad_inputs.checkpoints import changed, with_tensor
from tests.bad_inputs.harness import Case, Workspace, check_refusal, fingerprint, run_command

MODULE = "tests.bad_inputs.policies"


def evaluate(work: Workspace, policy: str) -> Sequence[str]:
    return ["evaluate", "--policy", policy, "--scenes", str(work.scenes), "--out", work.out, "--max-steps", "3"]


def policy_case(name: str, policy: str, *says: str) -> Case:
    return Case(name=name, make=lambda work: evaluate(work, policy), says=says)


def checkpoint_case(name: str, make: Callable[[Path], object], *says: str) -> Case:
    def command(work: Workspace) -> Sequence[str]:
        path = work.path / "policy.pt"
        make(path)
        return evaluate(work, str(path))

    return Case(name=name, make=command, says=("policy.pt", *says))


POLICIES = [
    policy_case("unknown-policy", "plannr", "unknown policy 'plannr'", "did you mean 'planner'?"),
    policy_case("no-such-module", "no_such_package.policies:make", "unknown policy module 'no_such_package.policies'"),
    policy_case("no-such-factory", f"{MODULE}:gives_nann", "unknown factory", "did you mean 'gives_nan'?"),
    policy_case("not-a-factory", f"{MODULE}:not_a_factory", "unknown factory", "not_a_factory"),
    policy_case("not-a-module-name", "../policies.py:make", "package.module:factory"),
    policy_case("empty-name", "", "unknown policy ''"),
    policy_case("module-fails", "tests.bad_inputs.fails_on_import:make", "ValueError: no configuration"),
    policy_case(
        "module-needs-a-package", "tests.bad_inputs.needs_a_package:make", "needs the package 'package_that_nobody_has'"
    ),
    policy_case("factory-raises", f"{MODULE}:raises", "raises", "RuntimeError: the teacher's weights are gone"),
    policy_case("factory-takes-nothing", f"{MODULE}:takes_nothing", "takes_nothing", "factory", "TypeError"),
    policy_case("policy-is-a-number", f"{MODULE}:is_three", "is a int without 'name'"),
    policy_case("policy-is-a-class", f"{MODULE}:is_a_class", "is_a_class", "class"),
    policy_case("policy-without-a-name", f"{MODULE}:is_nameless", "is_nameless", "'name'", "NoneType"),
]

RUNS = [
    policy_case("actions-nan", f"{MODULE}:gives_nan", "not finite", "scene boxes-0, pair 0, step 1"),
    policy_case("actions-of-six-joints", f"{MODULE}:gives_six_joints", "float32(4, 6)", "expected float32(4, 7)"),
    policy_case("actions-as-doubles", f"{MODULE}:gives_doubles", "float64(4, 7)", "expected float32(4, 7)"),
    policy_case("actions-as-a-list", f"{MODULE}:gives_a_list", "gave list"),
    policy_case("actions-missing", f"{MODULE}:gives_nothing", "gave NoneType"),
    policy_case("policy-fails-to-act", f"{MODULE}:fails_to_act", "failed: ZeroDivisionError: division by zero"),
    policy_case("policy-fails-to-begin", f"{MODULE}:fails_to_begin", "failed: KeyError: 'no memory of this scene'"),
]

CHECKPOINTS = [
    checkpoint_case("checkpoint-missing", lambda path: None, "checkpoint not found"),
    checkpoint_case("checkpoint-is-a-folder", Path.mkdir, "checkpoint not found"),
    checkpoint_case("checkpoint-empty", Path.touch, "not a checkpoint"),
    checkpoint_case("checkpoint-is-prose", lambda path: path.write_text("weights, later"), "not a checkpoint"),
    checkpoint_case("checkpoint-truncated", checkpoints.truncated, "not a checkpoint"),
    checkpoint_case(
        "checkpoint-of-three-gigabytes", checkpoints.huge_and_hollow, "more than the 2,147,483,648 allowed"
    ),
    checkpoint_case("pickle-bomb", checkpoints.pickle_bomb, "could run code"),
    checkpoint_case("pickle-bomb-without-an-archive", checkpoints.bare_pickle_bomb, "not a checkpoint"),
    checkpoint_case("whole-module-saved", checkpoints.whole_module, "could run code"),
    checkpoint_case("checkpoint-zip-bomb", checkpoints.zip_bomb, "compressed or larger than the file"),
    checkpoint_case(
        "checkpoint-claims-gigabytes", checkpoints.zip_that_claims_a_terabyte, "compressed or larger than the file"
    ),
    checkpoint_case("checkpoint-is-a-list", lambda path: torch.save([1, 2], path), "no dictionary"),
    checkpoint_case(
        "checkpoint-of-a-state-dict-alone", lambda path: torch.save({"w": torch.ones(2)}, path), "not a valid"
    ),
    checkpoint_case("checkpoint-of-a-later-schema", changed(lambda it: it.update(schema_version=9)), "schema_version"),
    checkpoint_case("checkpoint-with-unknown-field", changed(lambda it: it.update(optimiser="adam")), "optimiser"),
    checkpoint_case("checkpoint-without-architecture", changed(lambda it: it.pop("architecture")), "architecture"),
    checkpoint_case("checkpoint-without-weights", changed(lambda it: it.pop("state_dict")), "'state_dict' is missing"),
    checkpoint_case(
        "checkpoint-of-endless-layers",
        changed(lambda it: it["config"].update(fusion_sizes=[10**9])),
        "fusion_sizes",
    ),
    checkpoint_case("tensor-of-another-shape", with_tensor("actor.0.bias", torch.zeros(9)), "actor.0.bias", "(9,)"),
    checkpoint_case("tensor-of-another-type", with_tensor("log_std", torch.zeros(7).double()), "log_std", "float64"),
    checkpoint_case("tensor-that-is-none", with_tensor("log_std", None), "log_std", "not a dense tensor"),
    checkpoint_case("tensor-that-does-not-belong", with_tensor("head", torch.zeros(1)), "head", "does not belong"),
    checkpoint_case("tensor-nan", checkpoints.nan_weights, "actor.0.bias", "not finite"),
    checkpoint_case("tensor-changed", checkpoints.one_weight_changed, "not those it was written with"),
]
UNKNOWN_ARCHITECTURE = Case(
    name="checkpoint-of-unknown-architecture",
    make=lambda work: [
        changed(lambda it: it.update(architecture="policy-netwrok"))(work.path / "policy.pt"),
        evaluate(work, str(work.path / "policy.pt")),
    ][1],
    says=("unknown checkpoint architecture 'policy-netwrok'", "did you mean 'policy-network'?"),
)


@pytest.mark.parametrize("case", [*POLICIES, *CHECKPOINTS, UNKNOWN_ARCHITECTURE], ids=lambda case: case.name)
def test_it_is_refused_before_anything_is_written_or_run(case: Case, workspace: Workspace) -> None:
    arguments = case.make(workspace)
    before = fingerprint(workspace.path)
    check_refusal(run_command(arguments), case.code, case.says)
    assert fingerprint(workspace.path) == before
    assert not (workspace.path / "exploded").exists()


@pytest.mark.parametrize("case", RUNS, ids=lambda case: case.name)
def test_a_policy_that_goes_wrong_ends_in_one_line_and_spoils_nothing(case: Case, workspace: Workspace) -> None:
    before = fingerprint(workspace.path)
    check_refusal(run_command(case.make(workspace)), case.code, case.says)
    assert before.items() <= fingerprint(workspace.path).items()


def test_a_good_checkpoint_is_accepted(workspace: Workspace) -> None:
    checkpoints.good(workspace.path / "policy.pt")
    assert run_command(evaluate(workspace, str(workspace.path / "policy.pt"))).code == 0
