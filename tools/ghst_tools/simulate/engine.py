"""Runs a session on a port: sends in one thread, reads in another, shows in this one."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ghst_tools.serial_port import unplugged
from ghst_tools.simulate.joystick import Joystick
from ghst_tools.simulate.keyboard import Keyboard
from ghst_tools.simulate.keys import Keys
from ghst_tools.simulate.output import Output
from ghst_tools.simulate.send import Sender, SenderThread
from ghst_tools.simulate.session import Session
from ghst_tools.simulate.stop import Stop
from ghst_tools.sniff.listen import Listener

# How long the answer to the last frame may be on its way through an adapter.
_LINGER_S = 0.1
_WAIT_S = 0.05
_WAIT_AT_CONTROLS_S = 0.01

MakeSession = Callable[[float], Session]
"""Makes the session whose first slot begins at this time."""


@dataclass
class Controls:
    """What a person holds, if anything."""

    joystick: Joystick | None = None
    keyboard: Keyboard | None = None
    keys: Keys | None = None

    @property
    def ended(self) -> bool:
        """Whether the key to end was pressed."""
        return self.keyboard is not None and self.keyboard.ended

    @property
    def wait_s(self) -> float:
        """How long they may stay unlooked at."""
        return _WAIT_AT_CONTROLS_S if self.joystick or self.keyboard else _WAIT_S

    def poll(self, session: Session) -> None:
        """Look at them."""
        if self.joystick:
            self.joystick.poll()
        if self.keyboard and self.keys:
            for key in self.keys.pressed():
                self.keyboard.press(key)
            session.uplink.faults.lost_by_hand = self.keyboard.lost


def run(line: Any, make_session: MakeSession, controls: Controls, output: Output) -> Session:
    """Send everything there is, until it is over, a key or Ctrl-C; returns what came of it.

    Raises KeyboardInterrupt for Ctrl-C, and `GhstError` if the port or the joystick vanishes,
    when the figures have been shown.
    """
    with Listener(line) as listener, contextlib.ExitStack() as stack:
        start_s = listener.time_s
        session = make_session(start_s)
        thread = SenderThread(
            line, session.uplink, lambda: listener.time_s, start_s, session.waits
        )
        stop = stack.enter_context(Stop())
        stack.callback(_finish, session, output)
        with thread:
            while thread.running and not (controls.ended or stop.asked):
                controls.poll(session)
                _step(line.port, listener, thread.sender, session, output, controls.wait_s)
        # What is on its way still counts.
        while session.waits(thread.sender.bursts):
            _step(line.port, listener, thread.sender, session, output, _WAIT_AT_CONTROLS_S)
        until_s = listener.time_s + _LINGER_S
        while listener.time_s < until_s:
            _step(line.port, listener, thread.sender, session, output, _WAIT_AT_CONTROLS_S)
        if stop.asked:
            raise KeyboardInterrupt
    return session


def _step(
    port: str, listener: Listener, sender: Sender, session: Session, output: Output, wait_s: float
) -> None:
    """Take what there is. What went wrong is raised when the rest has been taken."""
    error: Exception | None = None
    reads, sent = [], []
    try:
        reads = listener.take(wait_s)
    except Exception as found:
        error = found
    try:
        # Behind the reads: of every echo among them it is known what was sent.
        sent = sender.take()
    except Exception as found:
        error = error or found
    heard, answers = session.add(sent, reads, listener.time_s)
    session.speak()
    output.show(session, heard, answers)
    if error:
        with unplugged(port, f"sent for {session.time_s:.1f} s"):
            raise error


def _finish(session: Session, output: Output) -> None:
    heard, answers = session.finish()
    output.show(session, heard, answers)
    output.finish(session)
