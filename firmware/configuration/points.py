"""Every value that a user may set: the one place where it is declared.

`SECTIONS` are the parts of `ghst.json` and their points; the section "" holds what stands at the
top. `OUTPUT` are the points of each output, in `outputs`, by GPIO. Validation, help,
docs/configuration.md and the commands of `ghst config` come from these.
"""

from firmware.configuration.kinds import (
    Axes,
    Channel,
    Choice,
    Failsafe,
    Flag,
    Number,
    Pin,
    Text,
    Whole,
)

OUTPUT_KINDS = ("servo", "switch", "servo_760", "oneshot125", "unused")

SECTIONS = {
    "": (
        Text("name", "", 16, "Name of the model; MSP tells it to the radio."),
        Choice(
            "role",
            "flight",
            ("flight", "goggles"),
            "flight: moves servos and sends telemetry. goggles: moves nothing, tunes an RX5808.",
        ),
    ),
    "failsafe": (
        Whole(
            "time_ms",
            500,
            110,
            10_000,
            "ms",
            "Time without a control frame until failsafe. 110 ms are two frames of Long Range.",
        ),
        Whole(
            "minimum_lq_percent",
            None,
            1,
            100,
            "%",
            "Control frames below this link quality move nothing and count as lost. null: all "
            "count.",
        ),
        Whole(
            "minimum_rssi_dbm",
            None,
            -130,
            -20,
            "dBm",
            "Control frames below this signal strength move nothing and count as lost. null: all "
            "count.",
        ),
    ),
    "wire": (
        Choice(
            "driver",
            "pio",
            ("pio", "uart"),
            "pio: one pin, RP2040 and RP2350 only. uart: RX and TX of a UART, tied together.",
        ),
        Pin("pin", 2, "wire", "The receiver's signal: the pin of pio, RX of uart."),
        Pin("tx_pin", None, "wire tx", "TX of uart; pio has none."),
        Whole(
            "baud_rate",
            420_000,
            350_000,
            500_000,
            "baud",
            "Of both directions. A Ghost receiver has 420000; frames up to a twentieth off are "
            "received, too.",
        ),
        Flag(
            "inverted",
            False,
            "Whether the line is low while nobody talks, as behind an inverter. pio only. With a "
            "pull-down instead of the pull-up: 10 kOhm, on the RP2350 8.2 kOhm at most.",
        ),
    ),
    "arming": (
        Channel("channel", None, "Arms the outputs marked motor when it is high."),
        Channel("throttle_channel", 3, "Must be low when arming: the stick of the motors."),
        Number("threshold_us", 1500, 1000, 2000, "us", "Above it the arm channel is high."),
        Number("throttle_low_us", 1050, 900, 1300, "us", "Up to it the throttle is low."),
    ),
    "led": (
        Pin("pin", None, "led", "The LED that shows the state. null: none."),
        Flag("active_low", False, "Whether the LED lights when its pin is low."),
    ),
    "battery": (
        Flag("enabled", False, "Whether there is a battery to measure."),
        Pin("voltage_pin", None, "adc", "Voltage behind the divider. null: not measured."),
        Number(
            "divider", 11.0, 1, 1000, "", "Battery voltage divided by that at the pin: (R1+R2)/R2."
        ),
        Pin("current_pin", None, "adc", "Output of a current sensor. null: there is none."),
        Number("current_mv_per_a", 40, 1, 5000, "mV/A", "Slope of the current sensor."),
        Whole("current_offset_mv", 0, 0, 3000, "mV", "Output of the current sensor at 0 A."),
        Whole("reference_mv", 3300, 500, 6000, "mV", "Full scale of the ADC."),
        Whole("cells", 0, 0, 16, "", "Cells in series; 0: found out when the battery is plugged."),
        Whole("cell_low_mv", 3500, 2500, 4350, "mV", "A cell below this is low."),
        Whole("cell_critical_mv", 3300, 2500, 4350, "mV", "A cell below this is critical."),
        Whole("capacity_mah", 0, 0, 65_535, "mAh", "Capacity, for display; 0: not known."),
    ),
    "gps": (
        Flag("enabled", False, "Whether there is a GPS."),
        Whole("uart", 0, 0, 2, "", "The UART that the GPS is connected to."),
        Pin("tx_pin", None, "uart{uart} tx", "To RX of the GPS."),
        Pin("rx_pin", None, "uart{uart} rx", "To TX of the GPS."),
        Whole("minimum_satellites", 6, 4, 32, "", "Home is the first good 3D fix of this many."),
        Flag("configure", True, "Whether a u-blox is set to ten solutions a second."),
    ),
    "i2c": (
        Whole("bus", 0, 0, 1, "", "The I2C bus of barometer and magnetometer."),
        Pin("sda_pin", None, "i2c{bus} sda", "SDA."),
        Pin("scl_pin", None, "i2c{bus} scl", "SCL."),
    ),
    "barometer": (
        Flag("enabled", False, "Whether there is a BMP280, BME280, DPS310 or LPS22H."),
        Whole("address", None, 8, 119, "", "Its I2C address. null: searched for."),
    ),
    "magnetometer": (
        Flag("enabled", False, "Whether there is a QMC5883L, HMC5883L or LIS3MDL."),
        Whole("address", None, 8, 119, "", "Its I2C address. null: searched for."),
        Axes(
            "offset_nt",
            [0, 0, 0],
            -1_000_000,
            1_000_000,
            "nT",
            "The model's own field; the console command calibrate finds it.",
        ),
        Number(
            "declination_deg",
            0,
            -180,
            180,
            "degrees",
            "By how much a compass points too far east.",
        ),
        Whole(
            "rotation_deg", 0, 0, 359, "degrees", "Of the chip's x axis, clockwise from the nose."
        ),
        Flag("upside_down", False, "Whether the top of the chip faces down."),
    ),
    "rx5808": (
        Pin("clock_pin", None, "gpio", "CH3 of the video receiver module, for goggles."),
        Pin("data_pin", None, "gpio", "CH1 of the module."),
        Pin("select_pin", None, "gpio", "CH2 of the module."),
    ),
    "vtx": (
        Whole("vtx_band", 0, 0, 255, "", "Kept for the radio's scripts, which set it over MSP."),
        Whole("vtx_channel", 0, 0, 255, "", "As vtx_band."),
        Whole("vtx_power", 0, 0, 255, "", "A step, as vtx_band."),
        Flag("vtx_pit_mode", False, "As vtx_band."),
        Whole("vtx_freq_mhz", 0, 0, 65_535, "MHz", "As vtx_band; 0: that of band and channel."),
        Whole("vtx_low_power_disarm", 0, 0, 2, "", "As vtx_band."),
        Whole("vtx_pit_freq_mhz", 0, 0, 65_535, "MHz", "As vtx_band."),
    ),
}

