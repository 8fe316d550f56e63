"""The one exception that stands for a user's mistake."""


class UserError(Exception):
    """A mistake of the user's, told in one sentence that names the file or setting and what to do.

    Commands print it without a traceback and end with exit code 2; library callers catch it like any exception.
    """
