"""Passive listening on the wire between a Ghost receiver and a flight controller."""
