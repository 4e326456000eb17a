"""A policy's module that needs a package which is not installed."""

import package_that_nobody_has  # noqa: F401
