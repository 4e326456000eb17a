"""One colour for each face of a mesh, from its texture, its material or its vertex colours, and few colours for all."""

import logging

import numpy as np
import trimesh
from jaxtyping import Float, Int
from PIL import Image
from trimesh.visual import TextureVisuals

MAX_COLOURS = 8
GREY = (0.65, 0.65, 0.65, 1.0)
_TEXTURE_PIXELS = 128
_MIN_ALPHA = 0.25
_log = logging.getLogger(__name__)


def face_colours(mesh: trimesh.Trimesh) -> Float[np.ndarray, "face 4"]:
    """RGBA of each face in [0, 1]; grey where the file says nothing usable."""
    try:
        colours = _face_colours(mesh)
    except (
        ValueError,
        TypeError,
        KeyError,
        AttributeError,
        IndexError,
        OSError,
        Image.DecompressionBombError,
    ) as error:
        _log.info("no usable colours: %s", error)
        colours = np.tile(GREY, (len(mesh.faces), 1))
    colours = np.nan_to_num(np.clip(colours, 0, 1), nan=0.65)
    colours[:, 3] = np.clip(colours[:, 3], _MIN_ALPHA, 1)
    return colours


def _face_colours(mesh: trimesh.Trimesh) -> Float[np.ndarray, "face 4"]:
    visual = mesh.visual
    if isinstance(visual, TextureVisuals):
        return _texture_colours(mesh, visual)
    if visual is None or visual.kind not in ("face", "vertex"):
        return np.tile(GREY, (len(mesh.faces), 1))
    return np.asarray(visual.face_colors, dtype=np.float64) / 255


def _texture_colours(mesh: trimesh.Trimesh, visual: TextureVisuals) -> Float[np.ndarray, "face 4"]:
    """Each face's colour in the texture at its centre; the material's colour where there is no texture."""
    material = visual.material
    image = getattr(material, "image", None) or getattr(material, "baseColorTexture", None)
    if image is None:
        return np.tile(np.asarray(material.main_color, dtype=np.float64) / 255, (len(mesh.faces), 1))
    pixels = _small_pixels(image)
    if visual.uv is None or len(visual.uv) != len(mesh.vertices):
        return np.tile(pixels.reshape(-1, 4).mean(axis=0), (len(mesh.faces), 1))
    return _sample(pixels, np.asarray(visual.uv)[mesh.faces].mean(axis=1))


def _small_pixels(image: Image.Image) -> Float[np.ndarray, "height width 4"]:
    small = image.convert("RGBA")
    small.thumbnail((_TEXTURE_PIXELS, _TEXTURE_PIXELS))
    return np.asarray(small, dtype=np.float64) / 255


def _sample(
    pixels: Float[np.ndarray, "height width 4"], uv: Float[np.ndarray, "face 2"]
) -> Float[np.ndarray, "face 4"]:
    """The texture's colour at texture coordinates, which repeat; v points up."""
    height, width = pixels.shape[:2]
    wrapped = np.nan_to_num(uv) % 1.0
    columns = np.minimum((wrapped[:, 0] * width).astype(int), width - 1)
    rows = np.minimum(((1 - wrapped[:, 1]) * height).astype(int), height - 1)
    return pixels[rows, columns]


def quantise_colours(
    colours: Float[np.ndarray, "face 4"], max_colours: int = MAX_COLOURS
) -> tuple[Float[np.ndarray, "colour 4"], Int[np.ndarray, "face"]]:
    """At most so many colours, and which one each face gets; colours that are few already stay as they are."""
    rounded = np.round(colours * 255).astype(np.uint8)
    palette, labels = np.unique(rounded, axis=0, return_inverse=True)
    labels = labels.reshape(-1)
    if len(palette) > max_colours:
        strip = Image.fromarray(rounded[None, :, :3].copy(), mode=None)
        labels = np.asarray(strip.quantize(max_colours, method=Image.Quantize.MEDIANCUT))[0].astype(np.int64)
        _, labels = np.unique(labels, return_inverse=True)
        palette = np.array([rounded[labels == label].mean(axis=0) for label in range(labels.max() + 1)])
    return palette / 255, labels
