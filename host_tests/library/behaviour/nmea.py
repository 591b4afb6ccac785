"""NMEA sentences of one moment become a solution; what makes no sense does not."""

from firmware.sensors.gps_solution import UNKNOWN, empty
from firmware.sensors.nmea import Nmea

from behaviour import gps_support
from behaviour.support import equal, sample

# What a receiver at Zurich's main station might send, in the order of a u-blox.
TIME = "091715.00"
WHERE = "4722.6143,N,00832.5034,E"
LAT_E7 = 473_769_050
LON_E7 = 85_417_233

GOOD_RMC = f"GPRMC,{TIME},A,{WHERE},23.99,271.26,130726,,,A"
GOOD_VTG = "GPVTG,271.26,T,,M,23.99,N,44.43,K,A"
GOOD_GGA = f"GPGGA,{TIME},{WHERE},1,09,0.9,431.9,M,48.0,M,,"
GOOD_GSA = "GPGSA,A,3,01,02,03,04,05,06,07,08,09,,,,1.37,0.90,1.03"
NO_FIX = "GPRMC,,V,,,,,,,,,,N", "GPGGA,,,,,,0,00,99.99,,,,,,"

GOOD = [3, LAT_E7, LON_E7, 432, 1234, 2713, 9, 137, 1]
# Without a GSA, and before it is known that none comes.
FLAT = {"FIX": 2, "PDOP_CENTI": UNKNOWN, "GOOD": 0}
NAMES = (
    "FIX",
    "LAT_E7",
    "LON_E7",
    "ALT_M",
    "SPEED_CM_S",
    "COURSE_DECIDEG",
    "SATELLITES",
    "PDOP_CENTI",
    "GOOD",
)


class _Receiver:
    def __init__(self):
        self.solution = empty()
        self.nmea = Nmea(self.solution)
        self.now_ms = 0

    def feed(self, *sentences):
        """How many solutions there were."""
        done = 0
        for text in sentences:
            data = text.encode()
            done += self.nmea.feed(data, len(data), self.now_ms)
        return done

    def expect(self, sentences, **values):
        """One solution from `sentences`, as GOOD but for `values`, and no error."""
        equal(self.feed(*sentences), 1, "solutions")
        equal(self.nmea.take_errors(), 0, "errors")
        equal(list(self.solution), gps_support.changed(NAMES, GOOD, values), NAMES)


def _solution(*sentences, **values):
    _Receiver().expect(sentences, **values)


def _rejected(text):
    receiver = _Receiver()
    equal(receiver.feed(text), 0, text)
    equal(receiver.nmea.take_errors(), 1, f"errors in {text}")


def the_sentences_of_one_moment():
    receiver = _Receiver()
    equal(receiver.feed(GOOD_GSA), 0)
    receiver.expect((GOOD_RMC, GOOD_VTG, GOOD_GGA))
    receiver.expect((GOOD_GGA, GOOD_GSA, GOOD_RMC, GOOD_VTG))


def every_talker():
    for talker in sample(("GP", "GN", "GL", "BD"), 1):
        sentences = [talker + text[2:] for text in (GOOD_GSA, GOOD_RMC, GOOD_GGA)]
        _solution(*sentences)


def sentences_of_other_moments_are_not_joined():
    receiver = _Receiver()
    later = GOOD_GGA.replace(TIME, "091716.00")
    equal(receiver.feed(GOOD_GSA, GOOD_RMC, later), 0)
    # The newer one waits for its own.
    receiver.expect((GOOD_RMC.replace(TIME, "091716.00"),))
    equal(receiver.feed(GOOD_RMC.replace(TIME, "091717.00")), 0)
    equal(receiver.feed(GOOD_GGA.replace(TIME, "091717.10")), 0)
    equal(receiver.feed(GOOD_GGA.replace(TIME, "091717.00")), 0)
    receiver.expect((GOOD_RMC.replace(TIME, "091717"),))


def each_sentence_counts_once():
    receiver = _Receiver()
    equal(receiver.feed(GOOD_RMC, GOOD_GGA, GOOD_GGA, GOOD_RMC, GOOD_RMC), 2)
    equal(receiver.feed("GNGGA" + GOOD_GGA[5:]), 1)


