"""Where a disc lands, from measurements while it flies."""
