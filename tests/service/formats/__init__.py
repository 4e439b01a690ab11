"""Files that people upload, and what is read from them."""
