"""What barometers measure, from raw numbers to altitudes."""

from firmware.sensors import bmp280, dps310, lps22h
from firmware.sensors.atmosphere import altitude_mm

from behaviour.support import equal, sample

# The worked example of the BMP280's data sheet, section 3.12: 25.08 degrees, 100653.27 Pa.
_BMP280 = (27504, 26435, -1000, 36477, -10685, 3024, 2855, 140, -7, 15500, -14600, 6000)


def the_worked_example_of_the_bmp280():
    fine = bmp280.fine_temperature(_BMP280, 519_888)
    equal(fine, 128_422)  # 25.0825 degrees
    equal(bmp280.pressure_16(_BMP280, 415_148, fine), 1_610_452)  # 100653.25 Pa


def more_of_the_bmp280():
    # The floating point formula in double precision, rounded to sixteenths.
    for pressure, temperature, wanted in (
        (300_000, 519_888, 1_929_568),
        (600_000, 519_888, 1_102_712),
        (415_148, 420_000, 1_533_845),
        (415_148, 600_000, 1_672_443),
        (350_000, 580_000, 1_842_837),
    ):
        fine = bmp280.fine_temperature(_BMP280, temperature)
        found = bmp280.pressure_16(_BMP280, pressure, fine)
        assert abs(found - wanted) <= 1, (pressure, temperature, found, wanted)


def nonsense_in_a_bmp280_gives_no_pressure():
    for calibration in ((0,) * 12, (65535, -1, -1, 65535) + (-1,) * 8, (1,) * 12):
        for raw in (0, 0x7FFFF, 0xFFFFF):
            fine = bmp280.fine_temperature(calibration, raw)
            assert abs(bmp280.pressure_16(calibration, raw, fine)) < 1 << 30
    equal(bmp280.pressure_16((0,) * 12, 415_148, 128_422), 0)


# Two chips whose owners published their coefficients.
_DPS310 = (
    (223, -291, 80074, -56035, -3145, 1432, -9919, 152, -1321),
    (222, -297, 79832, -56308, -2295, 1444, -9701, 111, -1289),
)
_DPS310_REGISTERS = bytes.fromhex("0dfedd138caf251df3b70598d9410098fad7")


def the_coefficients_of_a_dps310():
    equal(dps310.unpack(_DPS310_REGISTERS), _DPS310[0])
    equal(dps310.unpack(b"\xff" * 18), (-1,) * 9)
    equal(
        dps310.unpack(bytes.fromhex("8007ff800007ffff80007fff8000000100ff")),
        (-2048, 2047, -524288, 524287, -32768, 32767, -32768, 1, 255),
    )


def pressures_of_a_dps310():
    # Of the first chip: raw -1509278 and 156656, both with the factor 3670016: 101374.20 Pa.
    equal(dps310.pressure_16(_DPS310[0], -6_899_557, 716_142), 1_621_987)
    for coefficients, pressure, temperature, wanted in (
        (_DPS310[0], 0, 0, 80_074 * 16),
        (_DPS310[1], -(1 << 23), 1 << 22, 1_679_593),
        (_DPS310[1], 1 << 23, -(1 << 22), 791_647),
    ):
        found = dps310.pressure_16(coefficients, pressure, temperature)
        assert abs(found - wanted) <= 1, (found, wanted)


def raw_values_beyond_the_range_of_a_dps310():
    for pressure, temperature in ((1 << 25, 0), (-(1 << 25), 0), (0, 1 << 25), (1 << 29, 0)):
        equal(dps310.pressure_16(_DPS310[0], pressure, temperature), 0)


def pressures_of_an_lps22h():
    equal(lps22h.pressure_16(0x3FF58D), 1_637_355)  # 102334.69 Pa
    equal(lps22h.pressure_16(4096 * 1000), 1_600_000)
    equal(lps22h.pressure_16(0), 0)
    equal(lps22h.pressure_16(0x800000), 0)
    equal(lps22h.pressure_16(0xFFFFFF), 0)


def altitudes_of_the_standard_atmosphere():
    # Pressures and altitudes of ISO 2533, in Pa and m.
    for pressure_pa, altitude_m in (
        (107_478, -500),
        (101_325, 0),
        (95_461, 500),
        (89_875, 1000),
        (79_495, 2000),
        (70_109, 3000),
        (54_020, 5000),
        (41_061, 7000),
        (30_742, 9000),
    ):
        found = altitude_mm(16 * pressure_pa)
        # Half a pascal, as the table is rounded, is up to 0.12 m.
        assert abs(found - 1000 * altitude_m) < 300, (pressure_pa, found)


def altitudes_fall_with_every_pressure():
    # A sixteenth of a pascal is 5 mm at sea level, 14 mm at 9000 m.
    neighbours = len(sample(range(400), 25))
    for start in (480_000, 1_000_000, 1_572_864 - 10, 1_621_200, 1_720_000):
        before = altitude_mm(start)
        for pressure_16 in range(start + 1, start + 1 + neighbours):
            altitude = altitude_mm(pressure_16)
            assert 4 <= before - altitude <= 16, (pressure_16, before, altitude)
            before = altitude


def the_ends_of_the_table():
    for pressure_16, wanted_m in ((25_000 * 16, 10_363), (120_000 * 16, -1_450)):
        found = altitude_mm(pressure_16)
        assert abs(found - 1000 * wanted_m) < 1000, (pressure_16, found)
