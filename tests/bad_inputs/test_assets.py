"""Sources that are not there or not what they should be, and damaged libraries."""

import io
import json
import shutil
import struct
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.sources.furniture_catalogue import FOLDER_VARIABLE
from tests.bad_inputs.boxes import CORNERS, obj
from tests.bad_inputs.harness import Case, Workspace, check_refusal, fingerprint, run_command

LISTING = "PluginFurnitureCatalog.properties"
NAME = "box-000"


def process(source: Path | str, out: Path | str, *options: str) -> list[str]:
    return ["assets", "process", str(source), "--out", str(out), *options]


def meshes(work: Workspace, **files: bytes) -> Path:
    """A folder of one good mesh and others."""
    folder = work.path / "meshes"
    folder.mkdir()
    for name, content in {"good": obj(), **files}.items():
        (folder / f"{name}.obj").write_bytes(content)
    return folder


def catalogue(work: Workspace, content: bytes) -> Path:
    folder = work.path / "catalogue"
    folder.mkdir()
    (folder / "things.sh3f").write_bytes(content)
    return folder


def archive(files: dict[str, bytes | str]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as target:
        for name, content in files.items():
            target.writestr(name, content)
    return buffer.getvalue()


def listing(*entries: dict[str, str]) -> str:
    lines = []
    for number, entry in enumerate(entries, start=1):
        sides = {"width": "10", "depth": "20", "height": "10"}
        full = {"id": f"thing{number}", "name": f"Thing {number}", "model": "/good/box.obj"} | sides | entry
        lines += [f"{key}#{number}={value}" for key, value in full.items()]
    return "\n".join(lines)


def garble_compressed(content: bytes) -> bytes:
    """Damage the first member's compressed bytes, whose place the archive's directory still gives."""
    start = 30 + struct.unpack_from("<H", content, 26)[0] + struct.unpack_from("<H", content, 28)[0]
    return content[:start] + b"\xff" * 12 + content[start + 12 :]


def mark_encrypted(content: bytes) -> bytes:
    changed = bytearray(content)
    changed[6] |= 1
    changed[content.index(b"PK\x01\x02") + 8] |= 1
    return bytes(changed)


def folder_without_a_mesh(work: Workspace) -> Sequence[str]:
    (work.path / "notes").mkdir()
    (work.path / "notes" / "readme.txt").write_text("later")
    return process(work.path / "notes", work.out)


def out_is_a_file(work: Workspace) -> Sequence[str]:
    (work.path / "out").write_text("my notes")
    return process(meshes(work), work.out)


def out_holds_other_things(work: Workspace) -> Sequence[str]:
    return process(meshes(work), work.path)


def later_schema(work: Workspace) -> Sequence[str]:
    path = work.library / "library.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "schema_version": 2}))
    return ["assets", "list", "--library", str(work.library)]


def truncated_library_file(work: Workspace) -> Sequence[str]:
    path = work.library / "library.json"
    path.write_bytes(path.read_bytes()[:20])
    return ["generate", "--track", "sparse", "--library", str(work.library), "--out", work.out]


def asset_folder(work: Workspace) -> Path:
    return next((work.library / "assets").glob(f"{NAME}-*"))


def change_json(work: Workspace, **changed: object) -> None:
    path = asset_folder(work) / "asset.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **changed}))


def change_arrays(work: Workspace, **changed: np.ndarray | None) -> None:
    path = asset_folder(work) / "geometry.npz"
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files} | changed
    np.savez(path, **{name: array for name, array in arrays.items() if array is not None})


