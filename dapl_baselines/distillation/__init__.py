"""A student with points and no privileged input learns from a teacher (paper, "Dynamics Distillation")."""
