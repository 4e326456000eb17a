import numpy as np
import torch

from clutter6d.envs.env_config import EnvConfig
from clutter6d.seeding import generator
from dapl_baselines.push_distillation.lessons import Lessons, ask_teacher
from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy.candidates import Counts, draw_candidates
from dapl_baselines.push_policy.push_frame import view_pushes
from dapl_baselines.push_policy.push_slots import PushSlots
from dapl_baselines.push_policy.push_state import STATE_FIELDS
from dapl_baselines.push_policy.seen import see_points
from dapl_baselines.push_policy.target_shapes import TargetShapes
from dapl_baselines.validation import part_scenes
from tests.dapl_baselines.push_distillation.small_push_distillation import TEACHER
from tests.dapl_baselines.push_policy.test_critic import make_critic
from tests.scene_fixtures import make_box_scene_set


def make_slots() -> PushSlots:
    scenes = part_scenes(make_box_scene_set(3)).training
    shapes = TargetShapes.of(scenes.assets_of(scene)[scene.objects[0].asset_hash] for scene in scenes.scenes)
    return PushSlots(scenes, shapes, EnvConfig(), size=3, seed=0, threads=1)


def test_the_teacher_judges_the_pushes_that_the_student_looks_at_where_they_are():
    slots, teacher = make_slots(), make_critic(TEACHER)
    known, seen = slots.see(), see_points(slots.observe(np.arange(3)))
    counts = Counts(segments=2, whole=3)
    drawn = draw_candidates(seen.state, seen.goals, seen.shapes, seen.targets, counts, generator(0, "test"))
    judged = ask_teacher(teacher, known, seen, drawn)
    there = drawn.copy()
    for part in (columns.CONTACT, columns.START):
        in_world = drawn[..., part] + seen.state.poses[:, None, :3]
        there[..., part] = in_world - known.state.poses[:, None, :3]
    arrays = (known.goals, known.shapes.surface[known.targets], there)
    tensors = (torch.from_numpy(np.asarray(array, dtype=np.float32)) for array in arrays)
    with torch.no_grad():
        wanted = teacher(view_pushes(known.state.to_tensors(), *tensors))
    assert judged.gain.shape == (3, 5)
    assert torch.equal(judged.gain, wanted.gain)
    assert torch.equal(judged.future, wanted.future)


def test_lessons_come_back_from_rows_as_they_were():
    slots = make_slots()
    known, seen = slots.see(), see_points(slots.observe(np.arange(3)))
    counts = Counts(segments=2, whole=3)
    drawn = draw_candidates(seen.state, seen.goals, seen.shapes, seen.targets, counts, generator(0, "test"))
    tokens = torch.linspace(-2, 2, 3 * 40 * 16).reshape(3, 40, 16)
    lessons = Lessons.of(seen, drawn, tokens, ask_teacher(make_critic(TEACHER), known, seen, drawn))
    back = Lessons.of_rows(lessons.to_rows())
    for name in STATE_FIELDS:
        assert torch.equal(getattr(back.state, name), getattr(lessons.state, name))
    for name in ("goals", "surface", "pushes", "gain", "future"):
        assert torch.equal(getattr(back, name), getattr(lessons, name))
    assert torch.allclose(back.tokens, lessons.tokens, atol=1e-3)
    assert torch.equal(back.view().features, lessons.view().features)
