"""The configuration: what is taken, what is refused in which words, and what follows from it."""

from firmware.configuration.check import check
from firmware.configuration.outputs import travel_us

from behaviour.support import equal

_BOARD = {
    "name": "test",
    "chip": "rp2040",
    "functions": {
        "gpio": [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 22, 26, 27],
        "led": [25],
        "adc": [26, 27],
        "uart0 tx": [0],
        "uart0 rx": [1],
        "uart1 tx": [4, 8],
        "uart1 rx": [5, 9],
        "i2c0 sda": [4, 8],
        "i2c0 scl": [5, 9],
    },
    "defaults": {
        "wire": {"pin": 2},
        "led": {"pin": 25},
        "outputs": {"6": {"channel": 1}, "7": {"channel": 2}},
        "gps": {"uart": 0, "tx_pin": 0, "rx_pin": 1},
    },
}


def _checked(tree):
    return check(tree, _BOARD)


def _refused(tree, *lines):
    equal([text for _, text in _checked(tree)[1]], list(lines), tree)


def nothing_at_all_is_the_board_as_it_is():
    values, problems = _checked({})
    equal(problems, [])
    equal(sorted(values["outputs"]), [6, 7])
    equal((values["outputs"][6]["channel"], values["outputs"][7]["kind"]), (1, "servo"))
    equal((values["wire"]["pin"], values["wire"]["driver"]), (2, "pio"))
    equal((values["failsafe"]["time_ms"], values[""]["role"]), (500, "flight"))
    equal((values["gps"]["enabled"], values["battery"]["enabled"]), (True, False))


def an_output_takes_the_rest_from_the_board():
    values, problems = _checked({"outputs": {"7": {"reverse": True}, "8": {"channel": 16}}})
    equal(problems, [])
    equal((values["outputs"][7]["channel"], values["outputs"][7]["reverse"]), (2, True))
    equal(sorted(values["outputs"]), [6, 7, 8])
    values, problems = _checked({"outputs": {"7": {"kind": "unused"}}})
    equal((problems, sorted(values["outputs"])), ([], [6]))


def a_section_brings_its_sensor():
    values, problems = _checked({"battery": {"voltage_pin": 26}, "gps": {"enabled": False}})
    equal(problems, [])
    equal((values["battery"]["enabled"], values["gps"]["enabled"]), (True, False))


def unknown_keys():
    names = (
        "arming, barometer, battery, failsafe, gps, i2c, led, magnetometer, name, outputs, role, "
        "rx5808, vtx, wire"
    )
    _refused({"filesafe": {}}, "filesafe is unknown, there are " + names)
    _refused({"": {"name": "x"}}, '"" is unknown, there are ' + names)
    _refused({"led": {"pn": 3}}, "led.pn is unknown, there are pin, active_low")
    _refused({"outputs": {"x": {}}}, "outputs.x is no GPIO number")
    _refused({"outputs": {"06": {}}}, "outputs.06 is no GPIO number")


def values_of_the_wrong_type_or_range():
    for section, name, value, text in (
        ("failsafe", "time_ms", 109, "109, must be 110..10000 ms"),
        ("failsafe", "time_ms", 10001, "10001, must be 110..10000 ms"),
        ("failsafe", "time_ms", 200.5, "200.5, must be 110..10000 ms"),
        ("failsafe", "time_ms", True, "true, must be 110..10000 ms"),
        ("failsafe", "time_ms", None, "null, must be 110..10000 ms"),
        ("failsafe", "time_ms", "200", '"200", must be 110..10000 ms'),
        ("failsafe", "time_ms", [], "a list, must be 110..10000 ms"),
        ("failsafe", "minimum_lq_percent", 0, "0, must be 1..100 % or null"),
        ("wire", "driver", "spi", '"spi", must be one of pio, uart'),
        ("wire", "baud_rate", 115200, "115200, must be 350000..500000 baud"),
        ("battery", "divider", True, "true, must be 1..1000"),
        ("gps", "configure", 1, "1, must be true or false"),
        ("magnetometer", "offset_nt", [1, 2], "a list, must be three numbers, each "),
        ("led", "pin", -1, "-1, must be a GPIO number or null"),
    ):
        lines = [line for _, line in _checked({section: {name: value}})[1]]
        assert lines and lines[0].startswith(f"{section}.{name} is {text}"), (lines, text)
    _refused({"name": "Flügel"}, 'name is "Flügel", must be a text of at most 16 ASCII characters')
    _refused({"role": "pilot"}, 'role is "pilot", must be one of flight, goggles')


