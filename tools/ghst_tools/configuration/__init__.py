"""A board's configuration on the host: checked by the code that the board runs, and documented."""
