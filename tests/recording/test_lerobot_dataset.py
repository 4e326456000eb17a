"""The written LeRobot data sets follow the rules of format v3.0, as far as they can be told without LeRobot."""

import json
import subprocess
from itertools import pairwise

import imageio_ffmpeg
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from clutter6d.errors import InvalidValueError, StorageError
from clutter6d.recording import lerobot_dataset
from clutter6d.recording.lerobot_features import frame_arrays
from clutter6d.recording.lerobot_recorder import LeRobotRecorder
from clutter6d.recording.recording import RecordingSettings, record_episodes
from tests.recording.recorded import SIZE, STEPS, files, known_episodes, picture_settings, random_episodes, stacked

CAMERAS = ("front", "left")
INDICES = ["timestamp", "frame_index", "episode_index", "index", "task_index"]
ARROW_TYPES = {"float32": pa.float32(), "int64": pa.int64(), "bool": pa.bool_()}


class Keeping(LeRobotRecorder):
    """Also keeps the frames in memory, to be compared."""

    def add(self, rollout, scene, model):
        self.kept = [*getattr(self, "kept", []), frame_arrays(rollout)]
        super().add(rollout, scene, model)


def record(episodes, folder, settings, *, stop_after=None):
    recorder = Keeping(folder, settings, episodes.keys, "raycast")
    for number, _ in enumerate(record_episodes(episodes, [recorder], point_clouds=settings.point_clouds), 1):
        if number == stop_after:
            return recorder
    recorder.finish()
    return recorder


@pytest.fixture(scope="module")
def episodes(tmp_path_factory):
    return random_episodes(tmp_path_factory.mktemp("evaluation"))


@pytest.fixture(scope="module")
def settings(episodes):
    return picture_settings(episodes, *CAMERAS, point_clouds=True)


@pytest.fixture(scope="module")
def recorded(episodes, settings, tmp_path_factory):
    folder = tmp_path_factory.mktemp("lerobot")
    return folder, record(episodes, folder, settings).kept


@pytest.fixture
def info(recorded):
    return json.loads((recorded[0] / "meta" / "info.json").read_text())


def frames_of(folder) -> pd.DataFrame:
    return pd.concat([pd.read_parquet(path) for path in sorted((folder / "data").rglob("*.parquet"))])


def episodes_of(folder) -> pd.DataFrame:
    return pd.read_parquet(folder / "meta" / "episodes" / "chunk-000" / "file-000.parquet")


def decoded(path) -> np.ndarray:
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24"]
    pixels = subprocess.run([*command, "-"], capture_output=True, check=True).stdout
    return np.frombuffer(pixels, np.uint8).reshape(-1, SIZE["height"], SIZE["width"], 3)


def test_the_folders_hold_what_the_format_asks_for(recorded):
    assert {name for name in files(recorded[0]) if not name.startswith(".")} == {
        "README.md", "LICENCES.csv", "recording.json", "meta/info.json", "meta/stats.json", "meta/tasks.parquet",
        "meta/episodes/chunk-000/file-000.parquet", "data/chunk-000/file-000.parquet",
        *(f"videos/observation.images.{camera}/chunk-000/file-000.mp4" for camera in CAMERAS),
    }  # fmt: skip


def test_the_info_tells_what_there_is(info):
    assert info["codebase_version"] == "v3.0"
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (4, 4 * STEPS, 1)
    assert info["fps"] == 10
    assert info["splits"] == {"train": "0:4"}
    for key in ("data_path", "video_path"):
        assert "{chunk_index:03d}" in info[key]
        assert "{file_index:03d}" in info[key]
    assert list(info["features"])[-5:] == INDICES


