"""predictor_node: where a disc will land, while it flies."""
