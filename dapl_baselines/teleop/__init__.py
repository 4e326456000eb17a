"""Driving the benchmark's robot by hand: devices, and the person as a policy (paper, "Human Teleoperation")."""
