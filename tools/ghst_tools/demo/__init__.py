"""`ghst demo`: a simulated Ghost receiver flies an emulated Pico, and every pulse is judged."""
