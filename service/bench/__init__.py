"""Measurements of the product by the product: `sunbox bench`."""
