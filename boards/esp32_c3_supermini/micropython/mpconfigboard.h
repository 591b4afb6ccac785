#define MICROPY_HW_BOARD_NAME "ESP32C3 module"
#define MICROPY_HW_MCU_NAME "ESP32C3"

// The firmware uses neither radio; without Bluetooth there is more memory.
#define MICROPY_PY_BLUETOOTH (0)
