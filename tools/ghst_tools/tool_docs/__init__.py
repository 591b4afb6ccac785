"""The examples in docs/tools.md: run anew, and the recording that they use."""
