"""Open a data set that ``clutter6d record --format lerobot`` wrote with LeRobot itself, and check what it gives.

Needs an environment with lerobot (``pip install lerobot==0.4.4``), and nothing of Clutter6D:

    python examples/check_lerobot_dataset.py recordings/planner-sparse-test/lerobot [--expected EXPECTED.npz]

``EXPECTED.npz`` may hold what the data set was made from: an array ``frames/FEATURE`` for each feature, all episodes
one after another, and for a camera ``pictures/FEATURE``, its pictures at the frames that ``picture_index`` names.
Pictures are decoded by PyAV, which comes with lerobot; its other decoder, torchcodec, needs FFmpeg's system libraries.
"""

import argparse
import sys
import warnings
from pathlib import Path

import numpy as np
import torch
from lerobot.datasets.compute_stats import aggregate_stats
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.datasets.utils import dataset_to_policy_features

BATCH = 8
DECODER = "pyav"
LEVEL = 1 / 255
MEAN_PICTURE_ERROR = 3 * LEVEL
"""How far decoded pictures may be from the drawn ones in the mean: what H.264 loses."""
VISIBLE = 0.02 * LEVEL
"""Mean difference of two pictures below which H.264 may show them as one."""


def check(holds: bool, what: str, detail: object = "") -> None:
    """Say what was checked; end at the first thing that does not hold."""
    print(f"{'ok ' if holds else 'BAD'} {what}{f': {detail}' if str(detail) else ''}")
    if not holds:
        sys.exit(1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("root", type=Path)
    parser.add_argument("--expected", type=Path)
    arguments = parser.parse_args()
    check((arguments.root / "meta" / "info.json").is_file(), f"{arguments.root} is a finished data set")
    warnings.simplefilter("ignore")
    dataset = LeRobotDataset("local/clutter6d", root=arguments.root, video_backend=DECODER)
    check_table(dataset)
    check_items(dataset)
    check_stats(dataset)
    if arguments.expected:
        with np.load(arguments.expected, allow_pickle=False) as expected:
            check_expected(dataset, {name: expected[name] for name in expected.files})
    print(f"LeRobot opens {arguments.root.name}: {dataset.num_episodes} episodes, {len(dataset)} frames")


def check_table(dataset: LeRobotDataset) -> None:
    """Length, columns and order of the frames."""
    info = dataset.meta.info
    check(len(dataset) == info["total_frames"] == len(dataset.hf_dataset), "length", len(dataset))
    columns = set(dataset.hf_dataset.column_names) | set(dataset.meta.video_keys)
    check(columns == set(dataset.features), "features", ", ".join(sorted(columns)))
    frames = dataset.hf_dataset.with_format("numpy")
    check(np.array_equal(frames["index"], np.arange(len(dataset))), "index counts all frames")
    for episode in dataset.meta.episodes:
        rows = frames[episode["dataset_from_index"] : episode["dataset_to_index"]]
        own = np.arange(episode["length"])
        is_sound = np.array_equal(rows["frame_index"], own) and set(rows["episode_index"]) == {episode["episode_index"]}
        is_sound &= np.allclose(rows["timestamp"], own / dataset.fps, atol=1e-4)
        is_sound &= bool(rows["next.done"][-1]) and not rows["next.done"][:-1].any()
        name = f"{episode['scene_id']} pair {episode['pair']} ({episode['outcome']})"
        check(is_sound, f"episode {episode['episode_index']}", f"{len(own)} frames, {name}, {episode['tasks'][0]!r}")


def check_items(dataset: LeRobotDataset) -> None:
    """Every frame can be had, pictures decoded, in the shapes that the features tell."""
    for index in np.unique(np.linspace(0, len(dataset) - 1, 40).astype(int)).tolist():
        item = dataset[index]
        for name, feature in dataset.features.items():
            is_video, shape = feature["dtype"] == "video", tuple(feature["shape"])
            wanted = (shape[2], *shape[:2]) if is_video else shape if shape != (1,) else ()
            if tuple(item[name].shape) != wanted:
                check(False, f"shape of {name} at frame {index}", tuple(item[name].shape))
            if is_video and not 0 <= float(item[name].min()) <= float(item[name].max()) <= 1:
                check(False, f"range of {name} at frame {index}")
    check(isinstance(item["task"], str), "shapes of items", f"task {item['task']!r}")
    loader = torch.utils.data.DataLoader(dataset, batch_size=min(BATCH, len(dataset)), shuffle=True, num_workers=0)
    batch = next(iter(loader))
    shown = ", ".join(f"{name} {tuple(batch[name].shape)}" for name in sorted(dataset.features))
    check(batch["action"].shape == (min(BATCH, len(dataset)), 7), "a batch of a DataLoader", shown)
    policy = dataset_to_policy_features(dataset.features)
    check({"observation.state", "action"} <= set(policy), "features for policies", ", ".join(sorted(policy)))
    steps = {"observation.state": [-0.1, 0], "action": [0, 0.1, 0.2]}
    history = LeRobotDataset(dataset.repo_id, root=dataset.root, delta_timestamps=steps, video_backend=DECODER)[0]
    check(
        history["observation.state"].shape[0] == 2 and history["action"].shape == (3, 7),
        "histories by delta_timestamps",
    )


def check_stats(dataset: LeRobotDataset) -> None:
    """``stats.json`` is what the frames give, and what LeRobot joins from the episodes' own."""
    frames = dataset.hf_dataset.with_format("numpy")
    for name, feature in dataset.features.items():
        if feature["dtype"] == "video":
            continue
        values = np.asarray(frames[name], dtype=np.float64)
        rows = values.reshape(-1, values.shape[-1] if values.ndim > 1 else 1)
        found = {
            "min": rows.min(axis=0), "max": rows.max(axis=0), "mean": rows.mean(axis=0), "std": rows.std(axis=0)
        }  # fmt: skip
        for statistic, value in found.items():
            if not np.allclose(dataset.meta.stats[name][statistic], value, rtol=1e-6, atol=1e-6):
                check(False, f"{statistic} of {name}", dataset.meta.stats[name][statistic])
    check(True, "statistics recomputed from the frames")
    joined = aggregate_stats(episode_stats(dataset))
    for name, values in joined.items():
        for statistic, value in values.items():
            if not np.allclose(dataset.meta.stats[name][statistic], value, rtol=1e-6, atol=1e-9):
                check(False, f"{statistic} of {name}, joined", value)
    check(set(joined) == set(dataset.features), "statistics joined by LeRobot from those of the episodes")
    for camera in dataset.meta.video_keys:
        pictures = torch.stack([dataset[index][camera] for index in range(0, len(dataset), max(len(dataset) // 50, 1))])
        seen, told = pictures.mean(dim=(0, 2, 3)).numpy(), dataset.meta.stats[camera]["mean"].reshape(-1)
        check(
            np.abs(seen - told).max() < 0.02,
            f"mean colour of {camera}",
            f"{np.round(seen, 3)}, told {np.round(told, 3)}",
        )


def episode_stats(dataset: LeRobotDataset) -> list[dict[str, dict[str, np.ndarray]]]:
    """The episodes' own statistics, which LeRobot leaves out when it opens a data set."""
    import pandas as pd

    table = pd.concat([pd.read_parquet(path) for path in sorted((dataset.root / "meta/episodes").rglob("*.parquet"))])
    columns = [name for name in table.columns if name.startswith("stats/")]
    found: list[dict[str, dict[str, np.ndarray]]] = []
    for _, row in table.iterrows():
        stats: dict[str, dict[str, np.ndarray]] = {}
        for name in columns:
            _, feature, statistic = name.split("/")
            stats.setdefault(feature, {})[statistic] = np.array(_as_lists(row[name]))
        found.append(stats)
    return found


def _as_lists(value: object) -> object:
    return [_as_lists(item) for item in value] if isinstance(value, np.ndarray | list) else value


def check_expected(dataset: LeRobotDataset, expected: dict[str, np.ndarray]) -> None:
    """The frames are those that were recorded, and the pictures those that were drawn."""
    frames = dataset.hf_dataset.with_format("numpy")
    for name, values in expected.items():
        kind, _, feature = name.partition("/")
        if kind == "frames":
            found = np.asarray(frames[feature])
            check(np.array_equal(found, values), f"{feature} is what was recorded", found.shape)
        elif kind == "pictures":
            check_pictures(dataset, feature, values / 255, expected["picture_index"].tolist())


def check_pictures(dataset: LeRobotDataset, camera: str, drawn: np.ndarray, indices: list[int]) -> None:
    """Decoded pictures are near those drawn, and nearer to their own than to a neighbour that looks different."""
    worst, compared = 0.0, 0
    for row, index in enumerate(indices):
        decoded = dataset[index][camera].permute(1, 2, 0).numpy()
        error = np.abs(decoded - drawn[row]).mean()
        worst = max(worst, error)
        for other in {max(row - 1, 0), min(row + 1, len(indices) - 1)}:
            if np.abs(drawn[row] - drawn[other]).mean() > VISIBLE:
                compared += 1
                if np.abs(decoded - drawn[other]).mean() <= error:
                    check(False, f"{camera} shows frame {index} in its place")
    detail = f"mean error at most {worst / LEVEL:.2f} of 255"
    check(worst < MEAN_PICTURE_ERROR, f"{camera} decodes to what was drawn", detail)
    check(compared > 0, f"{camera} shows every frame in its place", f"{compared} neighbours that look different")


if __name__ == "__main__":
    main()
