"""Every statement of the paper's text that has a number, beside what this model gives."""
