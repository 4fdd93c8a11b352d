"""What every exception of this package is. Those that lensd answers with are in `lens_errors`, those of the way there in
`client_errors`; all of them can be had as `lensd.NAME`."""
from __future__ import annotations

from typing import Any, ClassVar, Optional


class LensdError(Exception):
    """One line for people (`message`: what, why, what to do) and what programs want to know; None where nothing is known.

    `exit_status` and `code` are what lensctl ends with for the same error; `details` is all that lensd said."""

    error_name: ClassVar[str] = ""
    code: ClassVar[str] = "internal"
    exit_status: ClassVar[int] = 70
    lens: Optional[str] = None
    axis: Optional[str] = None
    parameter: Optional[str] = None
    minimum: Optional[float] = None
    maximum: Optional[float] = None
    unit: Optional[str] = None

    def __init__(self, message: str, **details: Any) -> None:
        super().__init__(message)
        self.message = message
        self.details = details
