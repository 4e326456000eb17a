"""Answers that were paid for, kept on disk: a folder of small files, one a question."""

import hashlib
import logging
from pathlib import Path
from typing import Literal

from pydantic import Field

from clutter6d.assets.annotation.annotator import Subject, Usage
from clutter6d.assets.annotation.answer import Answer
from clutter6d.assets.annotation.prompt import PROMPT_VERSION, texts
from clutter6d.errors import InvalidFileError, MissingFileError
from clutter6d.schema import FileModel, canonical_json, read_model, write_model

FOLDER = "annotations"
"""Of a library; it is also the record of which model said what of an asset."""

_LOG = logging.getLogger(__name__)


class AnswerFile(FileModel):
    """``annotations/<key>.json``.

    Attributes:
        asset: Name of the asset.
        model: The model's name at its endpoint.
        endpoint: The endpoint's address.
        prompt_version: Of the question's words.
        answer: What it said.
        notes: What of it could not be used.
        answers: Answers it took.
        input_tokens: Tokens of the questions.
        output_tokens: Tokens of the answers.
    """

    schema_version: Literal[1] = 1
    asset: str
    model: str
    endpoint: str
    prompt_version: str = PROMPT_VERSION
    answer: Answer
    notes: tuple[str, ...] = ()
    answers: int = Field(ge=1)
    input_tokens: int = Field(ge=0)
    output_tokens: int = Field(ge=0)

    @property
    def usage(self) -> Usage:
        """What it cost."""
        return Usage(answers=self.answers, input_tokens=self.input_tokens, output_tokens=self.output_tokens)


class AnswerMemory:
    """Answers by question and model.

    Args:
        folder: Is made when the first answer comes.
        model: Whose answers.
    """

    def __init__(self, folder: Path, model: str) -> None:
        self._folder = folder
        self._model = model

    def recall(self, subject: Subject) -> AnswerFile | None:
        """The answer to the question about an asset, if there is one; a damaged file is as none."""
        try:
            return read_model(self._path(subject), AnswerFile, what="remembered answer")
        except MissingFileError:
            return None
        except InvalidFileError as error:
            _LOG.warning("%s; asking again", error)
            return None

    def keep(self, subject: Subject, answer: AnswerFile) -> None:
        """Store an answer.

        Raises:
            StorageError: It cannot be written.
        """
        write_model(self._path(subject), answer)

    def _path(self, subject: Subject) -> Path:
        """Named after the asset's shape and look, its views, the words of the question, and the model."""
        digest = hashlib.sha256(canonical_json([self._model, *texts(subject)]))
        for item in subject.asset.visual:
            for array in (item.mesh.vertices, item.mesh.faces):
                digest.update(array.tobytes())
            digest.update(canonical_json(item.rgba))
        for view in subject.views:
            digest.update(hashlib.sha256(view).digest())
        return self._folder / f"{digest.hexdigest()[:40]}.json"