def without_a_fix():
    nothing = {name: UNKNOWN for name in ("ALT_M", "SPEED_CM_S", "COURSE_DECIDEG", "PDOP_CENTI")}
    nothing["LAT_E7"] = nothing["LON_E7"] = nothing["GOOD"] = 0
    _solution(*NO_FIX, FIX=0, SATELLITES=0, **nothing)
    # A position that is not valid, as some repeat the last one.
    _solution(
        GOOD_RMC.replace(",A,", ",V,"),
        GOOD_GGA.replace("E,1,09", "E,0,03"),
        FIX=0,
        SATELLITES=3,
        **nothing,
    )
    # One of the two says so.
    nothing["SATELLITES"] = 9
    _solution(GOOD_RMC.replace(",A,4", ",V,4"), GOOD_GGA, FIX=0, **nothing)
    _solution(GOOD_RMC[:-1] + "N", GOOD_GGA, FIX=0, **nothing)
    for quality in sample("0678", 1):
        text = GOOD_GGA.replace("E,1,09", f"E,{quality},09")
        _solution(GOOD_RMC, text, FIX=0, **nothing)
    for mode in sample("ENMS", 1):
        _solution(GOOD_RMC[:-1] + mode, GOOD_GGA, FIX=0, **nothing)


def differential_and_kinematic_fixes():
    for quality in sample("2345", 1):
        _solution(GOOD_GSA, GOOD_RMC, GOOD_GGA.replace("E,1,09", f"E,{quality},09"))
    for mode in sample("ADFRP", 1):
        _solution(GOOD_GSA, GOOD_RMC[:-1] + mode, GOOD_GGA)


def an_rmc_without_a_mode():
    _solution(GOOD_GSA, GOOD_RMC[:-2] + "E", GOOD_GGA)
    _solution(GOOD_GSA, GOOD_RMC[:-2], GOOD_GGA)


def two_dimensions():
    flat = GOOD_GSA.replace("A,3,", "A,2,")
    _solution(flat, GOOD_RMC, GOOD_GGA, FIX=2, GOOD=0)
    # Behind the others: of the moment before.
    _solution(GOOD_GSA.replace("A,3,", "A,1,"), GOOD_RMC, GOOD_GGA, FIX=2, GOOD=0)


def several_satellite_systems():
    used = GOOD_GSA.replace("1.37", "1.40")
    others = GOOD_GSA, used, "GNGSA,A,1,,,,,,,,,,,,,,,", "GNGSA,A,1,,,,,,,,,,,,,99.99,99.99,99.99"
    for first in range(4):
        # In any order, and with the rest of their moment before, between and behind them.
        gsa = others[first:] + others[:first]
        _solution(*gsa, GOOD_RMC, GOOD_GGA)
        _solution(GOOD_RMC, *gsa, GOOD_GGA)
        receiver = _Receiver()
        for second in range(20, 23):
            rmc, gga = (text.replace(TIME, f"0917{second}.00") for text in (GOOD_RMC, GOOD_GGA))
            done = receiver.feed(rmc, gga, *gsa)
            equal(done, 1)
        receiver.expect((GOOD_RMC, GOOD_GGA))
        # Those of another moment count for themselves.
        receiver.feed(GOOD_GSA.replace("A,3,", "A,2,"), GOOD_GSA.replace("A,3,", "A,1,"))
        receiver.expect((GOOD_RMC, GOOD_GGA), FIX=2, GOOD=0)


def the_pdop_of_the_best_system():
    flat = GOOD_GSA.replace("A,3,", "A,2,").replace("1.37", "0.90")
    none = GOOD_GSA.replace("1.37", "")
    _solution(flat, none, GOOD_GSA, GOOD_RMC, GOOD_GGA)
    _solution(GOOD_GSA, none, flat, GOOD_RMC, GOOD_GGA)
    _solution(flat, none, GOOD_RMC, GOOD_GGA, PDOP_CENTI=UNKNOWN, GOOD=0)
    for pdop, good in ("5.00", 1), ("5.01", 0), ("99.99", 0):
        gsa = GOOD_GSA.replace("1.37", pdop)
        _solution(gsa, GOOD_RMC, GOOD_GGA, PDOP_CENTI=round(100 * float(pdop)), GOOD=good)


def before_a_gsa_nothing_is_known():
    receiver = _Receiver()
    receiver.expect((GOOD_RMC, GOOD_GGA), **FLAT)
    receiver.now_ms = 3000
    receiver.expect((GOOD_RMC, GOOD_GGA), **FLAT)


def _without_gsa():
    receiver = _Receiver()
    receiver.feed(GOOD_RMC, GOOD_GGA)
    receiver.now_ms = 3001
    return receiver


