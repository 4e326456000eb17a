"""Many assets in one file come out as they went in, and damage is seen."""

import dataclasses

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from clutter6d.assets.library import AssetLibrary
from clutter6d.dataset.asset_pack import AssetPack, write_asset_pack
from clutter6d.errors import InvalidFileError, MissingFileError, UnknownNameError
from tests.box_library import make_box_library


@pytest.fixture
def library(tmp_path) -> AssetLibrary:
    return make_box_library(tmp_path / "library", large=2, small=2)


@pytest.fixture
def pack(tmp_path, library) -> AssetPack:
    write_asset_pack(tmp_path / "assets.parquet", {"test": library})
    return AssetPack(tmp_path / "assets.parquet")


def test_a_packed_asset_is_the_library_s_asset_to_the_bit(pack, library):
    assert pack.names() == library.names()
    for name in pack.names():
        ours, theirs = pack.load(name), library.load(name)
        assert ours.content_hash == theirs.content_hash
        for one, other in zip(ours.parts + tuple(item.mesh for item in ours.visual),
                              theirs.parts + tuple(item.mesh for item in theirs.visual), strict=True):  # fmt: skip
            np.testing.assert_array_equal(one.vertices, other.vertices)
            np.testing.assert_array_equal(one.faces, other.faces)
        assert dataclasses.replace(ours.quality, seconds={}) == dataclasses.replace(theirs.quality, seconds={})


def test_an_asset_is_found_by_its_hash_too(pack, library):
    asset = library.load(library.names()[0])
    assert pack.load(asset.content_hash).name == asset.name


def test_an_unknown_asset_is_named_with_the_nearest(pack):
    with pytest.raises(UnknownNameError, match="box-000"):
        pack.load("box-00")


def test_the_same_assets_give_the_same_bytes(tmp_path, library, pack):
    write_asset_pack(tmp_path / "again.parquet", {"test": library})
    assert (tmp_path / "again.parquet").read_bytes() == pack.path.read_bytes()


def test_the_index_is_the_library_s_and_names_the_pool(pack, library):
    index = pack.index()
    assert list(index["content_hash"]) == list(library.index()["content_hash"])
    assert set(index["pool"]) == {"test"}


def test_an_asset_that_was_changed_is_refused(tmp_path, pack):
    table = pq.read_table(pack.path)
    column = table.column("surface_points").to_pylist()
    column[0][0] += 1e-6
    position = table.schema.get_field_index("surface_points")
    field = table.schema.field(position)
    changed = table.set_column(position, field, pa.array(column, type=field.type))
    pq.write_table(changed, tmp_path / "changed.parquet")
    damaged = AssetPack(tmp_path / "changed.parquet")
    with pytest.raises(InvalidFileError, match="has hash"):
        damaged.load(damaged.names()[0])


@pytest.mark.parametrize("content", [b"", b"PAR1 and nothing else PAR1", b"\x00" * 4096])
def test_what_is_no_parquet_file_is_refused(tmp_path, content):
    (tmp_path / "bad.parquet").write_bytes(content)
    with pytest.raises(InvalidFileError, match="not a valid asset pack"):
        AssetPack(tmp_path / "bad.parquet")


def test_a_table_with_other_columns_is_refused(tmp_path, pack):
    pq.write_table(pq.read_table(pack.path).drop_columns(["inertia"]), tmp_path / "less.parquet")
    with pytest.raises(InvalidFileError, match="column 'inertia' is missing"):
        AssetPack(tmp_path / "less.parquet")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(MissingFileError, match="asset pack"):
        AssetPack(tmp_path / "nothing.parquet")
