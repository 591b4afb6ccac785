"""Text that is JSON, and text that only looks like it."""

from firmware.json_text import parse

from behaviour.support import equal, sample

_GOOD = (
    ("{}", {}),
    ("[]", []),
    (" \t\r\n{ } ", {}),
    ('""', ""),
    ("0", 0),
    ("-0", 0),
    ("-12", -12),
    ("[10,0.5,-0.5,1e3,1E+3,25e-2,1.5e1]", [10, 0.5, -0.5, 1000.0, 1000.0, 0.25, 15.0]),
    ("[true,false,null]", [True, False, None]),
    ('{"a":{"b":[{"c":1}]},"d":[[],{}]}', {"a": {"b": [{"c": 1}]}, "d": [[], {}]}),
    ('{"a" : 1 ,\n"b" : "x,:{}[]" }', {"a": 1, "b": "x,:{}[]"}),
    ('"\\"\\\\\\/\\b\\f\\n\\r\\t\\u00e4\\u20aC"', '"\\/\b\f\n\r\t\xe4\u20ac'),
    ('{"\xe4":"\u20ac"}', {"\xe4": "\u20ac"}),
    ("[" * 32 + "]" * 32, None),
)
# MicroPython's own parser takes many of them.
# fmt: off
_BAD = [
    "", " ", "{", "[", "}", "]", ":", ",", '"', '"a', '"a\\', '"a\\"', "{}{}", "{} {}", "1 2",
    '{"a"}', '{"a":}', '{"a"1}', '{"a" 1}', '{"a":1,}', '{"a":1 "b":2}', '{"a":1"b":2}',
    '{"a"::1}', '{"a":1,,"b":2}', '{,"a":1}', '{"a":,"b":2}', '{"a":1:2}', '{"a","b":1}',
    "{1:2}", "{null:1}", "{[]:1}", '{{"a":1}:1}', "[1,]", "[,1]", "[1 2]", "[1:2]", "[:]",
    '{"a":1', '{"a":[1}', '{"a":[1}]', "[}", "{]", "[[]", "[]]", '{"a":{"b":1}', '["a":1]',
    "01", "-01", "00", "1.", ".5", "-", "-.5", "+1", "1e", "1e+", "1.e1", "1..2", "1.2.3",
    "1e1.5", "1e1e1", "0x10", "1_000", "1a", "--1", "- 1", "1-1", "Infinity", "NaN", "-NaN",
    "tru", "tru}", "True", "TRUE", "truE", "truetrue", "true1", "nul", "nulll", "fals", "f", "t",
    "falsy", "none", "a", "'a'", '{"a":tr,e}', '{"a":nu"b"}', '{"a":fa"b":}',
    '"\t"', '"\n"', '"\x00"', '"\\a"', '"\\x41"', '"\\u12"', '"\\u12g4"', "// x\n1", "1 // x",
    "\ufeff{}", "\xa01", "1\x00", "\x00", "[1]\x0b", "{}\x0c", "[" * 33 + "]" * 33,
]
# fmt: on


def what_is_json_is_read():
    for text, said in sample(_GOOD, 7):
        data = text.encode()
        for form in (data, bytearray(data)):
            found = parse(form)
            if said is not None:
                equal((type(found), found), (type(said), said), text)


def what_only_looks_like_it_is_refused():
    for text in sample(_BAD, 40):
        for data in (text.encode(), bytearray(text.encode())):
            try:
                found = parse(data)
            except ValueError:
                continue
            raise AssertionError(f"{text!r} was taken for {found!r}")


def bytes_that_are_no_text_are_refused():
    for data in (b'"\xff"', b'{"a":"\xc3"}', b"\xff", b'{"a\x80":1}', b"[\x80]", b"\xc3\xa4"):
        try:
            found = parse(data)
        except ValueError:
            continue
        raise AssertionError(f"{data!r} was taken for {found!r}")


def a_comma_a_colon_or_a_quote_that_is_lost_makes_no_other_value():
    text = b'{"outputs": {"6": {"deadband_us": 8, "subtrim_us": -20}}, "gps": {"enabled": false}}'
    wrong = 0
    for at in sample(range(len(text)), 20):
        for data in (text[:at] + text[at + 1 :], text[:at] + b" " + text[at + 1 :]):
            if text[at] not in b':,"{}':
                continue
            try:
                found = parse(data)
            except ValueError:
                wrong += 1
                continue
            raise AssertionError(f"{data!r} was taken for {found!r}")
    assert wrong
