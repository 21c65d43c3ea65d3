"""policy_node: flies a learned policy on a sim_node."""
