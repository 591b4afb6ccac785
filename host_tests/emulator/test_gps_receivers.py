"""The simulated GPS receivers, and what of the emulated UART they need."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from ghst_tools.emulator import Board
from ghst_tools.emulator.gps_messages import Place, nav_pvt, nmea_epoch, sentence, ubx

HERE = Place(47.3769052, -8.5417231, 431.987, 12.344, 271.26, satellites=9, pdop=1.37)
UART0, RESETS = 0x40034000, 0x4000C000


@pytest.fixture
def board(micropython_image: Path) -> Board:
    """Powered off: there is no guest that would disturb."""
    return Board(micropython_image)


def test_the_resets_controller_resets_a_uart(board: Board) -> None:
    board.write32(UART0 + 0x24, 26)
    assert board.read32(UART0 + 0x24) == 26
    board.write32(RESETS, 1 << 23)
    assert board.read32(UART0 + 0x24) == 26
    board.write32(RESETS, 1 << 22)
    assert board.read32(UART0 + 0x24) == 0


def test_what_an_epoch_looks_like() -> None:
    assert nmea_epoch(HERE, 33_435_230, "GN") == [
        b"$GNRMC,091715.23,A,4722.61431,N,00832.50339,W,23.995,271.26,130726,,,A*5A\r\n",
        b"$GNVTG,271.26,T,,M,23.995,N,44.438,K,A*28\r\n",
        b"$GNGGA,091715.23,4722.61431,N,00832.50339,W,1,09,0.90,432.0,M,47.9,M,,*52\r\n",
        b"$GNGSA,A,3,01,02,03,04,05,06,07,08,09,,,,1.37,0.90,1.10*11\r\n",
        b"$GNGSA,A,1,,,,,,,,,,,,,1.37,0.90,1.10*12\r\n",
    ]
    many = nmea_epoch(HERE._replace(satellites=14), 0)
    assert many[3:] == [
        sentence("GPGSA,A,3,01,02,03,04,05,06,07,08,09,10,11,12,1.37,0.90,1.10"),
        sentence("GPGSA,A,3,13,14,,,,,,,,,,,1.37,0.90,1.10"),
    ]
    assert len(nmea_epoch(HERE, 0, gsa=False)) == 3
    nowhere = nmea_epoch(HERE._replace(fix=0, satellites=0), 0)
    assert nowhere[0] == sentence("GPRMC,000000.00,V,,,,,,,130726,,,N")
    assert nowhere[2] == sentence("GPGGA,000000.00,,,,,0,00,0.90,,,,,,")


def test_what_a_navigation_solution_looks_like() -> None:
    frame = nav_pvt(HERE, 33_435_230)
    assert (len(frame), frame[:6]) == (100, b"\xb5\x62\x01\x07\x5c\x00")
    payload = frame[6:-2]
    assert ubx(1, 7, payload) == frame
    assert struct.unpack_from("<I", payload)[0] == 33_435_230
    assert tuple(payload[20:24]) == (3, 1, 0, 9)
    assert struct.unpack_from("<iiii", payload, 24) == (-85417231, 473769052, 479887, 431987)
    assert struct.unpack_from("<ii", payload, 60) == (12344, 27126000)
    assert struct.unpack_from("<II", payload, 40) == (1600, 2400)
    assert struct.unpack_from("<HB", payload, 76) == (137, 0)
    payload = nav_pvt(HERE._replace(fix=0, valid=False), 0)[6:-2]
    assert struct.unpack_from("<II", payload, 40) == (0xFFFFFFFF,) * 2
    assert payload[78] == 1
