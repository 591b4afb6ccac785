"""A Ghost receiver on a serial adapter: `ghst simulate`."""
