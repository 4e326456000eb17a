"""An OpenAI-compatible endpoint, hosted or local: one question, one answer, every failure with its reason.

The key is held by the client alone: it is never written, and taken out of whatever an endpoint says.
"""

import logging
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from clutter6d.assets.annotation.annotator import AnnotationFailed, Usage
from clutter6d.assets.annotation.endpoint_settings import DEFAULT_URL, KEY_VARIABLE, EndpointSettings
from clutter6d.errors import InvalidValueError, MissingDependencyError

NO_KEY = "none"
"""Sent to an endpoint of one's own when there is no key; such endpoints do not look at it."""
_FORMATS = ("json_schema", "json_object", "text")
_MAX_DETAIL = 200


@dataclass(frozen=True, kw_only=True, slots=True)
class Reply:
    """What a model said; ``is_cut_off`` if it was stopped before its end."""

    text: str
    is_cut_off: bool
    usage: Usage


class Endpoint:
    """A client of one endpoint; safe to use from several threads.

    Args:
        settings: Where, and which model.
        key: The key; by default ``OPENAI_API_KEY``.

    Raises:
        MissingDependencyError: The package ``openai`` is not installed.
    """

    def __init__(self, settings: EndpointSettings, key: str | None = None) -> None:
        try:
            import openai
        except ImportError:
            raise MissingDependencyError('--by vlm needs openai; run: pip install "clutter6d[vlm]"') from None
        self.settings = settings
        self._key = key or os.environ.get(KEY_VARIABLE) or NO_KEY
        self._format = _FORMATS[0]
        self._openai = openai
        _keep_quiet()
        client = openai.OpenAI(
            api_key=self._key,
            base_url=settings.base_url or DEFAULT_URL,
            timeout=settings.timeout_s,
            max_retries=settings.retries,
        )
        self._create: Callable[..., Any] = client.chat.completions.create

    def ask(self, messages: Sequence[dict[str, Any]], schema: dict[str, Any]) -> Reply:
        """Ask one question.

        Args:
            messages: The conversation so far, as the protocol has it.
            schema: JSON schema of the answer; an endpoint that does not know schemas is asked for plain JSON.

        Raises:
            AnnotationFailed: No answer to this question.
            InvalidValueError: The endpoint takes no question at all from us: wrong key, model or address.
        """
        tried = self._format
        try:
            completion = self._create(
                model=self.settings.model, messages=list(messages), **_format_argument(tried, schema)
            )
        except self._openai.BadRequestError as error:
            if not self._steps_down(tried, str(error)):
                raise self._failure(error) from None
            return self.ask(messages, schema)
        except self._openai.OpenAIError as error:
            raise self._failure(error) from None
        except ValueError as error:
            raise self._no_completion(str(error)) from None
        return self._read(completion)

    def _read(self, completion: Any) -> Reply:
        choices = getattr(completion, "choices", None)
        if not choices or getattr(choices[0], "message", None) is None:
            raise self._no_completion("it holds no choices; is the address that of an OpenAI-compatible API?")
        choice, counted = choices[0], getattr(completion, "usage", None)
        usage = Usage(
            answers=1,
            input_tokens=getattr(counted, "prompt_tokens", 0) or 0,
            output_tokens=getattr(counted, "completion_tokens", 0) or 0,
        )
        if getattr(choice.message, "refusal", None) or choice.finish_reason == "content_filter":
            raise AnnotationFailed("refused", "the model will not describe it", usage=usage)
        return Reply(text=choice.message.content or "", is_cut_off=choice.finish_reason == "length", usage=usage)

    def _steps_down(self, tried: str, complaint: str) -> bool:
        """Whether a plainer form of answer is left to ask for, after a complaint about the form."""
        if tried == _FORMATS[-1] or not any(word in complaint for word in ("response_format", "json_schema", "schema")):
            return False
        self._format = _FORMATS[_FORMATS.index(tried) + 1]
        return True

    def _failure(self, error: Exception) -> Exception:
        """An error of the client, as one of ours."""
        said, where = self._said(error), self.settings.shown_url
        status = getattr(error, "status_code", None)
        if status in (401, 403):
            return InvalidValueError(f"{where} refuses the key ({status}): {said}; set {KEY_VARIABLE} to a valid one")
        if status == 404:
            return InvalidValueError(
                f"{where} knows no model '{self.settings.model}' (404): {said}; see --model, --base-url"
            )
        if isinstance(error, self._openai.APITimeoutError):
            return AnnotationFailed("timed-out", f"no answer in {self.settings.timeout_s:g} s", is_of_endpoint=True)
        if status is None:
            return AnnotationFailed("unreachable", f"{where}: {said}", is_of_endpoint=True)
        reason = {429: "rate-limited"}.get(status, "server-error" if status >= 500 else "question-refused")
        return AnnotationFailed(reason, f"{status}: {said}", is_of_endpoint=True)

    def _no_completion(self, problem: str) -> AnnotationFailed:
        detail = f"{self.settings.shown_url} answered something else than a completion: {problem}"
        return AnnotationFailed("no-completion", " ".join(detail.split())[:_MAX_DETAIL], is_of_endpoint=True)

    def _said(self, error: Exception) -> str:
        """What the endpoint said, short, on one line, without the key."""
        cause = f" ({error.__cause__})" if error.__cause__ is not None else ""
        line = " ".join(f"{getattr(error, 'message', error)}{cause}".split())
        return line.replace(self._key, "***")[:_MAX_DETAIL].rstrip(".")


def _format_argument(form: str, schema: dict[str, Any]) -> dict[str, Any]:
    if form == "json_schema":
        described = {"name": "attributes", "strict": True, "schema": schema}
        return {"response_format": {"type": "json_schema", "json_schema": described}}
    return {"response_format": {"type": "json_object"}} if form == "json_object" else {}


def _keep_quiet() -> None:
    """The client's debug messages hold whole pictures; ours say what matters."""
    for name in ("openai", "httpx2", "httpcore2", "httpx", "httpcore"):
        logging.getLogger(name).setLevel(logging.WARNING)
