"""Gymnasium's vector environment on a GPU."""
