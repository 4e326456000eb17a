"""What a command says of a user's mistake."""


def assert_one_line(error: str, said: str) -> None:
    """The error is one line, and says something."""
    assert said in error
    assert error.count("\n") == 1
