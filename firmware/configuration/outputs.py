"""What the values of an output must be to one another."""

# Pulses of a kind are so much shorter than a servo's, whose limits are 800 and 2200 us.
SHORTENED = {"servo": 1, "servo_760": 2, "oneshot125": 8}
CENTRES_US = {"servo": 1500, "servo_760": 760, "oneshot125": 187.5}
MINIMUM_US = 800
MAXIMUM_US = 2200
# Full stick of the radio, 100 %.
LOW_US = 988
HIGH_US = 2012


def limits_us(kind):
    """Returns the shortest and the longest pulse of a kind, in microseconds."""
    shortened = SHORTENED[kind]
    return MINIMUM_US / shortened, MAXIMUM_US / shortened


def travel_us(output):
    """Returns the pulses at the low end, in the middle and at the high end, in microseconds."""
    kind = output["kind"]
    shortened = SHORTENED[kind]
    low = output["minimum_us"]
    centre = output["centre_us"]
    high = output["maximum_us"]
    if low is None:
        low = LOW_US / shortened
    if centre is None:
        centre = CENTRES_US[kind]
    if high is None:
        high = HIGH_US / shortened
    return low, centre + output["subtrim_us"], high


def check_outputs(values, problems):
    """Adds what is wrong with the outputs among themselves to `problems`."""
    outputs = values["outputs"]
    if values[""]["role"] == "flight" and not outputs:
        problems.add("outputs", "outputs is empty: nothing would move")
    for pin in sorted(outputs):
        output = outputs[pin]
        path = f"outputs.{pin}"
        if output["kind"] == "switch":
            _check_switch(path, output, problems)
        else:
            _check_servo(path, output, problems)
        if output["motor"] and values["arming"]["channel"] is None:
            problems.add(
                f"{path}.motor", f"{path}.motor needs arming.channel, the channel that arms it"
            )
    if values["arming"]["channel"] == values["arming"]["throttle_channel"]:
        problems.add("arming.channel", "arming.channel is the throttle's channel as well")


def _check_servo(path, output, problems):
    lowest, highest = limits_us(output["kind"])
    wanted = f"{lowest:g}..{highest:g} us"
    for name in ("minimum_us", "centre_us", "maximum_us"):
        value = output[name]
        if value is not None and not lowest <= value <= highest:
            problems.add(
                f"{path}.{name}",
                f"{path}.{name} is {value}, must be {wanted} with kind {output['kind']}",
            )
            return
    low, centre, high = travel_us(output)
    if not low < centre < high:
        problems.add(
            path,
            f"{path}: the pulses at the low end, in the middle and at the high end are {low:g}, "
            f"{centre:g} and {high:g} us, must rise; turn the direction by reverse",
        )
    if output["motor"] and output["reverse"]:
        problems.add(
            f"{path}.reverse",
            f"{path}.reverse is true, must be false for a motor: it would start at its maximum",
        )
    failsafe = output["failsafe"]
    key = f"{path}.failsafe"
    if failsafe in ("on", "off"):
        problems.add(key, f'{key} is "{failsafe}", which is for kind switch only')
    elif type(failsafe) in (int, float) and not lowest <= failsafe <= highest:
        problems.add(key, f"{key} is {failsafe}, must be {wanted} with kind {output['kind']}")
    elif output["motor"] and failsafe != "none":
        problems.add(key, f"{key} cannot be set for a motor: it goes to its minimum")


def _check_switch(path, output, problems):
    failsafe = output["failsafe"]
    key = f"{path}.failsafe"
    if type(failsafe) in (int, float):
        problems.add(key, f'{key} is {failsafe}, must be "hold", "none", "on" or "off"')
    if output["motor"]:
        problems.add(f"{path}.motor", f"{path}.motor is for servo outputs, not for kind switch")
    above = output["threshold_us"]
    below = above - output["hysteresis_us"]
    if not LOW_US < below <= above < HIGH_US:
        problems.add(
            f"{path}.threshold_us",
            f"{path}: it goes on above {above:g} and off below {below:g} us, must lie between "
            f"{LOW_US} and {HIGH_US} us, what the radio sends",
        )
