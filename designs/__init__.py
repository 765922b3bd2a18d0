"""Pluggable generators of designed experiments."""
