"""`ghst monitor`: the state of a running board, live."""
