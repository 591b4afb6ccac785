"""yamspy, a public MSP library for ground stations, decodes what the library answers.

Its serial port is pyserial's loopback: what is written there is what yamspy reads. MSP's serial
framing, which GHST has not, is put around the payloads that came in chunks.
"""

from collections.abc import Callable, Iterator
from functools import reduce
from operator import xor

import pytest
import serial
from behaviour.msp_support import payloads, v1, v2
from msp_model import V1, V2, read_reply
from yamspy import MSPy

from ghst import crc8
from ghst.msp import Responder
from ghst.msp_commands import answer
from ghst.msp_state import State

VALUES = {
    "craft_name": b"Kestrel",
    "board_identifier": b"RP20",
    "target_name": b"RPI_PICO",
    "board_name": b"Pico",
    "manufacturer_id": b"RPI",
    "build_date": b"Jan 31 2025",
    "build_time": b"23:59:58",
    "build_revision": b"0123abc",
    "uid": bytes.fromhex("e6614103e72b3a2f00000000"),
    "version": (1, 2, 3),
    "pulses": [4000 + 250 * channel for channel in range(16)],
    "armed": True,
    "rssi_percent": 50,
    "cycle_time_us": 1000,
    "load_percent": 37,
    "i2c_errors": 7,
    "voltage_mv": 14344,
    "current_ma": 29604,
    "consumed_mah": 1230,
    "gps_fix": True,
    "satellites": 17,
    "latitude_e7": 473566094,
    "longitude_e7": -85190237,
    "gps_alt_m": 408,
    "speed_cm_s": 1234,
    "course_decideg": 2705,
    "home_distance_m": 1230,
    "home_direction_decideg": 1805,
    "gps_updates": 3,
    "heading_decideg": -905,
    "roll_decideg": -123,
    "pitch_decideg": 45,
    "altitude_cm": -1234,
    "vario_cm_s": -50,
}

Station = Callable[[int], MSPy]


@pytest.fixture(params=[V1, V2], ids=["v1", "v2"])
def ask(request: pytest.FixtureRequest) -> Iterator[Station]:
    """Asks for a message in MSP v1 or v2 and returns yamspy after it decoded the answer."""
    state = State()
    for name, value in VALUES.items():
        assert hasattr(state, name)
        setattr(state, name, value)
    responder = Responder()
    answer(responder, state)
    station = MSPy("no device", logfilename=None, loglevel="ERROR")
    station.INAV = False  # what it finds out itself when it opens a port
    with serial.serial_for_url("loop://", timeout=0) as station.conn:

        def ask(number: int) -> MSPy:
            data = _payload(responder, number, request.param)
            station.conn.write(_serial_frame(number, data, request.param))
            left_over = station.process_recv_data(station.receive_msg())
            assert left_over == _UNREAD.get(number, 0)
            return station

        yield ask


_UNREAD = {5: 7, 88: 15, 101: 11, 106: 2, 109: 2, 4: 9}
"""Bytes that yamspy leaves alone in these messages: all others it reads to the end."""


def _payload(responder: Responder, number: int, version: int) -> bytes:
    message = v1(number) if version == V1 else v2(number)
    (payload,) = payloads(message, version)
    responder.feed(payload)
    chunks = []
    chunk = bytearray(6)
    while responder.next_chunk(chunk):
        chunks.append(bytes(chunk))
    reply = read_reply(chunks)
    assert reply.command == number
    return reply.data


def _serial_frame(number: int, data: bytes, version: int) -> bytes:
    if version == V1:
        body = bytes((len(data), number)) + data
        return b"$M>" + body + bytes((reduce(xor, body),))
    body = bytes((0, number, 0, len(data), 0)) + data
    # yamspy waits for one byte more than a v2 frame has.
    return b"$X>" + body + bytes((crc8(body, 0, len(body)), 0))


def test_identity(ask: Station) -> None:
    for number in (1, 2, 3, 4, 5, 10, 160):
        config = ask(number).CONFIG
    assert config["mspProtocolVersion"] == 0
    assert config["apiVersion"] == "1.44.0"
    assert config["flightControllerIdentifier"] == "GHMP"
    assert config["flightControllerVersion"] == "1.2.3"
    assert config["boardIdentifier"] == "RP20"
    assert config["boardType"] == 0
    assert config["commCapabilities"] == 1
    assert config["targetName"] == "RPI_PICO"
    assert config["boardName"] == "Pico"
    assert config["manufacturerId"] == "RPI"
    assert config["signature"] == [0] * 32
    assert config["mcuTypeId"] == 255
    assert config["buildInfo"] == "Jan 31 2025 23:59:58"
    assert config["name"] == "Kestrel"
    assert config["uid"] == [0x034161E6, 0x2F3A2BE7, 0]


def test_status(ask: Station) -> None:
    config = ask(101).CONFIG
    assert (config["cycleTime"], config["i2cError"]) == (1000, 7)
    assert (config["activeSensors"], config["mode"], config["profile"]) == (14, 1, 0)


def test_channels(ask: Station) -> None:
    assert ask(105).RC["channels"] == [(4002 + 250 * channel) // 4 for channel in range(16)]


def test_gps(ask: Station) -> None:
    ask(106)
    gps = ask(107).GPS_DATA
    assert (gps["fix"], gps["numSat"]) == (1, 17)
    assert (gps["lat"], gps["lon"], gps["alt"]) == (473566094, -85190237, 408)
    assert (gps["speed"], gps["ground_course"]) == (1234, 2705)
    assert (gps["distanceToHome"], gps["directionToHome"], gps["update"]) == (1230, 180, 1)


def test_attitude_and_altitude(ask: Station) -> None:
    ask(108)
    data = ask(109).SENSOR_DATA
    assert list(data["kinematics"]) == [-12.3, 4.5, 269]
    assert data["altitude"] == -12.34


def test_battery(ask: Station) -> None:
    analog = ask(110).ANALOG
    assert (analog["voltage"], analog["amperage"]) == (14.34, 29.6)
    assert (analog["mAhdrawn"], analog["rssi"]) == (1230, 512)


def test_video_transmitter(ask: Station) -> None:
    # yamspy knows the message and reads none of it.
    ask(88)
