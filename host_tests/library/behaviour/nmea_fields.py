"""The fields of NMEA sentences: numbers, positions, kinds and talkers."""

from array import array

from firmware.sensors.nmea_fields import (
    GGA,
    GSA,
    OTHER,
    RMC,
    UNKNOWN,
    VTG,
    WRONG,
    number,
    position,
    split,
)

from behaviour.support import equal, sample

# Near Zurich's main station.
WHERE = "4722.6143,N,00832.5034,E"
LAT_E7 = 473_769_050
LON_E7 = 85_417_233


def _number(text, decimals):
    data = b"," + text.encode() + b","
    return number(data, bytes((0, 1, len(data))), 1, decimals)


def numbers():
    equal(_number("0", 0), 0)
    equal(_number("12", 0), 12)
    equal(_number("12", 2), 1200)
    equal(_number("12.", 1), 120)
    equal(_number(".5", 1), 5)
    equal(_number("-.5", 1), -5)
    equal(_number("007.25", 2), 725)
    equal(_number("091715.00", 3), 91_715_000)
    equal(_number("235959.99", 3), 235_959_990)
    equal(_number("", 2), UNKNOWN)


def numbers_are_rounded_half_up():
    for text, wanted in (
        ("1.4", 1),
        ("1.5", 2),
        ("1.49999999999", 1),
        ("2.5", 3),
        ("-1.5", -1),
        ("-1.500", -1),
        ("-1.5001", -2),
        ("-1.6", -2),
        ("-1.4", -1),
        ("-0.5", 0),
        ("0.999", 1),
        ("9.99", 10),
    ):
        equal(_number(text, 0), wanted, text)
    equal(_number("271.26", 1), 2713)
    equal(_number("271.249", 1), 2712)
    equal(_number("0.0005", 3), 1)


def what_is_no_number():
    for text in sample(
        ("-", ".", "-.", "1.2.3", "1-2", "--1", "+1", " 1", "1 ", "1e3", "x", "1x"), 6
    ):
        equal(_number(text, 1), WRONG, text)


def numbers_that_are_too_large():
    equal(_number("259999999", 0), 259_999_999)
    for text, decimals in (("260000000", 0), ("260000", 3), ("26000000.0", 1), ("9" * 30, 0)):
        equal(_number(text, decimals), WRONG, text)
    equal(_number("1." + "9" * 40, 3), 2000)


def _position(text):
    data = ("GPXXX," + text).encode()
    starts = bytearray(25)
    split(data, len(data), starts)
    target = array("i", (0, 0))
    state = position(data, starts, 1, target)
    return state, target[0], target[1]


def positions():
    for text, lat_e7, lon_e7 in (
        (WHERE, LAT_E7, LON_E7),
        ("0000.0000,N,00000.0000,E", 0, 0),
        ("0000.0000,S,00000.0000,W", 0, 0),
        ("9000.0000,N,18000.0000,E", 900_000_000, 1_800_000_000),
        ("9000.0000,S,18000.0000,W", -900_000_000, -1_800_000_000),
        ("3351.5600,S,15112.5400,E", -338_593_333, 1_512_090_000),
        ("3403.1320,N,11814.6220,W", 340_522_000, -1_182_437_000),
        # Any number of decimals, and none.
        ("4722,N,00832,E", 473_666_667, 85_333_333),
        ("4722.,N,832.,E", 473_666_667, 85_333_333),
        ("4722.6,N,00832.5,E", 473_766_667, 85_416_667),
        ("4722.614312345678,N,00832.503399999999,E", 473_769_052, 85_417_233),
        # 59.99999999 minutes are all but a degree: half a step below it is rounded up.
        ("4759.9999999,N,00859.9999970,E", 480_000_000, 90_000_000),
        ("4759.9999970,N,00859.9999969,E", 480_000_000, 89_999_999),
        ("0000.00000300,N,00000.0000029999999,W", 1, 0),
    ):
        equal(_position(text), (1, lat_e7, lon_e7), text)


def every_minute_is_a_sixtieth():
    for minute in sample(range(60), 6):
        for rest in sample((0, 1, 4999999, 9999999), 2):
            text = f"12{minute:02}.{rest:07},N,123{minute:02}.{rest:07},W"
            # The nearest, halves up, in whole numbers beyond 32 bits.
            part = (minute * 10**7 + rest + 30) // 60
            equal(_position(text), (1, 12 * 10**7 + part, -123 * 10**7 - part), text)


def positions_that_cannot_be():
    for text in sample(
        (
            "9000.0001,N,00000.0000,E",
            "9100.0000,N,00000.0000,E",
            "4722.6143,N,18000.0001,E",
            "4722.6143,N,18100.0000,E",
            "4760.0000,N,00832.5034,E",
            "4722.6143,N,00860.0000,E",
            "99999999999.0,N,00832.5034,E",
            "4722.6143,E,00832.5034,N",
            "4722.6143,,00832.5034,E",
            "4722.6143,N,00832.5034,",
            "4722.6143,NN,00832.5034,E",
            "4722.6143,n,00832.5034,E",
            "-4722.6143,N,00832.5034,E",
            "4722.6a43,N,00832.5034,E",
            "4722.614314159x,N,00832.5034,E",
            "47 22.614,N,00832.5034,E",
            "4722.61.43,N,00832.5034,E",
        ),
        9,
    ):
        equal(_position(text), (-1, 0, 0), text)
    for text in (",,,", "4722.6143,N,,", ",N,00832.5034,E"):
        equal(_position(text), (0, 0, 0), text)


def kinds_and_talkers():
    starts = bytearray(25)
    for talker in sample(("GP", "GN", "GL", "GA", "GB", "GQ", "GI", "BD"), 4):
        for kind, name in ((GGA, "GGA"), (RMC, "RMC"), (VTG, "VTG"), (GSA, "GSA"), (OTHER, "GSV")):
            data = f"{talker}{name},1,,3".encode()
            equal(split(data, len(data), starts), 4 << 3 | kind, data)
            equal(list(starts[:5]), [0, 6, 8, 9, 11], data)
    # Radar, a compass, a clock; what is no address; and manufacturers' own.
    for text in (
        "RAGGA,",
        "HERMC,",
        "ZARMC,",
        "BBGGA,",
        "GGA,1,2,3",
        "GPGGAX,1",
        "PUBX,00,1",
        ",",
    ):
        data = text.encode()
        equal(split(data, len(data), starts) & 7, OTHER, text)


def more_fields_than_any_sentence_has():
    starts = bytearray(25)
    data = b"GPGGA" + b"," * 22
    equal(split(data, len(data), starts) >> 3, 23)
    data = b"GPGGA" + b"," * 100
    equal(split(data, len(data), starts) >> 3, 23)
