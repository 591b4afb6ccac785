#define MICROPY_HW_BOARD_NAME "Generic ESP32S3 module"
#define MICROPY_HW_MCU_NAME "ESP32S3"

// The firmware uses neither radio; without Bluetooth there is more memory.
#define MICROPY_PY_BLUETOOTH (0)

// The console is on both sockets: USB and the serial bridge.
#define MICROPY_HW_ENABLE_UART_REPL (1)
