"""Checkpoints, each with one thing wrong."""

import io
import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from dapl_baselines.checkpoint import write_checkpoint
from dapl_baselines.policy.config import PolicyNetworkConfig
from dapl_baselines.policy.network import PolicyNetwork

CONFIG = PolicyNetworkConfig(fusion_sizes=(8,), head_sizes=(4,))


class Bomb:
    """Writes a file when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


def good(path: Path) -> None:
    write_checkpoint(path, architecture="policy-network", config=CONFIG, module=PolicyNetwork(CONFIG))


def changed(change: Callable[[dict], object]) -> Callable[[Path], None]:
    """A good checkpoint, its dictionary changed."""

    def make(path: Path) -> None:
        good(path)
        content = torch.load(path, weights_only=True)
        change(content)
        torch.save(content, path)

    return make


def with_tensor(name: str, tensor: object) -> Callable[[Path], None]:
    return changed(lambda content: content["state_dict"].update({name: tensor}))


def pickle_bomb(path: Path) -> None:
    torch.save({"state_dict": Bomb(path.with_name("exploded"))}, path)


def bare_pickle_bomb(path: Path) -> None:
    path.write_bytes(pickle.dumps(Bomb(path.with_name("exploded"))))


def whole_module(path: Path) -> None:
    torch.save(PolicyNetwork(CONFIG), path)


def zip_bomb(path: Path) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("archive/data.pkl", bytes(64 << 20))
        archive.writestr("archive/version", "3")


def zip_that_claims_a_terabyte(path: Path) -> None:
    """An archive whose directory says that its one entry is larger than the file."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("archive/data.pkl", b"x" * 100)
    content = bytearray(buffer.getvalue())
    entry = content.index(b"PK\x01\x02")
    content[entry + 24 : entry + 28] = (4_000_000_000).to_bytes(4, "little")
    path.write_bytes(content)


def truncated(path: Path) -> None:
    good(path)
    path.write_bytes(path.read_bytes()[:-300])


def one_weight_changed(path: Path) -> None:
    with_tensor("actor.0.bias", torch.ones(4))(path)


def nan_weights(path: Path) -> None:
    with_tensor("actor.0.bias", torch.full((4,), np.nan))(path)


def huge_and_hollow(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(3 << 30)
