"""The data card of a data set: measured, drawn, and written as one Markdown page with its pictures beside it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TypeVar

from PIL.Image import Image as PilImage

from clutter6d.assets.asset import Asset
from clutter6d.dataset.card_page import ASSETS_OF, SHEET_OF, CardContent, make_page
from clutter6d.dataset.card_plots import check_matplotlib, plot_assets, plot_clutter, plot_difficulty, plot_goals
from clutter6d.dataset.card_subject import CardSubject
from clutter6d.dataset.measurement import Measurements, measure
from clutter6d.dataset.scenes import SceneCollection
from clutter6d.errors import InvalidValueError
from clutter6d.render.asset_picture import asset_pictures
from clutter6d.render.backend import choose_backend
from clutter6d.render.camera import TABLE_VIEW
from clutter6d.render.scene_picture import render_scene
from clutter6d.render.sheet import contact_sheet
from clutter6d.schema import write_bytes

Item = TypeVar("Item")
_JPEG_QUALITY = 82
_SCENE_COLUMNS, _SCENE_SIZE_PX = 4, (480, 360)
_SCENE_CELL_PX = 300
_ASSET_COLUMNS, _ASSET_SIZE_PX = 10, 130


@dataclass(frozen=True, kw_only=True, slots=True)
class CardOptions:
    """What a card shows.

    Attributes:
        scenes: Scenes on each contact sheet, the first of a test split; 0 draws no sheets at all.
        assets: Assets on the sheet of a pool, evenly spread over their names.
        backend: Who draws, as for :func:`clutter6d.render.picture.open_renderer`.
    """

    scenes: int = 24
    assets: int = 60
    backend: str = "auto"


@dataclass(frozen=True, kw_only=True, slots=True)
class CardStep:
    """Something that was finished on the way to a card.

    Attributes:
        task: What is being done, for instance ``"measuring dense-test"``.
        done: Steps of it that are done.
        total: All its steps.
    """

    task: str
    done: int
    total: int


OnStep = Callable[[CardStep], None]


def write_card(subject: CardSubject, page: Path, options: CardOptions, on_step: OnStep = lambda _step: None) -> Path:
    """Measure and draw a data set, and write its card.

    Args:
        subject: The data set.
        page: The Markdown file; pictures go to a folder beside it that has its name without the suffix.
        options: What to show.
        on_step: Called as the work goes on.

    Returns:
        The page.

    Raises:
        MissingDependencyError: matplotlib is not installed, or the backend does not work here.
        UnknownNameError: There is no such backend.
        StorageError: The page or a picture cannot be written.
    """
    check_matplotlib()
    if options.scenes:
        choose_backend(options.backend)
    measured = {name: _measure(name, scenes, on_step) for name, scenes in subject.splits.items()}
    folder, pictures = page.with_suffix(""), dict[str, str]()
    for title, file, content in _draw(subject, measured, options, on_step):
        write_bytes(folder / file, content)
        pictures[title] = f"{folder.name}/{file}"
    content = CardContent(
        name=subject.name,
        facts=subject.facts,
        measured=measured,
        hashes={name: scenes.sha256 for name, scenes in subject.splits.items()},
        assets=subject.assets,
        failures=subject.failures,
        pictures=pictures,
    )
    write_bytes(page, make_page(content).encode())
    return page


def card_file(out: Path) -> Path:
    """The page that an ``--out`` means: itself if it is a Markdown file, else ``data-card.md`` in that folder.

    Raises:
        InvalidValueError: It is a file of another kind, or the page is a folder.
    """
    page = out if out.suffix == ".md" else out / "data-card.md"
    if page.is_dir():
        raise InvalidValueError(f"--out {out}: {page} is a folder; choose another page")
    if page != out and out.is_file():
        raise InvalidValueError(f"--out {out}: is a file; give a folder, or a page that ends in .md")
    return page


def _measure(name: str, scenes: SceneCollection, on_step: OnStep) -> Measurements:
    return measure(scenes, lambda done, total: on_step(CardStep(task=f"measuring {name}", done=done, total=total)))


def _draw(
    subject: CardSubject, measured: Mapping[str, Measurements], options: CardOptions, on_step: OnStep
) -> Iterator[tuple[str, str, bytes]]:
    """Title, file name and bytes of each picture."""
    yield "difficulty", "difficulty.png", plot_difficulty(measured)
    yield "clutter", "clutter.png", plot_clutter(measured)
    yield "goals", "goals.png", plot_goals(measured)
    yield "assets", "assets.png", plot_assets(subject.assets)
    if not options.scenes:
        return
    for name in _shown_splits(tuple(subject.splits)):
        sheet = _scene_sheet(name, subject.splits[name], options, on_step)
        yield SHEET_OF + name, f"sheet-{name}.jpg", _as_jpeg(sheet)
    for pool, rows in subject.assets.groupby("pool", sort=False):
        sheet = _asset_sheet(str(pool), sorted(rows["name"]), subject.load_asset, options, on_step)
        yield ASSETS_OF + str(pool), f"assets-{pool}.jpg", _as_jpeg(sheet)


def _shown_splits(names: Sequence[str]) -> Sequence[str]:
    """The test splits, the last first since tracks go from sparse to dense; all splits if none is a test split."""
    return [name for name in reversed(names) if name.endswith("test")] or names


def _scene_sheet(name: str, scenes: SceneCollection, options: CardOptions, on_step: OnStep) -> PilImage:
    chosen = scenes.scenes[: options.scenes]
    width, height = _SCENE_SIZE_PX
    images = [
        render_scene(
            scene,
            scenes.assets_of(scene),
            cameras=(TABLE_VIEW,),
            width=width,
            height=height,
            backend=options.backend,
        )[0]
        for scene in _counted(iter(chosen), f"drawing {name}", len(chosen), on_step)
    ]
    labels = [scene.scene_id for scene in chosen]
    return contact_sheet(images, labels, _SCENE_COLUMNS, cell_width=_SCENE_CELL_PX)


def _asset_sheet(
    pool: str, names: Sequence[str], load: Callable[[str], Asset], options: CardOptions, on_step: OnStep
) -> PilImage:
    chosen = names[:: -(-len(names) // options.assets)]
    shown = _counted(map(load, chosen), f"drawing pool {pool}", len(chosen), on_step)
    images = [image for _, image in asset_pictures(shown, size_px=_ASSET_SIZE_PX, backend=options.backend)]
    return contact_sheet(images, chosen, _ASSET_COLUMNS)


def _counted(items: Iterator[Item], task: str, total: int, on_step: OnStep) -> Iterator[Item]:
    for done, item in enumerate(items, start=1):
        yield item
        on_step(CardStep(task=task, done=done, total=total))


def _as_jpeg(image: PilImage) -> bytes:
    buffer = BytesIO()
    image.save(buffer, format="JPEG", quality=_JPEG_QUALITY, optimize=True)
    return buffer.getvalue()
