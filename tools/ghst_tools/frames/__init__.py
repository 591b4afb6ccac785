"""Frames as bytes of a recording: finding them, reading their fields, the formats of files.

`finder` cuts bytes into frames and what lies between them, `fields` reads one frame, `text` and
`json_lines` write it as a line, `formats` reads files, `recording` holds a whole one in arrays.
The protocol's facts come from `ghst`; nothing in here knows a port or a screen.
"""
