"""One picture on several renderers: its home leases bands of blocks, and assistants trace them.

ledger     which bands of which blocks are free, leased or done; pure arithmetic
home       the home's side: gives leases, traces its own bands, takes results in ascending order
assistant  the assistant's side: a scene, and the leases that it traces
"""
