"""One decision of a reviewer, as a line of the journal keeps it."""

import secrets
from datetime import UTC, datetime
from typing import Annotated, Literal

from pydantic import AwareDatetime, Field

from clutter6d.assets.asset_file import AttributesModel
from clutter6d.schema import FileModel

Verdict = Literal["accept", "edit", "reject"]
"""What a reviewer may decide of an asset."""

EditableField = Literal["category", "colour", "material", "mass_kg", "friction"]

MAX_REASON_LENGTH = 500
MAX_NAME_LENGTH = 80

_Hash = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
_EntryId = Annotated[str, Field(pattern=r"^[0-9a-f]{16}$")]


class FieldChange(FileModel):
    """One changed value."""

    field: EditableField
    before: str | float
    after: str | float


class FormerValues(FileModel):
    """What an edit replaced, whole, so that it can be taken back to the bit.

    Attributes:
        attributes: With where each came from.
        mass_kg: Mass.
        inertia: Row by row [kg m^2]; stored because scaling it back would round.
    """

    attributes: AttributesModel
    mass_kg: float
    inertia: tuple[float, ...] = Field(min_length=9, max_length=9)


class ReviewEntry(FileModel):
    """A decision, or the taking back of one.

    Attributes:
        entry_id: Names the entry.
        when: In UTC.
        who: Name of the reviewer.
        decision: What was decided; ``undo`` takes another entry back.
        asset_name: Name of the asset.
        asset_hash: Content hash of the version that the library held before.
        result_hash: Content hash of the version that it holds afterwards; another one if an edit was made or undone.
        changes: What an edit changed.
        former: What an edit replaced.
        reason: Why, if the reviewer said so.
        undoes: The entry that an undo takes back.
    """

    schema_version: Literal[1] = 1
    entry_id: _EntryId = Field(default_factory=lambda: secrets.token_hex(8))
    when: AwareDatetime = Field(default_factory=lambda: datetime.now(UTC))
    who: str = Field(min_length=1, max_length=MAX_NAME_LENGTH)
    decision: Verdict | Literal["undo"]
    asset_name: str
    asset_hash: _Hash
    result_hash: _Hash
    changes: tuple[FieldChange, ...] = ()
    former: FormerValues | None = None
    reason: str = Field(default="", max_length=MAX_REASON_LENGTH)
    undoes: _EntryId | Literal[""] = ""
