"""What a vision-language model has to answer, as a schema, and how its text is read."""

import re
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from clutter6d.assets.attribute_change import MAX_FRICTION, MAX_MASS_KG
from clutter6d.assets.materials import COLOURS, MATERIALS
from clutter6d.assets.slug import slugify

MAX_ANSWER_CHARS = 20_000
_MAX_CATEGORY_WORDS = 4
_FENCED = re.compile(r"```(?:json)?\s*(\{.*\})\s*```", re.DOTALL)


class UnreadableAnswer(ValueError):
    """An answer that does not fit the schema; says what is wrong with it, to be read by the model."""


def _category(value: str) -> str:
    slug = slugify(value)
    if not re.search("[a-zA-Z]", value) or slug.count("-") >= _MAX_CATEGORY_WORDS:
        raise ValueError(f"must name the object in 1 to {_MAX_CATEGORY_WORDS} English words")
    return slug


def _colour(value: str) -> str:
    if value.lower() not in COLOURS:
        raise ValueError(f"must be one of {', '.join(COLOURS)}")
    return value.lower()


def _material(value: str) -> str:
    if value.lower() not in MATERIALS:
        raise ValueError(f"must be one of {', '.join(MATERIALS)}")
    return value.lower()


def _mass(value: float) -> float:
    if not 0 < value <= MAX_MASS_KG:
        raise ValueError(f"must be above 0 and at most {MAX_MASS_KG:g} kg")
    return value


def _friction(value: float) -> float:
    if not 0 < value <= MAX_FRICTION:
        raise ValueError(f"must be above 0 and at most {MAX_FRICTION:g}")
    return value


class Answer(BaseModel):
    """The answer. Ranges are checked here and not in the schema, which not every endpoint can enforce."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    reasoning: str = Field(description="In two sentences: what it is, what of, hollow or full, and so how heavy.")
    category: Annotated[str, AfterValidator(_category)] = Field(description="What it is, in 1 to 4 English words.")
    colour: Annotated[str, AfterValidator(_colour)] = Field(
        description="Main colour.", json_schema_extra={"enum": list(COLOURS)}
    )
    material: Annotated[str, AfterValidator(_material)] = Field(
        description="Material of most of its mass.", json_schema_extra={"enum": list(MATERIALS)}
    )
    mass_kg: Annotated[float, AfterValidator(_mass)] = Field(description="Mass of the real object, in kilograms.")
    friction: Annotated[float, AfterValidator(_friction)] = Field(
        description="Coefficient of sliding friction on a smooth wooden table."
    )


def answer_schema() -> dict[str, Any]:
    """The JSON schema that is sent along: types, choices and descriptions only."""
    return Answer.model_json_schema()


def parse_answer(text: str) -> Answer:
    """Read a model's text: JSON, alone or in a fenced block.

    Raises:
        UnreadableAnswer: It is not what was asked for.
    """
    if len(text) > MAX_ANSWER_CHARS:
        raise UnreadableAnswer(f"the answer has {len(text):,} characters; at most {MAX_ANSWER_CHARS:,} are read")
    fenced = _FENCED.search(text)
    try:
        return Answer.model_validate_json(fenced[1] if fenced else text)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        problem = first["msg"].removeprefix("Value error, ")
        raise UnreadableAnswer(f"{where}: {problem}" if where else f"not JSON: {problem}") from None