class Bomb:
    """Writes a file when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


def pickle_in_the_geometry(work: Workspace) -> None:
    change_arrays(work, inertia=np.array([Bomb(work.path / "exploded")], dtype=object))


def geometry_that_is_a_zip_bomb(work: Workspace) -> None:
    (asset_folder(work) / "geometry.npz").write_bytes(archive({"inertia.npy": bytes(300 << 20)}))


def huge_header(work: Workspace) -> None:
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,), }"
    array = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header
    path = asset_folder(work) / "geometry.npz"
    with np.load(path) as file:
        names = file.files
    path.write_bytes(archive({f"{name}.npy": array for name in names}))


def link_elsewhere(work: Workspace) -> None:
    path = asset_folder(work) / "geometry.npz"
    path.unlink()
    path.symlink_to(path.name)


def asset_of_another_name(work: Workspace) -> None:
    folder = asset_folder(work)
    folder.rename(folder.with_name(folder.name.replace(NAME, "mug")))


def truncate(name: str) -> Callable[[Workspace], None]:
    def cut(work: Workspace) -> None:
        path = asset_folder(work) / name
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])

    return cut


def damage(change: Callable[[Workspace], object], *command: str) -> Callable[[Workspace], Sequence[str]]:
    """Change the library's first asset; then look at it."""

    def make(work: Workspace) -> Sequence[str]:
        change(work)
        return [*(command or ("assets", "show", NAME)), "--library", str(work.library)]

    return make


SOURCES = [
    Case(
        name="unknown-source",
        make=lambda work: process("procedual", work.out),
        says=("unknown asset source 'procedual'", "did you mean 'procedural'?"),
    ),
    Case(
        name="no-such-folder",
        make=lambda work: process(work.path / "nowhere", work.out),
        says=("folder of meshes not found", "nowhere"),
    ),
    Case(name="folder-without-a-mesh", make=folder_without_a_mesh, says=("notes", "holds no mesh file", ".obj")),
    Case(
        name="unknown-unit",
        make=lambda work: process(meshes(work), work.out, "--unit", "inch"),
        says=("unknown unit 'inch'", "cm"),
    ),
    Case(
        name="unknown-axis",
        make=lambda work: process(meshes(work), work.out, "--up", "w"),
        says=("unknown", "'w'", "y, z"),
    ),
    Case(
        name="option-of-another-source",
        make=lambda work: process("procedural", work.out, "--unit", "cm"),
        says=("procedural", "unit"),
    ),
    Case(
        name="no-objects-wanted",
        make=lambda work: process(meshes(work), work.out, "--limit", "0"),
        says=("--limit", "1"),
    ),
    Case(
        name="no-workers",
        make=lambda work: process(meshes(work), work.out, "--workers", "-1"),
        says=("--workers", "1"),
    ),
    Case(name="library-is-a-file", make=out_is_a_file, says=("library.json", "out is in the way")),
    Case(
        name="library-over-other-things",
        make=out_holds_other_things,
        says=("neither empty nor an asset library", "choose another --out"),
    ),
    Case(
        name="library-of-other-settings",
        make=lambda work: process(meshes(work), work.library),
        says=("library", "other settings", "choose another --out"),
    ),
    Case(
        name="catalogue-that-is-no-zip",
        make=lambda work: process(catalogue(work, b"<html>not found</html>"), work.out),
        says=("things.sh3f", "not a furniture catalogue"),
    ),
    Case(
        name="catalogue-truncated",
        make=lambda work: process(catalogue(work, archive({LISTING: listing({})})[:-30]), work.out),
        says=("things.sh3f", "not a furniture catalogue"),
    ),
    Case(
        name="catalogue-without-a-listing",
        make=lambda work: process(catalogue(work, archive({"readme": "hello"})), work.out),
        says=("things.sh3f", "not a furniture catalogue", LISTING),
    ),
    Case(
        name="catalogue-with-damaged-bytes",
        make=lambda work: process(catalogue(work, garble_compressed(archive({LISTING: listing({})}))), work.out),
        says=("things.sh3f", "not a furniture catalogue"),
    ),
    Case(
        name="catalogue-with-a-password",
        make=lambda work: process(catalogue(work, mark_encrypted(archive({LISTING: listing({})}))), work.out),
        says=("things.sh3f", "not a furniture catalogue", "encrypted"),
    ),
    Case(
        name="catalogue-listing-bomb",
        make=lambda work: process(catalogue(work, archive({LISTING: b"#" * (64 << 20)})), work.out),
        says=("things.sh3f", LISTING, "larger than"),
    ),
    Case(
        name="catalogue-sizes-in-words",
        make=lambda work: process(catalogue(work, archive({LISTING: listing({"width": "wide"})})), work.out),
        says=("things.sh3f", "thing1", "width", "'wide'"),
    ),
    Case(
        name="catalogue-size-nan",
        make=lambda work: process(catalogue(work, archive({LISTING: listing({"depth": "nan"})})), work.out),
        says=("things.sh3f", "thing1", "depth", "'nan'"),
    ),
]