def test_every_feature_has_its_column_type_and_names(recorded, info):
    schema = pq.read_schema(recorded[0] / "data" / "chunk-000" / "file-000.parquet")
    stored = {name for name, feature in info["features"].items() if feature["dtype"] != "video"}
    assert set(schema.names) == stored
    for name in stored:
        feature, found = info["features"][name], schema.field(name).type
        value, shape = ARROW_TYPES[feature["dtype"]], feature["shape"]
        wanted = {0: value, 1: pa.list_(value, shape[0]), 2: pa.list_(pa.list_(value))}[
            len(shape) if shape != [1] else 0
        ]
        assert found == wanted, name
        if len(shape) == 1 and shape != [1]:
            assert len(set(feature["names"])) == shape[0]


def test_the_frames_are_those_that_were_simulated(recorded):
    folder, kept = recorded
    frames = frames_of(folder)
    for name, values in kept[0].items():
        expected = np.concatenate([arrays[name] for arrays in kept])
        found = frames[name].to_numpy() if values.ndim == 1 else np.array(frames[name].tolist())
        if values.ndim == 3:
            found = np.stack([np.stack(rows) for rows in frames[name]])
        assert np.array_equal(found, expected), name


def test_frames_are_counted_within_and_over_episodes(recorded):
    frames = frames_of(recorded[0])
    assert np.array_equal(frames["index"], np.arange(4 * STEPS))
    assert np.array_equal(frames.frame_index, np.tile(np.arange(STEPS), 4))
    assert np.array_equal(frames.episode_index, np.repeat(np.arange(4), STEPS))
    assert np.allclose(frames.timestamp, frames.frame_index / 10, atol=1e-6)
    assert np.array_equal(frames["next.done"], frames.frame_index == STEPS - 1)


def test_the_table_of_episodes_tells_where_each_is(recorded, episodes):
    table = episodes_of(recorded[0])
    assert np.array_equal(table.dataset_from_index, np.arange(4) * STEPS)
    assert np.array_equal(table.dataset_to_index, np.arange(1, 5) * STEPS)
    assert list(zip(table.scene_id, table.pair, strict=True)) == list(episodes.keys)
    assert {tuple(tasks) for tasks in table.tasks} == {("move the brown box to the goal pose",)}
    for camera in CAMERAS:
        key = f"videos/observation.images.{camera}"
        assert np.allclose(table[f"{key}/from_timestamp"], np.arange(4) * STEPS / 10)
        assert np.allclose(table[f"{key}/to_timestamp"], np.arange(1, 5) * STEPS / 10)
    assert not table[[name for name in table if name.endswith(("chunk_index", "file_index"))]].to_numpy().any()


def test_tasks_are_indexed_by_their_sentence(recorded):
    tasks = pd.read_parquet(recorded[0] / "meta" / "tasks.parquet")
    assert tasks.task_index.to_dict() == {"move the brown box to the goal pose": 0}


def test_statistics_are_those_of_all_frames(recorded, info):
    stats = json.loads((recorded[0] / "meta" / "stats.json").read_text())
    frames = frames_of(recorded[0])
    assert set(stats) == set(info["features"])
    for name in ("observation.state", "action", "next.reward", "index"):
        values = stacked(frames[name]) if frames[name].dtype == object else frames[name].to_numpy()[:, None]
        values = values.astype(np.float64)
        assert np.allclose(stats[name]["mean"], values.mean(axis=0))
        assert np.allclose(stats[name]["std"], values.std(axis=0), atol=1e-7)
        assert np.allclose(stats[name]["min"], values.min(axis=0))
        assert np.allclose(stats[name]["max"], values.max(axis=0))
        assert stats[name]["count"] == [4 * STEPS]
    ordered = [np.array(stats["action"][name]) for name in ("min", "q01", "q10", "q50", "q90", "q99", "max")]
    assert all((low <= high).all() for low, high in pairwise(ordered))


def test_videos_hold_every_frame_and_the_colours_that_the_statistics_tell(recorded):
    stats = json.loads((recorded[0] / "meta" / "stats.json").read_text())
    for camera in CAMERAS:
        key = f"observation.images.{camera}"
        pictures = decoded(recorded[0] / "videos" / key / "chunk-000" / "file-000.mp4")
        assert len(pictures) == 4 * STEPS
        assert np.shape(stats[key]["mean"]) == np.shape(stats[key]["q50"]) == (3, 1, 1)
        assert np.allclose(pictures.mean(axis=(0, 1, 2)) / 255, np.ravel(stats[key]["mean"]), atol=0.02)


