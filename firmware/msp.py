"""`Msp`: takes the requests of the pilot's radio; what answers is loaded with the first one."""


class Msp:
    """The requests to an `Application`, and the way of the replies.

    `state`, the values that go out, and `responder`, to add commands to: using one of them loads
    `ghst.msp` as a request does. From .mpy files that takes a tenth of a second, once.
    """

    def __init__(self, application):
        self._application = application
        self._answers = None

    @property
    def pending(self):
        """Whether there are chunks of a reply left to send."""
        return self._answers is not None and self.responder.reply.pending

    @property
    def state(self):
        """The `ghst.msp_state.State` that the answers come from."""
        return self._loaded().state

    @property
    def responder(self):
        """The `ghst.msp.Responder`."""
        return self._loaded().responder

    def feed(self, payload):
        """Takes the ten bytes of a request frame."""
        answers = self._loaded()
        answers.refresh()
        answers.responder.feed(payload)

    def next_chunk(self, chunk):
        """Writes six bytes for a response frame; only while `pending`."""
        self.responder.next_chunk(chunk)

    def discard(self):
        """Drops a reply that is under way."""
        if self._answers is not None:
            self.responder.discard()

    @property
    def answered(self):
        """Requests that got an answer."""
        return 0 if self._answers is None else self.responder.answered

    @property
    def errors(self):
        """Requests that got an error for an answer."""
        return 0 if self._answers is None else self.responder.errors

    def describe(self):
        """Returns what has been answered, in a line."""
        return f"{self.answered} answered, {self.errors} errors"

    def _loaded(self):
        if self._answers is None:
            from firmware.msp_answers import Answers

            self._answers = Answers(self._application)
        return self._answers
