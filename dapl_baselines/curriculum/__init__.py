"""World model and policy improve each other in turn (paper, "Curriculum Learning with Policy Interaction")."""
