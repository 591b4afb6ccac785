"""The self-test of a real board, or the emulated one: `ghst selftest`."""
