"""Streams, renders and the processes that trace them."""
