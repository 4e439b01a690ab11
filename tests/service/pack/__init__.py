"""From the document to arrays."""
