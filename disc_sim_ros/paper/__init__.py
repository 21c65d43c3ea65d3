"""The figures of the paper, one file per figure, and the statements of its text."""
