"""The reliability campaign, and the rigs and generators that it shares with the tests."""