def test_a_success_is_a_success_in_its_last_frame(tmp_path):
    episodes = known_episodes(tmp_path / "evaluation")
    record(episodes, tmp_path / "out", RecordingSettings(run=episodes.settings))
    frames = frames_of(tmp_path / "out")
    last = frames.groupby("episode_index").tail(1)
    assert last["next.success"].tolist() == [True, False] * 3
    assert not frames["next.truncated"].any()
    assert json.loads((tmp_path / "out" / "meta" / "info.json").read_text())["video_path"] is None


def test_files_are_filled_up_to_a_size():
    assert lerobot_dataset.number_files([40, 50, 30, 200, 10], 100) == [0, 0, 1, 2, 3]


def test_large_data_sets_are_spread_over_files_and_chunks(episodes, tmp_path, monkeypatch):
    settings = picture_settings(episodes, "front")
    monkeypatch.setattr(lerobot_dataset, "FILES_PER_CHUNK", 3)
    monkeypatch.setattr(lerobot_dataset, "number_files", _one_each)
    record(episodes, tmp_path, settings)
    table, place = episodes_of(tmp_path), ["chunk_index", "file_index"]
    for prefix, pattern in (("data", "data/{}.parquet"), ("videos/observation.images.front",) * 2):
        where = table[[f"{prefix}/{name}" for name in place]].to_numpy().tolist()
        assert where == [[0, 0], [0, 1], [0, 2], [1, 0]]
        for chunk, file in where:
            name = f"chunk-{chunk:03d}/file-{file:03d}"
            path = tmp_path / (pattern.format(name) if "{}" in pattern else f"{pattern}/{name}.mp4")
            assert len(decoded(path) if path.suffix == ".mp4" else pd.read_parquet(path)) == STEPS
    assert np.array_equal(frames_of(tmp_path)["index"], np.arange(4 * STEPS))
    assert not table["videos/observation.images.front/from_timestamp"].any()


def _one_each(sizes, max_bytes):
    return list(range(len(sizes)))


def test_a_stopped_recording_goes_on_where_it_was_and_is_equal(recorded, episodes, settings, tmp_path):
    record(episodes, tmp_path, settings, stop_after=3)
    assert not (tmp_path / "meta").exists()
    assert len(record(episodes, tmp_path, settings).kept) == 1
    assert files(tmp_path) == files(recorded[0])
    assert not hasattr(record(episodes, tmp_path, settings), "kept")


def test_what_was_stopped_while_it_was_put_together_is_put_together_again(episodes, tmp_path, monkeypatch):
    settings = RecordingSettings(run=episodes.settings)
    record(episodes, tmp_path / "whole", settings)

    def full(*arguments):
        raise StorageError("disk full")

    with monkeypatch.context() as patch:
        patch.setattr(lerobot_dataset, "write_meta", full)
        with pytest.raises(StorageError):
            record(episodes, tmp_path / "stopped", settings)
    assert not hasattr(record(episodes, tmp_path / "stopped", settings), "kept")
    assert files(tmp_path / "stopped") == files(tmp_path / "whole")


def test_licences_name_every_asset_once(recorded):
    table = pd.read_csv(recorded[0] / "LICENCES.csv")
    assert len(table) == table.asset.nunique() == 8
    assert set(table.licence) == {"Apache-2.0"}


def test_pictures_that_a_video_cannot_hold_are_refused(episodes, tmp_path):
    settings = picture_settings(episodes, "front").model_copy(update={"width": 33})
    with pytest.raises(InvalidValueError, match="33 x 32: videos need even sizes"):
        LeRobotRecorder(tmp_path / "out", settings, episodes.keys)
    assert not (tmp_path / "out").exists()
