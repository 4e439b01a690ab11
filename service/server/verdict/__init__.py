"""Verdicts: do two pictures differ beyond noise, where, and with which certainty.

evidence    sums over independent groups of samples of both
decision    tests that need no knowledge of how noise is distributed; the corrected p-values
comparison  takes groups of samples while it is undecided: which, and how far comparisons are
regions     where the pictures differ: p-values, rectangles, maps as pictures
figures     how far they differ, noise included: RMSE, PSNR, LDR-FLIP, SSIM
"""