def without_gsa():
    _without_gsa().expect((GOOD_RMC, GOOD_GGA), PDOP_CENTI=UNKNOWN)
    three = GOOD_GGA.replace("1,09", "1,03")
    _without_gsa().expect((GOOD_RMC, three), SATELLITES=3, **FLAT)
    level = GOOD_GGA.replace("431.9", "")
    _without_gsa().expect((GOOD_RMC, level), ALT_M=UNKNOWN, **FLAT)
    # HDOP of GGA stands in for PDOP.
    for hdop, good in sample((("2.50", 1), ("2.51", 0), ("99.99", 0), ("", 0), ("x", 0)), 3):
        gga = GOOD_GGA.replace("09,0.9", f"09,{hdop}")
        _without_gsa().expect((GOOD_RMC, gga), PDOP_CENTI=UNKNOWN, GOOD=good)
    # It comes after all.
    receiver = _without_gsa()
    receiver.feed(GOOD_GSA.replace("A,3,", "A,2,"))
    receiver.expect((GOOD_RMC, GOOD_GGA), FIX=2, GOOD=0)


def gsa_without_values():
    empty_gsa = "GPGSA,A,3,01,02,03,04,05,06,07,08,09,,,,,,"
    receiver = _Receiver()
    receiver.feed(empty_gsa)
    receiver.expect((GOOD_RMC, GOOD_GGA), PDOP_CENTI=UNKNOWN, GOOD=0)
    receiver.now_ms = 3001
    receiver.feed(empty_gsa)
    receiver.expect((GOOD_RMC, GOOD_GGA), PDOP_CENTI=UNKNOWN)
    poor = GOOD_GGA.replace("09,0.9", "09,2.6")
    receiver.expect((GOOD_RMC, poor), PDOP_CENTI=UNKNOWN, GOOD=0)
    receiver.feed(GOOD_RMC.replace(TIME, "091716.00"), empty_gsa.replace("A,3,", "A,2,"))
    receiver.expect((GOOD_GGA.replace(TIME, "091716.00"),), **FLAT)


def gsa_and_vtg_grow_old():
    receiver = _Receiver()
    receiver.feed(GOOD_GSA, GOOD_VTG)
    still = GOOD_RMC.replace("23.99,271.26", ",")
    receiver.now_ms = 2500
    receiver.expect((still, GOOD_GGA))
    receiver.now_ms = 2501
    receiver.expect((still, GOOD_GGA), SPEED_CM_S=UNKNOWN, COURSE_DECIDEG=UNKNOWN, **FLAT)


def vtg_where_rmc_has_no_motion():
    vtg = GOOD_VTG.replace("271.26", "12.34").replace("44.43", "100.0")
    _solution(GOOD_GSA, vtg, GOOD_RMC, GOOD_GGA)
    no_speed = GOOD_RMC.replace("23.99", "")
    _solution(GOOD_GSA, vtg, no_speed, GOOD_GGA, SPEED_CM_S=2778)
    no_course = GOOD_RMC.replace("271.26", "")
    _solution(GOOD_GSA, vtg, no_course, GOOD_GGA, COURSE_DECIDEG=123)


def a_receiver_that_sends_only_gga():
    receiver = _Receiver()
    receiver.feed(GOOD_GSA, GOOD_VTG)
    done = [receiver.feed(GOOD_GGA.replace(TIME, f"0917{second}.00")) for second in range(20, 26)]
    equal(done, [0, 0, 0, 1, 1, 1])
    receiver.expect((GOOD_GGA,))
    # RMC comes after all: they wait for each other again.
    equal(receiver.feed(GOOD_RMC.replace(TIME, "091730.00")), 0)
    receiver.expect((GOOD_GGA.replace(TIME, "091730.00"),))
    equal(receiver.feed(GOOD_GGA), 0)


def a_receiver_that_sends_only_rmc():
    receiver = _Receiver()
    done = [receiver.feed(GOOD_RMC.replace(TIME, f"0917{second}.00")) for second in range(20, 26)]
    equal(done, [0, 0, 0, 1, 1, 1])
    receiver.expect((GOOD_RMC,), ALT_M=UNKNOWN, SATELLITES=UNKNOWN, **FLAT)
    receiver.feed(GOOD_GSA)
    receiver.expect((GOOD_RMC,), ALT_M=UNKNOWN, SATELLITES=UNKNOWN)


def one_that_is_lost_now_and_then():
    receiver = _Receiver()
    done = 0
    for second in range(20, 40):
        time = f"0917{second}.00"
        done += receiver.feed(GOOD_RMC.replace(TIME, time))
        if second % 4:
            done += receiver.feed(GOOD_GGA.replace(TIME, time))
    equal(done, 15)