LIBRARIES = [
    Case(
        name="no-library",
        make=lambda work: ["assets", "list", "--library", str(work.path / "nowhere")],
        says=("asset library not found", "nowhere", "clutter6d assets process"),
    ),
    Case(
        name="scene-set-as-library",
        make=lambda work: ["assets", "verify", "--library", str(work.scenes)],
        says=("asset library not found", "scenes"),
    ),
    Case(
        name="unknown-asset",
        make=lambda work: ["assets", "show", "box-0", "--library", str(work.library)],
        says=("unknown asset", "'box-0'", "did you mean 'box-00"),
    ),
    Case(name="library-of-a-later-schema", make=later_schema, says=("library.json", "schema_version")),
    Case(
        name="library-file-truncated", make=truncated_library_file, says=("library.json", "not a valid asset library")
    ),
    Case(name="asset-file-truncated", make=damage(truncate("asset.json")), says=("asset.json", "not a valid asset")),
    Case(
        name="asset-file-with-unknown-field",
        make=damage(lambda work: change_json(work, colour_of_lid="red")),
        says=("asset.json", "colour_of_lid"),
    ),
    Case(
        name="asset-without-mass",
        make=damage(lambda work: change_json(work, mass_kg=-1.0)),
        says=("asset.json", "mass_kg", "greater than 0"),
    ),
    Case(
        name="asset-mass-nan",
        make=damage(lambda work: change_json(work, mass_kg=float("nan"))),
        says=("asset.json", "mass_kg"),
    ),
    Case(
        name="asset-mass-changed",
        make=damage(lambda work: change_json(work, mass_kg=5.0)),
        says=(NAME, "content has hash", "process the object again"),
    ),
    Case(
        name="asset-name-leaves-the-folder",
        make=damage(lambda work: change_json(work, name="../../evil")),
        says=("asset.json", "name"),
    ),
    Case(name="asset-in-another-folder", make=damage(asset_of_another_name, "assets", "show", "mug"), says=("mug",)),
    Case(
        name="geometry-missing",
        make=damage(lambda work: (asset_folder(work) / "geometry.npz").unlink()),
        says=("asset geometry not found", "geometry.npz"),
    ),
    Case(name="geometry-truncated", make=damage(truncate("geometry.npz")), says=("geometry.npz", "not a valid")),
    Case(name="geometry-a-link-to-itself", make=damage(link_elsewhere), says=("geometry.npz", "symbolic links")),
    Case(
        name="geometry-is-prose",
        make=damage(lambda work: (asset_folder(work) / "geometry.npz").write_text("a box")),
        says=("geometry.npz", "not a valid"),
    ),
    Case(name="geometry-zip-bomb", make=damage(geometry_that_is_a_zip_bomb), says=("geometry.npz", "unpacks to more")),
    Case(name="geometry-claims-a-terabyte", make=damage(huge_header), says=("geometry.npz", "not a valid")),
    Case(name="geometry-with-a-pickle", make=damage(pickle_in_the_geometry), says=("geometry.npz", "pickle")),
    Case(
        name="geometry-of-another-shape",
        make=damage(lambda work: change_arrays(work, surface_points=np.zeros((511, 3), dtype=np.float32))),
        says=("geometry.npz", "surface_points", "(511, 3)"),
    ),
    Case(
        name="geometry-of-another-type",
        make=damage(lambda work: change_arrays(work, inertia=np.eye(3, dtype=np.float32))),
        says=("geometry.npz", "inertia", "float32"),
    ),
    Case(
        name="geometry-nan",
        make=damage(lambda work: change_arrays(work, inertia=np.full((3, 3), np.nan))),
        says=("geometry.npz", "inertia", "not finite"),
    ),
    Case(
        name="geometry-lacks-an-array",
        make=damage(lambda work: change_arrays(work, inertia=None)),
        says=("geometry.npz", "inertia"),
    ),
    Case(
        name="geometry-index-out-of-range",
        make=damage(lambda work: change_arrays(work, part_faces=np.full((12, 3), 99, dtype=np.int32))),
        says=("geometry.npz", "vertex that is not there"),
    ),
    Case(
        name="geometry-tampered",
        make=damage(lambda work: change_arrays(work, inertia=np.eye(3))),
        says=(NAME, "content has hash"),
    ),
    Case(
        name="verify-a-tampered-library",
        make=damage(lambda work: change_arrays(work, inertia=np.eye(3)), "assets", "verify"),
        says=("library", "1 problems found", "process the source again"),
    ),
]


