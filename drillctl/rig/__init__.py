"""The parts of a rig: plain physics, numbers only."""
