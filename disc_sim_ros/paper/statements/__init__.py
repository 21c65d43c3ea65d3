"""Every statement of the paper's text with a number, compared with this simulator."""
