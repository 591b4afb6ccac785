// For the file of frozen code that MicroPython's tools/mpy-tool.py writes.
//
// Native and viper code for the Cortex-M0+ has words in it that it loads relative to the program
// counter, and is made to stand on a multiple of 4. Up to MicroPython 1.25 at least, mpy-tool asks
// for a multiple of 2: then half of the functions read other numbers than they should.
#define aligned(bytes) aligned((bytes) < 4 ? 4 : (bytes))
