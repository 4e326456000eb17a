"""A video of each episode."""

import numpy as np
import pytest
from PIL import Image, ImageSequence

from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.recording.cameras import CAMERAS, find_cameras
from clutter6d.recording.recording import record_episodes
from clutter6d.recording.video_file import VideoRecorder
from clutter6d.render.video import join_videos, write_video
from tests.recording.recorded import SIZE, STEPS, files, picture_settings, random_episodes
from tests.render.test_sheet_and_video import plain, read_mp4


@pytest.fixture(scope="module")
def episodes(tmp_path_factory):
    return random_episodes(tmp_path_factory.mktemp("evaluation"), scenes=1)


def record(episodes, folder, *cameras, ending=".gif") -> VideoRecorder:
    recorder = VideoRecorder(folder, picture_settings(episodes, *cameras), ending, "raycast")
    list(record_episodes(episodes, [recorder]))
    return recorder


def test_every_episode_and_camera_has_a_video_with_its_start_its_steps_and_a_second_of_its_end(episodes, tmp_path):
    recorder = record(episodes, tmp_path, "episode", "front")
    assert {path.name for path in recorder.finish().glob("*.gif")} == {
        f"boxes-0_pair{pair}_{camera}.gif" for pair in (0, 1) for camera in ("episode", "front")
    }
    with Image.open(tmp_path / "boxes-0_pair0_episode.gif") as gif:
        times = [frame.info["duration"] for frame in ImageSequence.Iterator(gif)]
        assert gif.size == (SIZE["width"], SIZE["height"])
        assert sum(times) == 100 * (STEPS + 1 + 10)


def test_the_goal_is_shown(episodes, tmp_path):
    record(episodes, tmp_path, "episode")
    pixels = []
    for pair in (0, 1):
        with Image.open(tmp_path / f"boxes-0_pair{pair}_episode.gif") as gif:
            pixels.append(np.array(gif.convert("RGB")).astype(int))
    greenish = [(p[..., 1] > p[..., 0] + 20) & (p[..., 1] > p[..., 2] + 20) for p in pixels]
    assert all(mask.sum() >= 3 for mask in greenish)


def test_finished_videos_are_kept(episodes, tmp_path):
    record(episodes, tmp_path, "episode")
    before = files(tmp_path)
    (tmp_path / "boxes-0_pair1_episode.gif").unlink()
    kept = (tmp_path / "boxes-0_pair0_episode.gif").stat().st_mtime_ns
    record(episodes, tmp_path, "episode")
    assert files(tmp_path) == before
    assert (tmp_path / "boxes-0_pair0_episode.gif").stat().st_mtime_ns == kept


def test_videos_of_other_settings_are_not_mixed(episodes, tmp_path):
    record(episodes, tmp_path, "episode")
    with pytest.raises(InvalidValueError, match="cameras was"):
        record(episodes, tmp_path, "table")


def test_cameras_are_found_by_name():
    assert find_cameras(["front", "scene"]) == ("front", "scene")
    assert {"front", "left", "right", "episode", "scene", "table"} == set(CAMERAS)
    with pytest.raises(UnknownNameError, match="did you mean 'front'"):
        find_cameras(["fornt"])
    with pytest.raises(InvalidValueError, match="each once"):
        find_cameras(["front", "front"])


def test_joined_videos_show_all_frames_in_order(tmp_path):
    paths = [tmp_path / "it's first.mp4", tmp_path / "second.mp4"]
    for number, path in enumerate(paths):
        levels = range(100 * number, 100 * number + 80, 20)
        write_video((plain(level, (32, 64)) for level in levels), path, 10, keyframe_every=2)
    join_videos(paths, tmp_path / "joined" / "both.mp4")
    levels = [frame.mean() for frame in read_mp4(tmp_path / "joined" / "both.mp4")]
    assert np.allclose(levels, [0, 20, 40, 60, 100, 120, 140, 160], atol=3)
    assert [path.name for path in (tmp_path / "joined").iterdir()] == ["both.mp4"]
