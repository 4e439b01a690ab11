"""Whether two pictures differ beyond noise, where, and with which certainty.

evidence    sums over independent groups of samples of both
decision    tests that need no knowledge of how noise is distributed; the corrected p-values
schedule    which samples are taken, one group after the other
comparison  takes groups of samples while it is undecided
under_way   how far comparisons are
regions     where the pictures differ
figures     how far they differ, noise included: RMSE, PSNR, FLIP, SSIM
flip        LDR-FLIP
filters     convolution
maps        pictures of where they differ
"""