def what_is_no_object():
    for tree in ([], None, 5, "x"):
        _refused(tree, "the configuration must be a JSON object")
    _refused({"led": 25}, "led is 25, must be a JSON object")
    _refused({"outputs": [6]}, "outputs is a list, must be a JSON object")
    _refused({"outputs": {"6": 1}}, "outputs.6 is 1, must be a JSON object")


def pins_that_cannot():
    _refused(
        {"outputs": {"12": {"channel": 1}}},
        "outputs.12: GPIO 12 cannot be pwm, must be one of 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 22, 26, "
        "27",
    )
    _refused(
        {"battery": {"voltage_pin": 3}},
        "battery.voltage_pin: GPIO 3 cannot be adc, must be one of 26, 27",
    )
    _refused(
        {"gps": {"uart": 1, "rx_pin": 5}},
        "gps.tx_pin: GPIO 0 cannot be uart1 tx, must be one of 4, 8",
    )
    _refused(
        {"barometer": {}},
        "i2c.sda_pin is missing, must be one of 4, 8",
        "i2c.scl_pin is missing, must be one of 5, 9",
    )
    _refused(
        {"wire": {"driver": "uart"}},
        "wire.pin: GPIO 2 cannot be uart rx, must be one of 1, 5, 9",
        "wire.tx_pin is missing, must be TX of the wire's UART",
    )
    _refused(
        {"wire": {"driver": "uart", "pin": 5, "tx_pin": 0}, "gps": {"enabled": False}},
        "wire.tx_pin: GPIO 0 is not TX of the UART whose RX GPIO 5 is",
    )
    _refused({"wire": {"driver": "uart", "pin": 5, "tx_pin": 8}})
    gps = {"uart": 1, "tx_pin": 4, "rx_pin": 9}
    _refused(
        {"wire": {"driver": "uart", "pin": 5, "tx_pin": 8}, "gps": gps},
        "gps.uart is 1, which the Ghost wire has",
    )
    _refused({"wire": {"pin": 5}, "gps": gps})
    _refused(
        {"wire": {"driver": "uart", "pin": 5, "tx_pin": 8, "inverted": True}},
        'wire.inverted is true, must be false with wire.driver "uart": its TX is tied to the wire '
        "so that it can pull low only, and an inverted wire is low already",
    )
    _refused({"wire": {"pin": 6}}, "outputs.6: GPIO 6 is taken by wire.pin")
    _refused({"outputs": {"1": {"channel": 3}}}, "gps.rx_pin: GPIO 1 is taken by outputs.1")


def outputs_of_one_slice():
    _refused(
        {"outputs": {"7": {"frequency_hz": 333}}},
        "outputs.7.frequency_hz is 333, but GPIO 7 shares PWM slice 3 with GPIO 6, which has 50: "
        "they must be the same",
    )
    _refused({"outputs": {"6": {"frequency_hz": 333}, "7": {"frequency_hz": 333}}})
    _refused(
        {"outputs": {"22": {"channel": 3}}},
        "outputs.22 and outputs.6 share one PWM channel: take another pin for one of them",
    )


