/* The frame of a control interrupt in C for a Cortex-M0+, to compare with MicroPython: CRC, four
 * channels of 12 bits, four of 8, as pulses in quarter microseconds. Position independent, calls
 * nothing. `ghst bench` compiles it and puts it into the emulated chip's RAM. */

#include <stdint.h>

int decode(const uint8_t *frame, const uint8_t *table, uint16_t *pulses)
{
    uint8_t crc = 0;
    for (int at = 2; at < 13; at++)
        crc = table[crc ^ frame[at]];
    if (crc != frame[13])
        return 0;
    int scale = 5, base = 3520;
    if (frame[2] & 0x20) {
        scale = 4;
        base = 3952;
    }
    const uint8_t *byte = frame + 3;
    for (int at = 0; at < 4; at += 2, byte += 3) {
        uint32_t bits = byte[0] | byte[1] << 8 | byte[2] << 16;
        pulses[at] = ((bits & 0xFFF) * scale >> 2) + base;
        pulses[at + 1] = ((bits >> 12) * scale >> 2) + base;
    }
    scale <<= 2;
    for (int at = 4; at < 8; at++)
        pulses[at] = *byte++ * scale + base;
    return 1;
}
