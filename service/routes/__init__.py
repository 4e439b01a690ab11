"""The endpoints: a handler parses, asks, answers. What they ask is in `House`, which the application keeps."""
