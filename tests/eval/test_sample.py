from dataclasses import replace
from itertools import pairwise

import pytest

from clutter6d import load_split
from clutter6d.errors import InvalidValueError
from clutter6d.eval.evaluator import Evaluation, EvaluationConfig
from clutter6d.eval.policy_loading import load_policy
from clutter6d.eval.replay import Replay
from clutter6d.eval.report import OFFICIAL_SPLITS, RunSettings
from clutter6d.eval.sample import PAPER_SAMPLE, sample_scene_ids
from tests.scene_fixtures import make_box_scene_set


def test_the_sample_depends_on_the_set_of_scenes_alone():
    scenes = make_box_scene_set(6)
    drawn = sample_scene_ids(scenes, 3)
    assert drawn == sample_scene_ids(replace(scenes, scenes=tuple(reversed(scenes.scenes))), 3)
    others = [sample_scene_ids(replace(scenes, sha256=letter * 64), 3) for letter in "cdefgh"]
    assert any(other != drawn for other in others)


def test_a_smaller_sample_is_part_of_a_larger_one():
    scenes = make_box_scene_set(6)
    sizes = [set(sample_scene_ids(scenes, count)) for count in range(1, 7)]
    assert all(small < large for small, large in pairwise(sizes))
    assert sizes[-1] == {scene.scene_id for scene in scenes.scenes}


@pytest.mark.parametrize("count", [0, 3])
def test_a_sample_larger_than_the_set_is_refused(count):
    with pytest.raises(InvalidValueError, match="there are 2 scenes; choose 1 to 2"):
        sample_scene_ids(make_box_scene_set(2), count)


def test_the_papers_sample_of_a_frozen_split_never_changes():
    assert sample_scene_ids(load_split("dense-test"), PAPER_SAMPLE)[:3] == (
        "dense-2-00000",
        "dense-2-00001",
        "dense-2-00005",
    )


def test_an_evaluation_of_a_sample_says_so_and_replays(tmp_path):
    scenes = make_box_scene_set(4)
    config = EvaluationConfig(max_steps=3, pairs=1, sample=2)
    evaluation = Evaluation(scenes, load_policy("zero"), tmp_path, config)
    assert evaluation.keys == tuple((name, 0) for name in sample_scene_ids(scenes, 2))
    for part in ("journal", "floor"):
        list(evaluation.run(part, num_envs=2, threads=1))
    report = evaluation.finish()
    assert (report.episodes, report.settings.sample, report.settings.scenes) == (2, 2, 4)
    assert "2 sampled of 4 sparse scenes x 1 pairs" in (tmp_path / "report.md").read_text()
    replayed = Replay(tmp_path, scenes)
    assert all(verdict.is_identical for verdict in replayed.run(num_envs=2, threads=1))
    assert replayed.check_report(num_envs=2, threads=1) == ()


def test_a_folder_with_another_sample_is_not_continued(tmp_path):
    scenes = make_box_scene_set(4)
    Evaluation(scenes, load_policy("zero"), tmp_path, EvaluationConfig(sample=2))
    with pytest.raises(InvalidValueError, match="sample was 2, is 3"):
        Evaluation(scenes, load_policy("zero"), tmp_path, EvaluationConfig(sample=3))


@pytest.mark.parametrize(("sample", "label"), [(None, "official"), (10, "sample"), (128, "official")])
def test_a_sample_of_a_frozen_split_is_labelled_as_one(tmp_path, sample, label):
    settings = Evaluation(make_box_scene_set(1), load_policy("zero"), tmp_path, EvaluationConfig()).settings
    frozen = {"tracks": ("dense",), "split_sha256": OFFICIAL_SPLITS["dense"], "scenes": 128, "pairs": 16}
    assert RunSettings(**{**settings.model_dump(), **frozen, "sample": sample}).label == label