OUTPUT = (
    Channel("channel", None, "The channel that the output follows. Needed, unless unused."),
    Choice(
        "kind",
        "servo",
        OUTPUT_KINDS,
        "servo: 1500 us in the middle. switch: on or off. servo_760: half as long, 760 us in the "
        "middle. oneshot125: an eighth as long, for ESCs. unused: the pin is left alone.",
    ),
    Text("name", "", 16, "For you: aileron, say."),
    Flag("reverse", False, "Turns the direction; not of a motor."),
    Number(
        "minimum_us",
        None,
        100,
        2200,
        "us",
        "The pulse at the low end of the stick (988 us), and none is shorter. null: as the stick.",
    ),
    Number(
        "centre_us", None, 100, 2200, "us", "The pulse in the middle. null: as the kind has it."
    ),
    Number(
        "maximum_us",
        None,
        100,
        2200,
        "us",
        "The pulse at the high end of the stick (2012 us), and none is longer. null: as the "
        "stick.",
    ),
    Number("subtrim_us", 0, -200, 200, "us", "Shifts the middle; the ends stay."),
    Number("deadband_us", 0, 0, 100, "us", "Stick travel around the middle that moves nothing."),
    Whole("slow_us_per_s", 0, 0, 10_000, "us/s", "How fast the pulse may change; 0: at once."),
    Failsafe(
        "failsafe",
        "none",
        "hold: as before. none: no pulses. A number: pulses of this width. on, off: of a switch.",
    ),
    Whole(
        "frequency_hz",
        50,
        50,
        400,
        "Hz",
        "Pulses a second. The outputs of one PWM slice have the same.",
    ),
    Flag(
        "motor",
        False,
        "Stays at its minimum until armed, and goes there in failsafe.",
    ),
    Number("threshold_us", 1500, 900, 2100, "us", "Of a switch: above it, it is on."),
    Number("hysteresis_us", 50, 0, 500, "us", "Of a switch: how far the channel has to go back."),
)
