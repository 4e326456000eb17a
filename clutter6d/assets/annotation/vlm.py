"""The annotator that shows a vision-language model some views of an asset and asks (paper, "Clutter6D")."""

from dataclasses import dataclass
from typing import Any

from clutter6d.assets.annotation.annotator import AnnotationFailed, Subject, Suggestion, Usage
from clutter6d.assets.annotation.answer import Answer, UnreadableAnswer, answer_schema, parse_answer
from clutter6d.assets.annotation.endpoint import Endpoint, Reply
from clutter6d.assets.annotation.memory import AnswerFile, AnswerMemory
from clutter6d.assets.annotation.prompt import complaint_messages, first_messages
from clutter6d.assets.annotation.volume import plausible_mass_range_kg
from clutter6d.assets.asset import Asset, Provenance
from clutter6d.assets.attribute_change import AttributeChange

QUESTIONS = 2
"""The question, and once more with what was wrong with the answer."""


@dataclass(frozen=True, kw_only=True, slots=True)
class _Judged:
    """An answer as far as it can be read, and what is wrong with it."""

    answer: Answer | None
    complaint: str
    is_only_mass: bool = False


class VlmAnnotator:
    """Asks an endpoint, and remembers what it said.

    Args:
        endpoint: Whom to ask.
        memory: Earlier answers.
    """

    origin: Provenance = "vlm"
    needs_views = True

    def __init__(self, endpoint: Endpoint, memory: AnswerMemory) -> None:
        self._endpoint = endpoint
        self._memory = memory
        self._schema = answer_schema()

    def recall(self, subject: Subject) -> Suggestion | None:
        """What was answered before, if it was."""
        known = self._memory.recall(subject)
        return None if known is None else Suggestion(change=_change(known), notes=known.notes, is_remembered=True)

    def annotate(self, subject: Subject) -> Suggestion:
        """What was answered before, or is answered now.

        A mass out of what its material and volume allow is asked for again, then left out with a note.

        Raises:
            AnnotationFailed: No usable answer.
            InvalidValueError: The endpoint cannot be used.
            StorageError: The answer cannot be kept.
        """
        remembered = self.recall(subject)
        if remembered is not None:
            return remembered
        judged, usage = self._ask(subject)
        if judged.answer is None:
            raise AnnotationFailed("unusable-answer", judged.complaint, usage=usage)
        settings = self._endpoint.settings
        answered = AnswerFile(
            asset=subject.asset.name,
            model=settings.model,
            endpoint=settings.shown_url,
            answer=judged.answer,
            notes=(judged.complaint,) if judged.is_only_mass else (),
            answers=usage.answers,
            input_tokens=usage.input_tokens,
            output_tokens=usage.output_tokens,
        )
        self._memory.keep(subject, answered)
        return Suggestion(change=_change(answered), notes=answered.notes, usage=usage)

    def _ask(self, subject: Subject) -> tuple[_Judged, Usage]:
        """Ask until the answer is good, or as often as is sensible."""
        messages: list[dict[str, Any]] = first_messages(subject)
        judged, usage = _Judged(answer=None, complaint=""), Usage()
        for _ in range(QUESTIONS):
            try:
                reply = self._endpoint.ask(messages, self._schema)
            except AnnotationFailed as failure:
                failure.usage = usage + failure.usage
                raise
            usage += reply.usage
            latest = _judge(reply, subject.asset)
            judged = judged if latest.answer is None and judged.answer is not None else latest
            if not latest.complaint:
                break
            messages += complaint_messages(reply.text, latest.complaint)
        return judged, usage


def _judge(reply: Reply, asset: Asset) -> _Judged:
    if reply.is_cut_off:
        return _Judged(answer=None, complaint="it was cut off before its end; be shorter")
    try:
        answer = parse_answer(reply.text)
    except UnreadableAnswer as error:
        return _Judged(answer=None, complaint=str(error))
    low, high = plausible_mass_range_kg(asset, answer.material)
    if low <= answer.mass_kg <= high:
        return _Judged(answer=answer, complaint="")
    complaint = (
        f"mass_kg {answer.mass_kg:.3g} does not fit {answer.material} of this volume, "
        f"which weighs between {low:.3g} and {high:.3g} kg"
    )
    return _Judged(answer=answer, complaint=complaint, is_only_mass=True)


def _change(known: AnswerFile) -> AttributeChange:
    """What an answer changes; a mass with a note was not believed."""
    answer = known.answer
    return AttributeChange(
        category=answer.category,
        colour=answer.colour,
        material=answer.material,
        mass_kg=None if known.notes else answer.mass_kg,
        friction=answer.friction,
    )
