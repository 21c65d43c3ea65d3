"""Pages that show flights in a browser: one file each, without any other file or host."""
