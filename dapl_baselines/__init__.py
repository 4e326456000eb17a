"""Policies that are learned or planned, on top of the toolkit, which never imports them."""
