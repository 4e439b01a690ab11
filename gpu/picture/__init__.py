"""One picture in the making: its samples are added slice by slice, and it can be read at any time.

picture       its life: accumulators on the device, settings, saving and restoring
blocks        the parts into which a picture's samples are cut, and how their sums become one
accumulators  sums of samples on the device
bands         parts of a block that different renderers trace
shared_block  a block that several renderers trace: shared, traced and written in bands, completed
light_paths   caustics, traced from the lights: their sums and the error of these
passes        which samples are traced next, slice by slice
schedule      the protocol of `tiles` and `adaptive`, which cut a pass into dispatches
tiles         how a pass is cut, by the measured cost of each band of rows
adaptive      passes over the areas of a sample plan
sample_plan   how many samples each part of a picture gets
noise_meter   a picture's error, from a second, independent estimate of a share of its pixels
readout       a picture's mean, variance, noise and first hits, read from the accumulators
dispatcher    runs kernels over parts of a picture
first_hit     AOVs of the first hit
prior         what a picture showed before an edit, as a guess at what it shows afterwards
look          exposure, tone map, primaries and tables of a picture that is shown
coverage      how much of each pixel a shape or a material covers
resolve       accumulators to display values, on the device
display       AOVs as pictures for the eye
filters       pixel filters as inverse distributions
saved         a picture's state off the device
"""
