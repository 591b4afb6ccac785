"""`ghst doctor`: what is there, what is missing, and the next step."""
