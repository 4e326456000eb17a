"""Where a vision-language model is: from options, else from the environment."""

import os
from dataclasses import dataclass
from urllib.parse import urlsplit

from clutter6d.errors import InvalidValueError

KEY_VARIABLE = "OPENAI_API_KEY"
URL_VARIABLE = "OPENAI_BASE_URL"
MODEL_VARIABLE = "CLUTTER6D_VLM_MODEL"
DEFAULT_URL = "https://api.openai.com/v1"


@dataclass(frozen=True, kw_only=True, slots=True)
class EndpointSettings:
    """Where a model is, and how patiently it is asked.

    Attributes:
        model: Its name there.
        base_url: For instance ``http://127.0.0.1:8000/v1``; ``None`` for OpenAI's own.
        timeout_s: For one answer.
        retries: After 408, 409, 429, 5xx, a time-out or a broken connection, each after twice the time, or after what
            the endpoint asks for.
    """

    model: str
    base_url: str | None = None
    timeout_s: float = 120.0
    retries: int = 5

    def __post_init__(self) -> None:
        if self.base_url is not None and not _is_address(self.base_url):
            raise InvalidValueError(
                f"--base-url '{self.base_url}' is no address; give one like http://127.0.0.1:8000/v1"
            )

    @property
    def shown_url(self) -> str:
        """The address without a user's name or a password."""
        parts = urlsplit(self.base_url or DEFAULT_URL)
        port = f":{parts.port}" if parts.port else ""
        return f"{parts.scheme}://{parts.hostname}{port}{parts.path.rstrip('/')}"


def settings_from_environment(
    *, model: str | None, base_url: str | None, timeout_s: float = 120.0, retries: int = 5
) -> EndpointSettings:
    """Settings, with what is not given from ``CLUTTER6D_VLM_MODEL`` and ``OPENAI_BASE_URL``.

    Raises:
        InvalidValueError: No model, or neither an address nor a key.
    """
    model = model or os.environ.get(MODEL_VARIABLE)
    base_url = base_url or os.environ.get(URL_VARIABLE) or None
    if base_url is None and not os.environ.get(KEY_VARIABLE):
        raise InvalidValueError(
            f"no endpoint for --by vlm: give --base-url or {URL_VARIABLE} for one of your own, or set {KEY_VARIABLE}"
        )
    if not model:
        raise InvalidValueError(f"no model for --by vlm: give --model NAME or set {MODEL_VARIABLE}")
    return EndpointSettings(model=model, base_url=base_url, timeout_s=timeout_s, retries=retries)


def _is_address(url: str) -> bool:
    try:
        parts = urlsplit(url)
        return parts.scheme in ("http", "https") and bool(parts.hostname) and parts.port != 0
    except ValueError:
        return False