def pulses_of_an_output():
    _refused(
        {"outputs": {"6": {"minimum_us": 700}}},
        "outputs.6.minimum_us is 700, must be 800..2200 us with kind servo",
    )
    _refused(
        {"outputs": {"6": {"minimum_us": 1600}}},
        "outputs.6: the pulses at the low end, in the middle and at the high end are 1600, 1500 "
        "and 2012 us, must rise; turn the direction by reverse",
    )
    _refused(
        {"outputs": {"6": {"kind": "oneshot125", "failsafe": 1000}}},
        "outputs.6.failsafe is 1000, must be 100..275 us with kind oneshot125",
    )
    _refused(
        {"outputs": {"6": {"failsafe": "on"}}},
        'outputs.6.failsafe is "on", which is for kind switch only',
    )
    _refused(
        {"outputs": {"6": {"kind": "switch", "failsafe": 1000}}},
        'outputs.6.failsafe is 1000, must be "hold", "none", "on" or "off"',
    )
    _refused({"outputs": {"8": {}}}, "outputs.8.channel is missing, must be 1..16")
    values, problems = _checked({"outputs": {"6": {"kind": "servo_760", "subtrim_us": 5}}})
    equal((problems, travel_us(values["outputs"][6])), ([], (494, 765, 1006)))


def motors_need_arming():
    _refused(
        {"outputs": {"6": {"motor": True}}},
        "outputs.6.motor needs arming.channel, the channel that arms it",
    )
    _refused({"outputs": {"6": {"motor": True}}, "arming": {"channel": 5}})
    _refused({"arming": {"channel": 3}}, "arming.channel is the throttle's channel as well")
    _refused(
        {"outputs": {"6": {"motor": True, "failsafe": "hold"}}, "arming": {"channel": 5}},
        "outputs.6.failsafe cannot be set for a motor: it goes to its minimum",
    )
    # Its minimum is where the throttle is high: armed with a low one, it would run at full speed.
    _refused(
        {"outputs": {"6": {"motor": True, "reverse": True}}, "arming": {"channel": 5}},
        "outputs.6.reverse is true, must be false for a motor: it would start at its maximum",
    )


def a_switch_can_go_on_and_off():
    def switch(threshold_us, hysteresis_us):
        point = {"kind": "switch", "threshold_us": threshold_us, "hysteresis_us": hysteresis_us}
        return {"outputs": {"6": point}}

    _refused(switch(1500, 500))
    _refused(switch(2011.75, 0))
    _refused(
        switch(1400, 412),
        "outputs.6: it goes on above 1400 and off below 988 us, must lie between 988 and 2012 us, "
        "what the radio sends",
    )
    _refused(
        switch(2012, 50),
        "outputs.6: it goes on above 2012 and off below 1962 us, must lie between 988 and 2012 "
        "us, what the radio sends",
    )


def goggles_need_a_module():
    _refused({"role": "goggles"})
    values, problems = _checked({"role": "goggles", "rx5808": {"clock_pin": 6, "data_pin": 7}})
    equal((problems, values["outputs"]), ([], {}))


def the_esp32_has_timers():
    board = {
        "chip": "esp32",
        "functions": {"gpio": list(range(12, 34)), "uart": list(range(12, 34))},
        "outputs_hardware": {"kind": "ledc", "channels": 3, "timers": 1},
        "defaults": {"wire": {"driver": "uart", "pin": 16, "tx_pin": 17}},
    }
    outputs = {str(pin): {"channel": 1} for pin in range(20, 24)}
    outputs["20"]["frequency_hz"] = 333
    equal(
        [text for _, text in check({"outputs": outputs}, board)[1]],
        [
            "outputs has 4 pins, but an esp32 has 3 PWM channels",
            "outputs has 2 values of frequency_hz, but an esp32 has 1 PWM timers",
        ],
    )
    equal(
        check({"wire": {"driver": "pio"}}, board)[1][-1],
        ("wire.driver", 'wire.driver is "pio", must be "uart" on an esp32'),
    )
