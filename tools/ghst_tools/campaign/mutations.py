"""Small ways to break the firmware, each with the tests that have to notice it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Mutation:
    """A change to the source: `old`, which stands in it once, becomes `new`.

    `tests`: what pytest is to run, the first word a file below host_tests, the second what `-k`
    selects in it.
    """

    what: str
    path: str
    old: str
    new: str
    tests: tuple[str, str]


def _behaviour(module: str) -> tuple[str, str]:
    return ("library/test_behaviour.py", f"cpython-{module}-")


_DECODER = "lib/ghst/decoder.py"
_RECEIVER = "lib/ghst/receiver.py"
_MSP = "lib/ghst/msp.py"
_INTERRUPTS = "firmware/interrupts.py"
_SHAPES = "firmware/shape_thumb.py"
_SETTINGS = "firmware/settings.py"
_POINTS = "firmware/configuration/points.py"
_CHECK = "firmware/configuration/check.py"
_FAILSAFE = "firmware/test_failsafe.py"
_SLOT = "firmware/test_slot.py"
_WATCHDOG = "firmware/test_watchdog.py"
_FAULTS = "firmware/test_wire_faults.py"
_CONFIG_COMMAND = "firmware/config_command.py"
_CONFIG_TESTS = "firmware/test_config_command.py"

LIBRARY = (
    Mutation("another CRC polynomial", _DECODER, "0x1D5", "0x107", _behaviour("samples")),
    Mutation(
        "a CRC that is not compared",
        _DECODER,
        "if length and crc != memory[stop]:",
        "if length and False:",
        _behaviour("counters"),
    ),
    Mutation(
        "legacy channels a quarter microsecond low",
        _DECODER,
        "base = 3520",
        "base = 3519",
        _behaviour("samples"),
    ),
    Mutation(
        "12-bit channels with the legacy scale",
        _DECODER,
        "scale = 4\n",
        "scale = 5\n",
        _behaviour("samples"),
    ),
    Mutation(
        "auxiliary channels at half range",
        _DECODER,
        "scale = scale << 2",
        "scale = scale << 1",
        _behaviour("scaling"),
    ),
    Mutation(
        "the second pair of primaries from the wrong bytes",
        _DECODER,
        "stop += 3",
        "stop += 2",
        _behaviour("samples"),
    ),
    Mutation(
        "frames for others obeyed",
        _DECODER,
        "if memory[tail] != 0x82:",
        "if memory[tail] == 0x89:",
        _behaviour("counters"),
    ),
    Mutation(
        "12-bit frames unknown",
        _DECODER,
        "elif kind & 0xD0 == 0x10:",
        "elif kind & 0xF0 == 0x10:",
        _behaviour("counters"),
    ),
    Mutation(
        "control frames of any length taken",
        _DECODER,
        "            counter = LENGTH_ERRORS\n            if length == 12:",
        "            counter = LENGTH_ERRORS\n            if length > 2:",
        _behaviour("counters"),
    ),
    Mutation(
        "lengths of 13 taken for possible",
        _DECODER,
        "if uint(length - 2) > uint(10):",
        "if uint(length - 2) > uint(11):",
        _behaviour("counters"),
    ),
    Mutation(
        "a byte too many skipped behind a false start",
        _DECODER,
        "tail = RING | ((tail + 1) & 255)",
        "tail = RING | ((tail + 2) & 255)",
        _behaviour("streams"),
    ),
    Mutation(
        "no mirror for frames that wrap in the ring",
        _DECODER,
        "if tail > RING + RING_SIZE - 14:",
        "if tail > RING + RING_SIZE:",
        _behaviour("streams"),
    ),
    Mutation(
        "unfinished frames kept when the line goes quiet",
        _DECODER,
        "        tail = RING | words[HEAD]\n",
        "        tail = tail\n",
        _behaviour("streams"),
    ),
    Mutation(
        "MSP frames that write beside their place",
        _DECODER,
        "(MSP_QUEUE_LENGTH - 1)) << 4)",
        "(MSP_QUEUE_LENGTH - 1)) << 3)",
        _behaviour("msp_queue"),
    ),
    Mutation(
        "RSSI with the wrong sign",
        _RECEIVER,
        "return -word(self.memory, RSSI)",
        "return word(self.memory, RSSI)",
        _behaviour("link"),
    ),
    Mutation(
        "RSSI below the scale that is no longer 0 %",
        _RECEIVER,
        "max(0, min(100, (above * 200 + 57) // 114))",
        "min(100, (above * 200 + 57) // 114)",
        _behaviour("link"),
    ),
    Mutation(
        "the RF mode with its flags",
        _RECEIVER,
        "return word(self.memory, RF_PROTOCOL) & 0x1F",
        "return word(self.memory, RF_PROTOCOL)",
        _behaviour("samples"),
    ),
    Mutation(
        "telemetry asked for by another bit",
        _RECEIVER,
        "word(self.memory, RF_PROTOCOL) & 0x20",
        "word(self.memory, RF_PROTOCOL) & 0x80",
        _behaviour("link"),
    ),
    Mutation(
        "video power with its second byte in the wrong place",
        _RECEIVER,
        "self.memory[VTX_SETUP + 4] << 8",
        "self.memory[VTX_SETUP + 4] << 4",
        _behaviour("link"),
    ),
    Mutation(
        "an MSP chunk that may be missing",
        _MSP,
        "elif status & 15 != self._sequence:",
        "elif False:",
        _behaviour("msp_requests"),
    ),
    Mutation(
        "a sequence of MSP that does not wrap",
        _MSP,
        "self._sequence = (status + 1) & 15",
        "self._sequence = (status & 15) + 1",
        _behaviour("msp_requests"),
    ),
    Mutation(
        "an MSP request that is larger than its buffer",
        _MSP,
        "if self.size > len(self.data):",
        "if self.size > len(self.data) + 1:",
        _behaviour("msp_requests"),
    ),
    Mutation(
        "an exception of an MSP command that gets out",
        _MSP,
        "except Exception as error:  # an application's",
        "except KeyError as error:  # an application's",
        _behaviour("msp_responder"),
    ),
    Mutation(
        "telemetry for the wrong address",
        "lib/ghst/telemetry.py",
        "frame[0] = ADDRESS_RX",
        "frame[0] = ADDRESS_RX - 1",
        _behaviour("telemetry"),
    ),
    Mutation(
        "stale values that are still sent",
        "lib/ghst/schedule.py",
        "> self.timeout_ms:",
        "> 2 * self.timeout_ms:",
        _behaviour("schedule"),
    ),
)

CONTROL_PATH = (
    Mutation(
        "pulses of 750 us let through",
        "firmware/limits.py",
        "MINIMUM = const(3200)",
        "MINIMUM = const(3000)",
        ("firmware/test_outputs.py", "limits_hold"),
    ),
    Mutation(
        "pulses of 2250 us let through",
        "firmware/limits.py",
        "MAXIMUM = const(8800)",
        "MAXIMUM = const(9000)",
        ("firmware/test_outputs.py", "limits_hold"),
    ),
    Mutation(
        "failsafe that is only judged without a link",
        _INTERRUPTS,
        "if c[LINK] == LINKED and ptr32(",
        "if c[LINK] != LINKED and ptr32(",
        (_FAILSAFE, "hold_none"),
    ),
    Mutation(
        "a failsafe clock that any frame sets back",
        _INTERRUPTS,
        "        if controls:\n            c[STAMP]",
        "        if controls + 1:\n            c[STAMP]",
        (_FAILSAFE, "only_control_frames"),
    ),
    Mutation(
        "outputs that hold forget their pulse",
        _INTERRUPTS,
        "if pulse == HOLD:",
        "if pulse == HOLD - 1:",
        (_FAILSAFE, "hold_none"),
    ),
    Mutation(
        "old channels that come back after failsafe",
        _INTERRUPTS,
        "channels[index] = 0",
        "channels[index] = channels[index]",
        (_FAILSAFE, "own_channel_only"),
    ),
    Mutation(
        "an RF mode that outlasts failsafe",
        _INTERRUPTS,
        "ptr32(c[MEMORY])[RF_PROTOCOL] = 0",
        "c[RF_PROTOCOL] = c[RF_PROTOCOL]",
        (_SLOT, "before_link_data_and_after_failsafe"),
    ),
    Mutation(
        "a watchdog that is always fed",
        _INTERRUPTS,
        "        if load:",
        "        load = c[WATCHDOG_LOAD]\n        if load:",
        (_WATCHDOG, "dead_control_path and receiver"),
    ),
    Mutation(
        "a dead frame interrupt that is not noticed",
        _INTERRUPTS,
        "if c[UNREAD_TICKS] == _UNREAD_LIMIT:",
        "if c[UNREAD_TICKS] == 0:",
        (_WATCHDOG, "dead_control_path and interrupt"),
    ),
    Mutation(
        "pulses that go on when the frame interrupt is dead",
        _INTERRUPTS,
        "ptr32(ptr32(at)[0])[0] = 0",
        "c[DEAD] = 1",
        (_WATCHDOG, "dies_with_the_link"),
    ),
    Mutation(
        "the rest of a burst that waits for the next one",
        _INTERRUPTS,
        "_SLOWEST_BYTE_US = const(124)",
        "_SLOWEST_BYTE_US = const(240)",
        (_FAULTS, "never_join"),
    ),
    Mutation(
        "a slow frame that is dropped with what was left before it",
        _INTERRUPTS,
        "_SLOWEST_BYTE_US = const(124)",
        "_SLOWEST_BYTE_US = const(50)",
        (_FAULTS, "slow_frame"),
    ),
    Mutation(
        "our own echo decoded",
        _INTERRUPTS,
        "words[TAIL] = RING | head",
        "words[TAIL] = tail",
        (_SLOT, "echo"),
    ),
    Mutation(
        "an echo that is waited for into the next frame",
        _INTERRUPTS,
        "_ECHO_LIMIT_US = const(1700)",
        "_ECHO_LIMIT_US = const(3000)",
        (_SLOT, "echo_that_is_missing"),
    ),
    Mutation(
        "telemetry in a mode without a downlink",
        _INTERRUPTS,
        "_BIDIRECTIONAL = const(0x560)",
        "_BIDIRECTIONAL = const(0x5E0)",
        (_SLOT, "only_modes and 7"),
    ),
    Mutation(
        "telemetry 20 us early",
        "firmware/slot_pio.py",
        "_MORE_LOOPS = const(1)",
        "_MORE_LOOPS = const(-66)",
        (_SLOT, "off_the_rate and 430000"),
    ),
    Mutation(
        "a receiver that samples at 440 kBd",
        "firmware/wire_pio.py",
        "baud_rate = baud_rate * 83 // 84",
        "baud_rate = baud_rate * 22 // 21",
        (_FAULTS, "baud_rates and 400000"),
    ),
    Mutation(
        "a pause inside a frame that is not noticed",
        "firmware/wire_pio.py",
        "_GAP_US = 150",
        "_GAP_US = 3000",
        (_FAULTS, "never_join"),
    ),
    Mutation(
        "a watchdog that runs on at the prompt",
        "firmware/control.py",
        "machine.mem32[register + chip.CLEAR_BITS] = chip.WATCHDOG_ENABLE",
        "register = chip.WATCHDOG_ENABLE",
        (_WATCHDOG, "ctrl_c_reaches"),
    ),
    Mutation(
        "an exception that ends the main loop",
        "firmware/app.py",
        "                step(time.ticks_ms())\n            except _FAULTS as error:",
        "                step(time.ticks_ms())\n            except KeyError as error:",
        (_WATCHDOG, "exceptions_in_the_main_loop"),
    ),
    Mutation(
        "pins that stay as they are when the application is left",
        "firmware/app.py",
        "                adapter.stop()\n",
        "                adapter.poll()\n",
        (_WATCHDOG, "ctrl_c_reaches"),
    ),
    Mutation(
        "motors ready while the throttle is up",
        _SHAPES,
        "    ble(DECIDED)\n",
        "    b(DECIDED)\n",
        ("firmware/test_shapes.py", "motor_needs"),
    ),
    Mutation(
        "motors armed by the channel alone",
        _SHAPES,
        "    bne(DECIDED)\n",
        "",
        ("firmware/test_shapes.py", "motor_needs"),
    ),
    Mutation(
        "a slow output that jumps",
        _SHAPES,
        "    mul(r5, r1)\n",
        "    mul(r5, r1)\n    lsl(r5, r5, 1)\n",
        ("firmware/test_shapes.py", "slow_output"),
    ),
    Mutation(
        "a weak link that flies",
        _SHAPES,
        "    str(r4, [r0, 4 * word.CONTROLS])\n",
        "",
        ("firmware/test_shapes.py", "weak_link"),
    ),
    Mutation(
        "plain outputs that follow weak frames",
        "firmware/output.py",
        "output.shaped = link_limits is not None or not output.plain",
        "output.shaped = not output.plain",
        ("firmware/test_shapes.py", "weak_link_moves and thumb"),
    ),
    Mutation(
        "channels of weak frames that come back after failsafe",
        _SHAPES,
        "    str(r4, [r7, 0])\n    add(r7, 4)",
        "    add(r7, 4)",
        ("firmware/test_shapes.py", "weak_link_moves and thumb"),
    ),
    Mutation(
        "a long step of a slow output that overflows",
        _SHAPES,
        "    neg(r5, r5)\n    cmp(r6, r5)\n",
        "    add(r5, r5, r6)\n    cmp(r5, 0)\n",
        ("firmware/test_shapes.py", "long_step and thumb"),
    ),
)

CONFIGURATION = (
    Mutation(
        "settings written over the old ones",
        _SETTINGS,
        'with open(self._new_path, "wb") as file:',
        'with open(self._path, "wb") as file:',
        _behaviour("settings"),
    ),
    Mutation(
        "settings that never take the old ones' place",
        _SETTINGS,
        "        self._finish = self._rename_new\n        self._rename_new()\n",
        "        self._finish = self._rename_new\n",
        _behaviour("settings"),
    ),
    Mutation(
        "settings that are not read back",
        _SETTINGS,
        "if not _holds(self._new_path, memoryview(data)):",
        "if False:",
        _behaviour("settings"),
    ),
    Mutation(
        "a broken file of the user's that is thrown away",
        _SETTINGS,
        "        if self._file_is_broken:\n            os.rename",
        "        if False:\n            os.rename",
        _behaviour("settings"),
    ),
    Mutation(
        "a save while it is not safe",
        _SETTINGS,
        "if not safe or not (self._requested",
        "if not (self._requested",
        _behaviour("settings"),
    ),
    Mutation(
        "failsafe after 10 ms allowed",
        _POINTS,
        '            "time_ms",\n            500,\n            110,',
        '            "time_ms",\n            500,\n            10,',
        _behaviour("configuration"),
    ),
    Mutation(
        "the end of a range refused",
        "firmware/configuration/kinds.py",
        "return type(value) is int and self.minimum <= value <= self.maximum",
        "return type(value) is int and self.minimum <= value < self.maximum",
        _behaviour("configuration"),
    ),
    Mutation(
        "true taken for a number",
        "firmware/configuration/kinds.py",
        "return type(value) in (int, float) and self.minimum",
        "return isinstance(value, (int, float)) and self.minimum",
        _behaviour("configuration"),
    ),
    Mutation(
        "unknown keys passed over",
        _CHECK,
        'problems.add(f"{path}.{name}", f"{path}.{name} is unknown',
        'str(f"{path}.{name} is unknown',
        _behaviour("configuration"),
    ),
    Mutation(
        "motors that start at their maximum",
        "firmware/configuration/outputs.py",
        'if output["motor"] and output["reverse"]:',
        'if output["motor"] is output["reverse"] is None:',
        _behaviour("configuration"),
    ),
    Mutation(
        "what the radio sets saved in place of a broken file",
        _SETTINGS,
        "        if self._file_is_broken:\n            # What",
        "        if False:\n            # What",
        _behaviour("settings"),
    ),
    Mutation(
        "a heading of bytes from two measurements",
        "firmware/sensors/i2c_sensor.py",
        "return NEW if data == again else NOTHING",
        "return NEW if again else NOTHING",
        ("library/test_i2c_sensor.py", "two_measurements"),
    ),
    Mutation(
        "a file that cannot be read taken for none",
        "firmware/configuration/load.py",
        "elif error.errno != _ENOENT:",
        "elif error.errno == _ENOENT - 1:",
        ("firmware/test_configuration.py", "cannot_be_read"),
    ),
    Mutation(
        "a value that stands where its colon was lost",
        "firmware/json_text.py",
        "            expected = _COMMA_OR_END if expected <= _VALUE_OR_END else _COLON",
        "            expected = _COMMA_OR_END if expected <= _VALUE_OR_END else _VALUE",
        _behaviour("json_text"),
    ),
    Mutation(
        "motors without arming",
        "firmware/configuration/outputs.py",
        'if output["motor"] and values["arming"]["channel"] is None:',
        'if output["motor"] and values["arming"]["channel"] == 0:',
        _behaviour("configuration"),
    ),
    Mutation(
        "a broken configuration that is used in part",
        "firmware/configuration/load.py",
        '        made.values["outputs"] = {}\n',
        "",
        ("firmware/test_configuration.py", "broken_file and time_ms"),
    ),
)

CONSOLE = (
    Mutation(
        "a configuration written while the link is up",
        _CONFIG_COMMAND,
        "if force is None and self._application and self._application.adapter.link",
        "if force is True and self._application and self._application.adapter.link",
        (_CONFIG_TESTS, "link_is_up"),
    ),
    Mutation(
        "a configuration saved without a check",
        _CONFIG_COMMAND,
        "        if not self._good:\n",
        "        if self._good is None:\n",
        (_CONFIG_TESTS, "read_checked_and_saved"),
    ),
    Mutation(
        "a configuration that replaces one that has changed meanwhile",
        _CONFIG_COMMAND,
        "if self._base is not None and (_digest()",
        "if self._base is True and (_digest()",
        (_CONFIG_TESTS, "changed_meanwhile"),
    ),
    Mutation(
        "a configuration that arrived damaged",
        _CONFIG_COMMAND,
        "if self._received != self._size or found != digest:",
        "if self._received != self._size:",
        (_CONFIG_TESTS, "read_checked_and_saved"),
    ),
    Mutation(
        "a line that is too long taken for its beginning",
        "firmware/console.py",
        "min(self._length + 1, _LONGEST + 1)",
        "min(self._length + 1, _LONGEST)",
        ("firmware/test_console.py", "what_is_no_command"),
    ),
    Mutation(
        "a file replaced, and its old settings kept",
        _SETTINGS,
        "        saves = self.saves\n        self.load()\n",
        "        saves = self.saves\n",
        _behaviour("settings"),
    ),
)

MUTATIONS = LIBRARY + CONTROL_PATH + CONFIGURATION + CONSOLE
