"""What has been sent and heard so far: all that the view, the lines and the summary tell."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from ghst import Receiver  # type: ignore[import-not-found]
from ghst.protocol import TYPE_MSP_RESPONSE  # type: ignore[import-not-found]
from ghst.telemetry import MSP_CHUNK_SIZE  # type: ignore[import-not-found]
from ghst_tools.simulate.listening import Heard, Listening
from ghst_tools.simulate.msp_client import Answer, MspClient
from ghst_tools.simulate.send import Rhythm, Sent
from ghst_tools.simulate.uplink import Link, Uplink
from ghst_tools.simulate.wire_log import WireLog
from ghst_tools.sniff.listen import Read

_RATE_OVER_S = 2.0
_VTX_EVERY_S = 1.0


class Session:
    """Takes slots and reads as they come, and asks and tells what was ordered.

    `link` is None for a recording. `receiver` is a flight controller that heard everything that
    was sent. `latest` has the last frame of each type, `msp` what was answered. `start_s` is when
    the first slot begins, by the clock of all times. `network`: the port is no serial port; see
    `Listening`.
    """

    def __init__(
        self,
        uplink: Uplink,
        link: Link | None,
        baud: int,
        msp: MspClient,
        vtx: bytes | None = None,
        log: WireLog | None = None,
        start_s: float = 0.0,
        network: bool = False,
    ) -> None:
        self.uplink = uplink
        self.link = link
        self.msp = msp
        self.listening = Listening(baud, network)
        self.network = network
        self.rhythm = Rhythm()
        self.receiver = Receiver()
        self.sent_bursts = 0
        self.sent_bytes = 0
        self.latest: dict[int, Heard] = {}
        self.now_s = self.start_s = start_s
        self._vtx = vtx
        self._vtx_s = start_s
        self._log = log
        self._recent: deque[float] = deque()

    @property
    def time_s(self) -> float:
        """Seconds since the first slot began."""
        return self.now_s - self.start_s

    @property
    def lost(self) -> bool:
        """Whether the link is lost now, on purpose."""
        return self.uplink.faults.lost(self.time_s)

    def waits(self, bursts: int) -> bool:
        """Whether the next one has to wait for the echo of these bursts.

        Over a network it does: an emulated board is slower than real time, and what is sent ahead
        of it would be on its wire back to back. Called from the thread that sends.
        """
        echo = self.listening.echo
        return self.network and echo.present is not False and echo.settled < bursts

    @property
    def recent_rate_hz(self) -> float:
        """Bursts sent a second, over the last two seconds."""
        while self._recent and self._recent[0] <= self.now_s - _RATE_OVER_S:
            self._recent.popleft()
        return len(self._recent) / (min(_RATE_OVER_S, self.time_s) or _RATE_OVER_S)

    def add(
        self, sent: Sequence[Sent], reads: Sequence[Read], now_s: float
    ) -> tuple[list[Heard], list[Answer]]:
        """Take what happened up to `now_s`; returns the frames and answers that came."""
        self.now_s = now_s
        for slot in sent:
            self.rhythm.add(slot)
            if slot.octets:
                self.sent_bursts += 1
                self.sent_bytes += len(slot.octets)
                self.receiver.feed(slot.octets)
                self._recent.append(slot.time_s)
        heard = self.listening.add(sent, reads, now_s)
        if self._log:
            self._log.add(sent, reads, self.listening.echo.present, now_s)
        return self._take(heard)

    def speak(self) -> None:
        """Put what is to be asked or told now into the next slots."""
        if self.lost or not self.rhythm.slots:
            return
        if question := self.msp.question(self.time_s):
            self.uplink.extra.append(question)
        if self._vtx and self.now_s - self._vtx_s >= _VTX_EVERY_S:
            self._vtx_s = self.now_s
            self.uplink.extra.append(self._vtx)

    def finish(self) -> tuple[list[Heard], list[Answer]]:
        """Nothing more comes."""
        found = self._take(self.listening.finish(self.now_s))
        self.msp.give_up()
        if self._log:
            self._log.finish(self.listening.echo.present)
        return found

    def _take(self, heard: list[Heard]) -> tuple[list[Heard], list[Answer]]:
        answers = []
        for frame in heard:
            kind = frame.frame[2]
            self.latest[kind] = frame
            if kind == TYPE_MSP_RESPONSE:
                chunk = frame.frame[3 : 3 + MSP_CHUNK_SIZE]
                if answer := self.msp.take(chunk, self.time_s):
                    answers.append(answer)
        return heard, answers
