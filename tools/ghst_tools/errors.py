"""The one exception that means "the user can put this right"."""


class GhstError(Exception):
    """A user's mistake or a missing prerequisite, told in one line.

    The message says what is wrong, where, and what to do about it. Commands print it without a
    traceback; anything else that is raised is a defect of the tools and keeps its traceback.
    """