@pytest.mark.parametrize("case", [*SOURCES, *LIBRARIES], ids=lambda case: case.name)
def test_it_is_refused_and_nothing_is_touched(case: Case, workspace: Workspace) -> None:
    arguments = case.make(workspace)
    before = fingerprint(workspace.path)
    check_refusal(run_command(arguments), case.code, case.says)
    assert fingerprint(workspace.path) == before


def test_a_mug_of_three_hundred_metres_asks_for_its_unit(workspace: Workspace) -> None:
    folder = meshes(workspace, mug=obj(3000 * CORNERS))
    assert run_command(process(folder, workspace.out, "--unit", "m")).code == 0
    records = {record.key: record for record in AssetLibrary.open(workspace.out).records()}
    assert records["mug.obj"].reason == "implausible-size"
    assert "is the unit right?" in records["mug.obj"].detail
    assert records["good.obj"].status == "accepted"


def test_a_catalogue_of_traps_gives_its_one_good_object(workspace: Workspace, monkeypatch) -> None:
    traps = {
        "thing1": {},
        "thing2": {"model": "/../../etc/passwd.obj"},
        "thing3": {"model": "/bomb/bomb.obj"},
        "thing4": {"model": "/heavy/box.obj"},
        "thing5": {"model": "/good/box.exe"},
    }
    content = archive(
        {
            LISTING: listing(*traps.values()),
            "good/box.obj": obj(),
            "../../evil.obj": obj(),
            "bomb/bomb.obj": bytes(64 << 20),
            "heavy/box.obj": obj(head="mtllib box.mtl"),
            "heavy/texture.png": bytes(300 << 20),
            "good/box.exe": obj(),
        }
    )
    monkeypatch.setenv(FOLDER_VARIABLE, str(catalogue(workspace, content)))
    before = set(workspace.path.parent.iterdir())
    assert run_command(process("furniture_catalogue", workspace.out)).code == 0
    found = {record.key: record.reason or record.status for record in AssetLibrary.open(workspace.out).records()}
    assert found == {
        "thing1": "accepted",
        "thing2": "unreadable",
        "thing3": "too-large",
        "thing4": "too-large",
        "thing5": "unreadable",
    }
    assert set(workspace.path.parent.iterdir()) == before


def test_a_damaged_record_is_made_again(workspace: Workspace) -> None:
    folder = meshes(workspace)
    assert run_command(process(folder, workspace.out)).code == 0
    before = fingerprint(Path(workspace.out) / "assets")
    record = next(Path(workspace.out, "records").iterdir())
    record.write_bytes(record.read_bytes()[:40])
    check_refusal(run_command(["assets", "verify", "--library", workspace.out]), 2, ("1 problems found",))
    assert run_command(process(folder, workspace.out)).code == 0
    assert run_command(["assets", "verify", "--library", workspace.out]).code == 0
    assert fingerprint(Path(workspace.out) / "assets") == before


def test_a_lost_asset_is_made_again(workspace: Workspace) -> None:
    folder = meshes(workspace)
    assert run_command(process(folder, workspace.out)).code == 0
    before = fingerprint(Path(workspace.out) / "assets")
    shutil.rmtree(next(Path(workspace.out, "assets").iterdir()))
    assert run_command(process(folder, workspace.out)).code == 0
    assert fingerprint(Path(workspace.out) / "assets").keys() == before.keys()
