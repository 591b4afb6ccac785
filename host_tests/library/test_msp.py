"""MSP against the independent model: requests in disorder, random bytes, replies of any kind."""

from collections.abc import Callable

import pytest
from behaviour import msp_random
from hypothesis import given, settings
from hypothesis import strategies as st
from msp_model import ERROR, START, V1, V2, Assembly, Message, read_reply, reply_chunks
from targets import Target

from ghst.msp import COMPLETE, OVERSIZED, UNFINISHED, Request, Responder
from ghst.msp_commands import answer
from ghst.msp_reply import REPLY_SIZE
from ghst.msp_state import State

COUNTERS = ("sequence_errors", "restarts", "orphans", "malformed")


@st.composite
def messages(draw: st.DrawFn) -> list[bytes]:
    """The payloads of one whole request, sometimes larger than the buffer."""
    data = draw(st.binary(max_size=40) | st.integers(0, 600).map(bytes))
    version = draw(st.sampled_from((V1, V2, 0)))
    command = draw(st.sampled_from((1, 4, 89, 101, 250)) | st.integers(0, 255))
    if version != V1:
        body = bytes((draw(st.integers(0, 255)), command, draw(st.integers(0, 1))))
        body += len(data).to_bytes(2, "little")
    elif len(data) < 255 and draw(st.booleans()):
        body = bytes((len(data), command))
    else:
        body = bytes((255, command)) + len(data).to_bytes(2, "little")
    body += data + draw(st.binary(max_size=1))
    first = draw(st.integers(0, 15))
    return [
        bytes([version | (0 if at else START) | (first + at // 9) % 16])
        + body[at : at + 9].ljust(9, b"\0")
        for at in range(0, len(body), 9)
    ]


@st.composite
def disorder(draw: st.DrawFn) -> list[bytes]:
    """Requests with chunks lost, repeated, swapped or cut off, and garbage between them."""
    chunks: list[bytes] = []
    for part in draw(st.lists(messages() | st.lists(st.binary(max_size=12)), max_size=8)):
        part = list(part)
        if part:
            at = draw(st.integers(0, len(part) - 1))
            match draw(st.sampled_from(("", "", "lose", "repeat", "swap", "cut", "restart"))):
                case "lose":
                    del part[at]
                case "repeat":
                    part.insert(at, part[at])
                case "swap":
                    part[at], part[0] = part[0], part[at]
                case "cut":
                    part[at] = part[at][: draw(st.integers(0, 10))]
                case "restart":
                    part = part[:at] + part
        chunks += part
    return chunks


@settings(max_examples=500, deadline=None, derandomize=True)
@given(disorder())
def test_requests(chunks: list[bytes]) -> None:
    request, model = Request(), Assembly()
    for chunk in chunks:
        refusals = len(model.refused)
        wanted = model.feed(chunk)
        outcome = request.feed(chunk)
        if wanted is None:
            assert outcome == UNFINISHED
            continue
        assert outcome == (COMPLETE if len(model.refused) == refusals else OVERSIZED)
        assert (request.version, request.command) == (wanted.version, wanted.command)
        assert (request.flags, request.size) == (wanted.flags, wanted.size)
        if outcome == COMPLETE:
            assert bytes(request.data[: request.size]) == wanted.data
    assert request.oversized == len(model.refused)
    assert len(request.data) == 512
    for name in COUNTERS:
        assert getattr(request, name) == getattr(model, name), name


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.lists(messages(), min_size=1, max_size=6))
def test_whole_requests_all_arrive(requests: list[list[bytes]]) -> None:
    model = Assembly()
    request = Request()
    outcomes = [request.feed(chunk) for chunks in requests for chunk in chunks]
    for chunks in requests:
        for chunk in chunks:
            model.feed(chunk)
    assert outcomes.count(COMPLETE) + outcomes.count(OVERSIZED) == len(requests)
    assert request.sequence_errors == request.restarts == request.malformed == 0


@settings(max_examples=300, deadline=None, derandomize=True)
@given(
    st.sampled_from((1, 2)),
    st.integers(0, 255),
    st.integers(0, REPLY_SIZE + 3).map(lambda size: bytes(at & 255 for at in range(size)))
    | st.binary(max_size=30),
    st.booleans(),
    st.integers(0, 20),
)
def test_replies(version: int, command: int, data: bytes, fails: bool, before: int) -> None:
    def handler(request: Request, reply: object) -> bool:
        reply.text(data)  # type: ignore[attr-defined]
        return not fails

    responder = Responder()
    responder.command(command, handler)
    chunk = bytearray(6)
    for _ in range(before):
        responder.reply.begin(1, 0)
        responder.reply.send()
        assert responder.next_chunk(chunk)
    header = bytes([V2 | START, 0, command]) if version == 2 else bytes([V1 | START, 0, command])
    assert responder.feed(header + bytes(7))
    error = fails or len(data) > REPLY_SIZE
    chunks = []
    while responder.next_chunk(chunk):
        chunks.append(bytes(chunk))
    assert chunks == reply_chunks(version, command, b"" if error else data, error, before)
    found = read_reply(chunks)
    assert bool(chunks[0][0] & ERROR) == error
    assert found == Message(version, 0, command, len(found.data), b"" if error else data)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(disorder(), st.lists(st.integers(0, 3), min_size=1))
def test_a_flight_controller_in_disorder(chunks: list[bytes], slots: list[int]) -> None:
    """Whatever comes in, nothing is raised, and the next question is answered in full."""
    responder = Responder()
    answer(responder, State(), None, lambda: True)
    chunk = bytearray(6)
    sent: list[bytes] = []
    for at, payload in enumerate(chunks):
        responder.feed(payload)
        for _ in range(slots[at % len(slots)]):
            if responder.next_chunk(chunk):
                sent.append(bytes(chunk))
    assert responder.feed(bytes([V1 | START, 1, 160]) + bytes(7))
    last = len(sent)
    while responder.next_chunk(chunk):
        sent.append(bytes(chunk))
    assert [status[0] & 15 for status in sent] == [at % 16 for at in range(len(sent))]
    assert responder.last_error is None
    begun = sum(bool(status[0] & START) for status in sent)
    assert begun <= responder.answered + responder.errors
    assert read_reply(sent[last:]) == Message(1, 0, 160, 12, bytes(12))


BLOCKS = {
    "fill_with_noise": {"cpython": 300, "unix": 1500, "rp2040": 1},
    "fill_with_messages": {"cpython": 300, "unix": 1500, "rp2040": 2},
}
"""Of 64 payloads each."""

SEED = 20211107


def _expected(fill: str, blocks: int) -> list[int]:
    """What `msp_random.run` has to return, from the model; replies from CPython's handlers."""
    make: Callable[[bytearray, int, int], tuple[int, int]] = getattr(msp_random, fill)
    model = Assembly()
    known = _Answers()
    block = bytearray(10 * msp_random.PAYLOADS)
    seed, sequence = SEED, 0
    sent = total = answered = errors = replaced = repeated = 0
    waiting: list[bytes] = []
    under_way: tuple[int, int] | None = None
    for _ in range(blocks):
        seed, sequence = make(block, seed, sequence)
        for at in range(0, len(block), 10):
            refusals = len(model.refused)
            message = model.feed(bytes(block[at : at + 10]))
            if message is not None:
                key = (message.version, message.command)
                if waiting and key == under_way and not message.size:
                    repeated += 1
                else:
                    replaced += bool(waiting)
                    data = known.answer(message) if len(model.refused) == refusals else None
                    answered += data is not None
                    errors += data is None
                    under_way = key
                    waiting = []
                    if not message.flags & 1:
                        waiting = reply_chunks(*key, data or b"", data is None, sent)
            for _ in range(block[at + 9] & 3):
                if waiting:
                    for value in waiting.pop(0):
                        total = total * 31 + value & 0xFFFFF
                    sent += 1
    return [
        sent,
        total,
        model.sequence_errors,
        model.restarts,
        len(model.refused),
        model.orphans,
        model.malformed,
        answered,
        errors,
        replaced,
        repeated,
    ]


class _Answers:
    """Answers single messages with a responder that has nothing else to do."""

    def __init__(self) -> None:
        self.responder = Responder()
        answer(self.responder, State(), None, lambda: True)

    def answer(self, message: Message) -> bytes | None:
        """The payload of the answer, None for an error."""
        body = bytes((0, message.command & 255, message.command >> 8))
        body += message.size.to_bytes(2, "little") + message.data
        for at in range(0, len(body), 9):
            status = V2 | (0 if at else START) | at // 9 % 16
            self.responder.feed(bytes([status]) + body[at : at + 9])
        chunk = bytearray(6)
        chunks = []
        while self.responder.next_chunk(chunk):
            chunks.append(bytes(chunk))
        return None if chunks[0][0] & ERROR else read_reply(chunks).data


@pytest.mark.parametrize("fill", BLOCKS)
def test_random_payloads(target: Target, fill: str, request: pytest.FixtureRequest) -> None:
    blocks = BLOCKS[fill][request.node.callspec.params["target"]]
    found = target.evaluate("msp_random", f"run({fill}, {blocks}, {SEED})")
    assert found == _expected(fill, blocks)


def test_the_random_payloads_reach_every_counter() -> None:
    assert min(_expected("fill_with_messages", 300)) > 5
