import sys

import numpy as np
import pytest

from clutter6d.errors import InvalidValueError, MissingDependencyError, MissingFileError, UnknownNameError, UserError
from clutter6d.eval.policy import Episode, PolicyInput, PolicyOptions, is_planner
from clutter6d.eval.policy_loading import load_policy
from tests.scene_fixtures import make_box_scene


def ask(policy, *, seed=0, pairs=(0, 1), steps=(0, 0), slots=None):
    scene, model = make_box_scene()
    episodes = tuple(Episode(scene=scene, pair_index=pair, scene_model=model, seed=seed) for pair in pairs)
    indices = np.array(slots if slots is not None else range(len(pairs)))
    policy.begin(indices, episodes)
    return policy.act(
        PolicyInput(slots=indices, episodes=episodes, steps=np.array(steps), observation=None, states=None)
    )


def test_zero_does_nothing():
    assert not ask(load_policy("zero")).any()


def test_random_draws_depend_on_seed_scene_pair_and_step_alone():
    policy = load_policy("random")
    first = ask(policy)
    assert first.dtype == np.float32
    assert np.abs(first).max() <= 0.1
    assert np.array_equal(ask(policy, pairs=(1, 0), slots=(7, 3)), first[::-1])
    assert not np.array_equal(ask(policy, seed=1), first)
    assert not np.array_equal(ask(policy, steps=(1, 0))[0], first[0])


def test_a_factory_is_found_by_module_and_name():
    assert load_policy("tests.eval.scripted:make_scripted", PolicyOptions(seed=3)).name == "scripted"


@pytest.mark.parametrize(
    ("spec", "error", "said"),
    [
        ("zeroo", UnknownNameError, "did you mean 'zero'"),
        ("no_such_package.module:factory", UnknownNameError, "no_such_package"),
        ("tests.eval.scripted:make_scriptd", UnknownNameError, "did you mean 'make_scripted'"),
        ("tests.eval.scripted:fails_to_start", InvalidValueError, "needs a teacher"),
        ("tests.eval.scripted:not_a_policy", InvalidValueError, "is a int without 'name'"),
        ("os;rm:x", InvalidValueError, "package.module:factory"),
        ("missing.pt", MissingFileError, "missing.pt"),
        ("", UnknownNameError, "known"),
    ],
)
def test_a_policy_that_cannot_be_had_is_explained_in_one_line(spec, error, said):
    with pytest.raises(error, match=said) as caught:
        load_policy(spec)
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, UserError)


def test_a_module_in_the_working_directory_is_found(tmp_path, monkeypatch):
    (tmp_path / "beside_me.py").write_text("from tests.eval.scripted import make_scripted as make")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    assert load_policy("beside_me:make").name == "scripted"


def write_module(folder, monkeypatch, name, content):
    (folder / f"{name}.py").write_text(content)
    monkeypatch.syspath_prepend(folder)
    monkeypatch.delitem(sys.modules, name, raising=False)


def test_an_error_inside_a_users_module_is_told(tmp_path, monkeypatch):
    write_module(tmp_path, monkeypatch, "broken_policy", "raise ValueError('two\\nlines')")
    with pytest.raises(InvalidValueError, match="ValueError: two lines"):
        load_policy("broken_policy:make")


def test_a_package_that_a_users_module_lacks_is_named(tmp_path, monkeypatch):
    write_module(tmp_path, monkeypatch, "hungry_policy", "import no_such_dependency")
    with pytest.raises(MissingDependencyError, match="no_such_dependency"):
        load_policy("hungry_policy:make")


@pytest.mark.parametrize(("name", "plans"), [("planner", True), ("zero", False), ("random", False)])
def test_a_policy_that_plans_is_told_apart(name, plans):
    assert is_planner(load_policy(name)) is plans
