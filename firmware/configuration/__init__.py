"""What a user may set: declared once, checked on the board and on the host by the same code."""