def speeds():
    # 1 knot = 51.4444 cm/s: the nearest, halves up.
    of_knots = (
        ("0", 0),
        ("0.009", 0),
        ("0.010", 1),
        ("1", 51),
        ("9", 463),
        ("0.875", 45),
        ("4.5", 232),  # 231.5
        ("23.99", 1234),
        ("1943.844", 100_000),
    )
    for knots, cm_s in sample(of_knots, 3):
        text = GOOD_RMC.replace("23.99", knots)
        _solution(GOOD_GSA, text, GOOD_GGA, SPEED_CM_S=cm_s)
    of_km_h = ("0.018", 1), ("0.017", 0), ("3.6", 100), ("1.0", 28), ("3600", 100_000)
    for km_h, cm_s in sample(of_km_h, 2):
        vtg = GOOD_VTG.replace("44.43", km_h)
        _solution(GOOD_GSA, vtg, GOOD_RMC.replace("23.99", ""), GOOD_GGA, SPEED_CM_S=cm_s)


def every_speed_is_the_nearest():
    receiver = _Receiver()
    receiver.feed(GOOD_GSA)
    for knots_e3 in sample(range(0, 1_943_845, 12_347), 3):
        text = GOOD_RMC.replace("23.99", f"{knots_e3 // 1000}.{knots_e3 % 1000:03}")
        # Twice 463/9 cm/s, and one half.
        receiver.expect((text, GOOD_GGA), SPEED_CM_S=(knots_e3 * 926 + 9000) // 18000)


def courses():
    pairs = ("0", 0), ("359.94", 3599), ("359.95", 0), ("360.0", 0), ("7.05", 71)
    for course, decideg in sample(pairs, 3):
        text = GOOD_RMC.replace("271.26", course)
        _solution(GOOD_GSA, text, GOOD_GGA, COURSE_DECIDEG=decideg)


def altitudes():
    pairs = ("-12.5", -12), ("-12.6", -13), ("0.5", 1), ("100000", 100_000)
    for alt, metres in sample(pairs, 2):
        _solution(GOOD_GSA, GOOD_RMC, GOOD_GGA.replace("431.9", alt), ALT_M=metres)


def what_makes_no_sense_is_left_out():
    texts = (
        GOOD_GGA.replace("4722.6143", "9122.6143"),
        GOOD_GGA.replace("00832.5034", "18132.5034"),
        GOOD_GGA.replace(WHERE, ",,,"),
        GOOD_GGA.replace("431.9", "100001"),
        GOOD_GGA.replace("431.9", "-10001"),
        GOOD_GGA.replace("431.9", "4a1.9"),
        GOOD_GGA.replace("1,09", "1,256"),
        GOOD_GGA.replace("1,09", "1,-1"),
        GOOD_GGA.replace("1,09", "10,09"),
        GOOD_GGA.replace("1,09", "x,09"),
        GOOD_GGA.replace(TIME, "09:17"),
        "GPGGA,1,2,3",
        GOOD_RMC.replace(",A,", ",X,"),
        GOOD_RMC.replace(",A,4", ",,4"),
        GOOD_RMC.replace(WHERE, ",,,"),
        GOOD_RMC.replace("00832.5034,E", "00832.5034,F"),
        GOOD_RMC.replace("23.99", "-1"),
        GOOD_RMC.replace("23.99", "1943.845"),
        GOOD_RMC.replace("271.26", "360.1"),
        GOOD_RMC.replace("271.26", "-1"),
        "GPRMC",
        GOOD_VTG.replace("44.43", "3600.1"),
        GOOD_VTG.replace("271.26", "400"),
        "GPVTG,271.3,T",
        GOOD_GSA.replace("A,3,", "A,4,"),
        GOOD_GSA.replace("A,3,", "A,,"),
        GOOD_GSA.replace("1.37", "700.00"),
        "GPGSA,A,3",
    )
    for text in sample(texts, 12):
        _rejected(text)


def one_that_makes_no_sense_does_not_pass_for_its_predecessor():
    receiver = _Receiver()
    equal(receiver.feed(GOOD_GGA, GOOD_GGA.replace("431.9", "x"), GOOD_RMC), 0)
    equal(receiver.nmea.take_errors(), 1)
    receiver.expect((GOOD_GSA, GOOD_GGA))
    receiver.feed(GOOD_GSA.replace("1.37", "x"))
    equal(receiver.nmea.take_errors(), 1)
    receiver.expect((GOOD_RMC, GOOD_GGA))


def what_is_not_for_us_is_no_error():
    receiver = _Receiver()
    others = (
        "GPGSV,1,1,00",
        "GPGLL,,,,,,V,N",
        "PUBX,00",
        "HERMC,x",
        "GPTXT,01,01,02,hello",
        "x" * 120,
    )
    equal(receiver.feed(*others), 0)
    equal(receiver.nmea.take_errors(), 0)


def a_reset_forgets_all():
    receiver = _Receiver()
    receiver.feed(GOOD_GSA, GOOD_VTG, GOOD_RMC)
    receiver.nmea.reset()
    equal(receiver.feed(GOOD_GGA), 0)
    receiver.expect((GOOD_RMC,), **FLAT)
