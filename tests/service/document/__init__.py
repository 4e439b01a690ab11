"""The document: what is taken, what is refused, what it becomes."""
